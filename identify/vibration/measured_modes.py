"""The modes of the measurements of a study, which do not depend on its model."""

from __future__ import annotations

from dataclasses import dataclass

from identify.core.errors import InputError
from identify.measured.modal_table import ModalTable
from identify.modal.analysis import analyse
from identify.modal.settings import ESTIMATORS
from identify.vibration.costs.target import ModalTarget
from identify.vibration.problem import Problem


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
    try:
        table = analyse(m.target.data, settings).table
    except InputError:
        return None
    origin = f"modal analysis of the measured FRFs ({ESTIMATORS[settings.estimator]}, {how})"
    return MeasuredModes(table, origin)
