"""The modes of the measurements of a study, which do not depend on its model."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields, replace

import numpy as np

from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import analyse
from identify.modal.settings import ESTIMATORS, ModalSettings
from identify.vibration.costs.make_target import ModalTarget
from identify.vibration.problem import Problem

_KEPT = 64
_KNOWN: dict[str, ModalTable | None] = {}
"""So many of what was identified last, by what it was identified in: fits of one test differ in the model."""


@dataclass(frozen=True)
class MeasuredModes:
    """Modes from a table or by modal analysis of the FRFs, and in words where they come from."""

    table: ModalTable
    origin: str


def measured_modes(problem: Problem) -> dict[str, MeasuredModes | None]:
    """Of each measurement, by name; None where an analysis is not possible."""
    return {m.name: modes_of(problem, m.name) for m in problem.measurements}


def modes_of(problem: Problem, name: str) -> MeasuredModes | None:
    """Of the measurement of that name."""
    m = next(one for one in problem.measurements if one.name == name)
    if isinstance(m.target, ModalTarget):
        return MeasuredModes(m.target.data, f"modal table {m.settings.source.name}")
    settings = problem.file.study.modal
    how = "automatic" if settings.modes_hz is None else "chosen by hand"
    table = _identified(m.target.data, settings)
    if table is None:
        return None
    origin = f"modal analysis of the measured FRFs ({ESTIMATORS[settings.estimator]}, {how})"
    return MeasuredModes(table, origin)


def _identified(data: FrfSet, settings: ModalSettings) -> ModalTable | None:
    """By modal analysis, once a process; None where it is not possible."""
    digest = hashlib.sha256(settings.model_dump_json().encode())
    for field in fields(data):
        if field.name != "source":
            value = getattr(data, field.name)
            digest.update(value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode())
    key = digest.hexdigest()
    if key not in _KNOWN:
        if len(_KNOWN) == _KEPT:
            del _KNOWN[next(iter(_KNOWN))]
        try:
            _KNOWN[key] = analyse(data, settings).table
        except InputError:
            _KNOWN[key] = None
    table = _KNOWN[key]
    return None if table is None else replace(table, source=data.source)
