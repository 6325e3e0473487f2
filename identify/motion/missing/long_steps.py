"""Models are compared in long steps, and what the long step gets wrong at one of them is taken off what was
recorded, so that nothing has to make up for it.

The error of a step changes little from a model to one near it: the measured signals less the error are to the
model in long steps what they are themselves to the model in short ones (deferred correction).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.motion.problem import MotionProblem
from identify.motion.recording import TOOL, PreparedRecord
from identify.motion.trajectory import TrajectoryObjective

Signals = list[list[Array]]
"""(samples, joints) per record and signal, over noise."""


class LongSteps:
    """What steps get wrong at parameter values of a problem with its records as measured, by two simulations
    in short steps, taken to a step of none (Richardson 1911); seen: what is foreseen already, by step.
    """

    def __init__(
        self,
        problem: MotionProblem,
        values: Array,
        shortest_s: float,
        seen: Mapping[float, Signals] | None = None,
    ) -> None:
        self._problem, self._values = problem.continuous, values
        parts = 2 * int(np.ceil(problem.file.study.servo.period_s / shortest_s / 2 - 1e-9))
        self.step_s = problem.file.study.servo.period_s / parts
        once, half = (_rows(self._problem, values, step) for step in (2 * self.step_s, self.step_s))
        self._exact = _mixed(2, half, -1, once)
        self._known: dict[float, Signals] = {}
        self._foreseen = dict(seen or {})

    def error(self, step_s: float) -> Signals:
        """Of a step: exact less simulated, NaN where nothing was measured."""
        if step_s not in self._known:
            self._known[step_s] = _mixed(1, self._exact, -1, _rows(self._problem, self._values, step_s))
        return self._known[step_s]

    def foreseen(self, step_s: float) -> Signals:
        """The same by half the step, as `foreseen` has it."""
        if step_s not in self._foreseen:
            self._foreseen[step_s] = foreseen(self._problem, self._values, step_s)
        return self._foreseen[step_s]

    def records(self, step_s: float) -> tuple[PreparedRecord, ...]:
        """The records less the error of a step."""
        objective, found = _objective(self._problem, step_s), list[PreparedRecord]()
        errors = dict(zip((r.settings.name for r in objective.records), self.error(step_s), strict=True))
        for record in self._problem.records:
            off = errors.get(record.settings.name)
            compared = [quantity for quantity in record.recorded if quantity in objective.noise]
            signals = {
                quantity: record.recorded[quantity] - objective.noise[quantity] * error
                for quantity, error in zip(compared if off else [], off or [], strict=True)
            }
            found.append(_with(record, signals))
        return tuple(found)


def foreseen(problem: MotionProblem, values: Array, step_s: float) -> Signals:
    """The error of a step of a problem at parameter values to first order, by one at half of it: what tells
    in a third of the time whether an error has changed.
    """
    whole, half = (_rows(problem.continuous, values, step) for step in (step_s, step_s / 2))
    return _mixed(2, half, -2, whole)


def _rows(problem: MotionProblem, values: Array, step_s: float) -> Signals:
    rows = _objective(problem, step_s).rows(values[None])
    return [[signal[0] for signal in record] for record in rows]


def _objective(problem: MotionProblem, step_s: float) -> TrajectoryObjective:
    return TrajectoryObjective(replace(problem, step_s=step_s), problem.records, problem.file.study.noise)


def _mixed(a: float, first: Signals, b: float, second: Signals) -> Signals:
    """a times the first plus b times the second."""
    return [
        [a * one + b * other for one, other in zip(*record, strict=True)]
        for record in zip(first, second, strict=True)
    ]


def changed(before: Signals | None, after: Signals) -> float:
    """RMS of what errors of a step have changed by, over noise; from none, where there were none."""
    rows = []
    for n, record in enumerate(after):
        for k, signal in enumerate(record):
            rows.append(np.ravel(signal if before is None else signal - before[n][k]))
    return float(np.sqrt(np.nanmean(np.concatenate(rows) ** 2)))


def _with(record: PreparedRecord, signals: dict[str, Array]) -> PreparedRecord:
    """A record with other signals."""
    if record.measured is None or not signals:
        return record
    tool = signals.pop(TOOL, record.tool)
    measured = replace(record.measured, signals={**record.measured.signals, **signals})
    return replace(record, measured=measured, tool=tool)
