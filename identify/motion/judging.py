"""What a fitted motion says on the records that judge, which were not fitted: its gap, and the evidence for
one model over another.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import effective_samples
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
        """Log odds from the likelihood of Gaussian residuals; explained: the fraction of the gap that goes.

        Of each joint's signal the variance is that of its noise, or what the better model leaves where that
        is more, and as many samples count as that residual has independent ones: what both models get wrong
        is no evidence for either.  Where the records that judge were fitted, parameters have the price of
        Schwarz 1978.
        """
        if not np.isfinite(after.gap):
            return Gain(-np.inf, -np.inf, confirmed=False, material=False)
        if not np.isfinite(before.gap):
            return Gain(np.inf, 1.0)
        log_odds, independent = 0.0, 0.0
        for old, new in zip(before.residuals, after.residuals, strict=True):
            for pair in zip(old.T, new.T, strict=True):
                more, count = _log_odds(*pair)
                log_odds, independent = log_odds + more, independent + count
        log_odds -= _price(before, after, independent)
        return Gain(log_odds, 1 - after.gap / before.gap, after.gap < before.gap)


def judging(problem: MotionProblem) -> TrajectoryObjective:
    """The objective of the records for validation; of all where none is."""
    records = [record for record in problem.records if record.settings.use == "validate"] or problem.records
    return TrajectoryObjective(problem, records, problem.file.study.noise)


def _log_odds(before: Array, after: Array) -> tuple[float, float]:
    """What two residuals (samples,) of a joint's signal say for the second, and how many independent samples
    they have.
    """
    used = np.isfinite(before)
    if not used.any():
        return 0.0, 0.0
    old, new = before[used], after[used]
    squares = float(np.mean(old**2)), float(np.mean(new**2))
    better = after if squares[1] < squares[0] else before
    count = effective_samples(np.where(used, better, 0.0), used, centred=False)
    if np.abs(old - new).max() <= _TOUCH:
        return 0.0, count
    return 0.5 * count * (squares[0] - squares[1]) / max(1.0, min(squares)), count


def _price(before: FittedMotion, after: FittedMotion, independent: float) -> float:
    """Of the parameters that `after` has more, where they were fitted to the records that judge, of so many
    independent samples.
    """
    if any(record.settings.use == "validate" for record in after.problem.records):
        return 0.0
    return (after.free - before.free) / 2 * float(np.log(max(independent, 2.0)))


def free_parameters(problem: MotionProblem) -> int:
    """Number of parameters that a fit moves."""
    return sum(parameter.free for parameter in problem.parameters)
