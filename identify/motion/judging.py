"""What a fitted motion says on the records that judge, which were not fitted: its gap, and the evidence for
one model over another.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import log_likelihood_gain
from identify.core.parameters import Scale
from identify.fitting.fit import Fit
from identify.fitting.selection.gain import Gain
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate
from identify.motion.trajectory import TrajectoryObjective

_TOUCH = 0.02
"""A residual that changes nowhere by more than this part of its noise says nothing of an effect: even
thousands of samples make no odds of it."""


@dataclass(frozen=True)
class FittedMotion:
    """The problem with effects added, and its fit."""

    problem: MotionProblem
    fit: Fit
    added: tuple[MotionCandidate, ...] = ()
    fitted: TrajectoryObjective | None = None
    """What was minimised, which remembers the last motions."""

    @property
    def free(self) -> int:
        """Number of free parameters."""
        return free_parameters(self.problem)

    @cached_property
    def objective(self) -> TrajectoryObjective:
        """That of the fit."""
        return self.fitted or fitted_objective(self.problem)

    @cached_property
    def seen(self) -> tuple[Array, Array]:
        """Residuals over noise (count,) of the fit, over the root of their number, and their derivatives
        (count, free).
        """
        return self.objective.residuals(self.fit.values, Scale(self.problem.parameters).free)

    @cached_property
    def gap(self) -> float:
        """The gap on the records that judge; inf where the motion runs away."""
        return float(self._judging.costs_of(self._judged)[0])

    @cached_property
    def residuals(self) -> list[Array]:
        """Residuals over noise on the records that judge, (samples, joints) each, NaN where nothing was
        measured.
        """
        return [signal[0] for record in self._judged for signal in record]

    @cached_property
    def _judging(self) -> TrajectoryObjective:
        return judging(self.problem)

    @cached_property
    def _judged(self) -> list[list[Array]]:
        return self._judging.rows(self.fit.values[None])


class JudgingRecords:
    """Gains on the records that judge."""

    def gain(self, before: FittedMotion, after: FittedMotion) -> Gain:
        """Log odds from the likelihood ratio of correlated residuals; explained: the fraction of the gap that
        is gone.

        Where the records that judge were fitted, parameters have the price of Schwarz 1978.
        """
        if not np.isfinite(after.gap):
            return Gain(-np.inf, -np.inf, confirmed=False, material=False)
        if not np.isfinite(before.gap):
            return Gain(np.inf, 1.0)
        pairs = zip(before.residuals, after.residuals, strict=True)
        log_odds = sum(_log_odds(old, new) for old, new in pairs) - _price(before, after)
        return Gain(log_odds, 1 - after.gap / before.gap, after.gap < before.gap)


def judging(problem: MotionProblem) -> TrajectoryObjective:
    """The objective of the records for validation; of all where none is."""
    records = [record for record in problem.records if record.settings.use == "validate"] or problem.records
    return TrajectoryObjective(problem, records, problem.file.study.noise)


def _log_odds(before: Array, after: Array) -> float:
    """What two residuals (samples, joints) of one signal say, joints together."""
    total = 0.0
    for old, new in zip(before.T, after.T, strict=True):
        used = np.isfinite(old)
        if used.any() and np.abs(old - new)[used].max() > _TOUCH:
            total += log_likelihood_gain(old, new, used)[0]
    return total


def _price(before: FittedMotion, after: FittedMotion) -> float:
    """Of the parameters that `after` has more, where they were fitted to the records that judge."""
    if any(record.settings.use == "validate" for record in after.problem.records):
        return 0.0
    return (after.free - before.free) / 2 * float(np.log(judging(after.problem).count))


def free_parameters(problem: MotionProblem) -> int:
    """Number of parameters that a fit moves."""
    return sum(parameter.free for parameter in problem.parameters)
