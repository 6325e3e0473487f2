"""Published values to set beside a fit's own: `source`, `parameters` (name: value) and `modes`, in a YAML
file.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from reprlib import repr as shortened
from typing import Any

from identify.core.errors import InputError
from identify.core.yaml_input import plain, read_yaml_file
from identify.measured.modal_tables import ModalTable, parse_modes


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
    data = plain(read_yaml_file(path, "a YAML file with source, parameters and modes"))
    if (
        not isinstance(data, dict)
        or set(data) - {"source", "parameters", "modes"}
        or not isinstance(data.get("source"), str)
    ):
        raise InputError(
            str(path), "other keys", "`source` (text), `parameters` (name: value) and `modes` (a list)"
        )
    parameters, modes = data.get("parameters") or {}, data.get("modes") or []
    for key, value, kind in (("parameters", parameters, dict), ("modes", modes, list)):
        if not isinstance(value, kind):
            expected = "name: value" if kind is dict else "a list of modes"
            raise InputError(f"{path} {key}", f"found {shortened(value)}", expected)
    _check_parameters(path, parameters, known)
    rows = [(f"{path} mode {number}", mode) for number, mode in enumerate(modes, start=1)]
    for where, mode in rows:
        if not isinstance(mode, dict):
            raise InputError(where, f"found {shortened(mode)}", "keys such as frequency_hz: 12.05")
    return Reference(
        data["source"],
        {name: float(value) for name, value in parameters.items()},
        parse_modes(rows, str(path)) if rows else None,
    )


def _check_parameters(path: Path, parameters: dict[Any, Any], known: list[str]) -> None:
    """InputError for a name that is not `known`, or a value that is no finite number."""
    for name, value in parameters.items():
        if name not in known:
            raise InputError(str(path), f"unknown parameter {shortened(name)}", "one of " + ", ".join(known))
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not isfinite(value):
            raise InputError(f"{path} {name}", f"found {shortened(value)}", "a number")
