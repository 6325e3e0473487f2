"""Published values to set beside a fit's own: `source`, `parameters` (name: value) and `modes`, in a YAML
file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from identify.core.errors import InputError
from identify.measured.modal_table import ModalTable
from identify.measured.modal_tables import parse_modes


@dataclass(frozen=True)
class Reference:
    """Where the values come from, the parameters by name (SI), and the modes, or None."""

    source: str
    parameters: dict[str, float]
    modes: ModalTable | None


def read_reference(path: Path, known: list[str]) -> Reference:
    """The reference values of a study; a name that is no parameter of the study (`known`) is an
    InputError.
    """
    try:
        data = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    except (OSError, YAMLError) as error:
        raise InputError(
            str(path), f"cannot be read ({error})", "a YAML file with source, parameters and modes"
        ) from error
    if (
        not isinstance(data, dict)
        or set(data) - {"source", "parameters", "modes"}
        or not isinstance(data.get("source"), str)
    ):
        raise InputError(
            str(path), "other keys", "`source` (text), `parameters` (name: value) and `modes` (a list)"
        )
    parameters = data.get("parameters") or {}
    for name, value in parameters.items():
        if name not in known:
            raise InputError(str(path), f"unknown parameter {name!r}", "one of " + ", ".join(known))
        if not isinstance(value, (int, float)) or not np.isfinite(value):
            raise InputError(f"{path} {name}", f"found {value!r}", "a number")
    rows = [(f"{path} mode {number}", mode) for number, mode in enumerate(data.get("modes") or [], start=1)]
    return Reference(
        data["source"],
        {name: float(value) for name, value in parameters.items()},
        parse_modes(rows, str(path)) if rows else None,
    )
