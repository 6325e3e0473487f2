"""What a fitted motion says on the records that judge, which were not fitted: its gap, and the evidence for
one model over another.
"""

from __future__ import annotations

from collections.abc import Sequence
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
        return _signals(self._judged)

    @cached_property
    def fitted_residuals(self) -> list[Array]:
        """The same on the records that were fitted, where others judge."""
        if not _judged_by_others(self.problem):
            return []
        return _signals(fitted_objective(self.problem).rows(self.fit.values[None]))

    @cached_property
    def sizes(self) -> tuple[Array, Array]:
        """Mean squares, and how many samples are independent, of each joint's signal on the records that
        judge and then on those that were fitted, (signals,) each; NaN where nothing was measured.
        """
        columns = [column for one in (*self.residuals, *self.fitted_residuals) for column in one.T]
        told = [_size(column) for column in columns]
        squares, counts = np.array(told, dtype=float).reshape(-1, 2).T
        return squares, counts

    @cached_property
    def _judging(self) -> TrajectoryObjective:
        return judging(self.problem)

    @cached_property
    def _judged(self) -> list[list[Array]]:
        return self._judging.rows(self.fit.values[None])


@dataclass(frozen=True)
class JudgingRecords:
    """Gains on all records, confirmed by those that judge.

    models: among which gains are compared, on one scale; least: log odds of the records that judge, where
    these were not fitted, from which they confirm a gain.
    """

    models: Sequence[FittedMotion] = ()
    least: float = 0.0

    def gain(self, before: FittedMotion, after: FittedMotion) -> Gain:
        """Log odds from the likelihood of Gaussian residuals; explained: the fraction of the gap that goes.

        Of each joint's signal the variance is that of its noise, or what the best of all models leaves where
        that is more, and as many samples count as that residual has independent ones: what all models get
        wrong is no evidence for any.  Parameters have the price of Schwarz 1978.
        """
        if not np.isfinite(after.gap):
            return Gain(-np.inf, -np.inf, confirmed=False, material=False)
        if not np.isfinite(before.gap):
            return Gain(np.inf, 1.0)
        odds, independent = self._log_odds(before, after)
        judging = sum(signal.shape[1] for signal in after.residuals)
        judged = np.inf if len(odds) == judging else float(odds[:judging].sum())
        price = (after.free - before.free) / 2 * np.log(max(independent, 2.0))
        confirmed = after.gap < before.gap and judged > self.least
        return Gain(float(odds.sum() - price), 1 - after.gap / before.gap, confirmed)

    def _log_odds(self, before: FittedMotion, after: FittedMotion) -> tuple[Array, float]:
        """What each joint's signal says for the second model, (signals,), without a price; how many
        independent samples all have.
        """
        among = [one for one in (before, after, *self.models) if np.isfinite(one.gap)]
        squares, counts = (np.array(part) for part in zip(*(one.sizes for one in among), strict=True))
        told = np.isfinite(squares[0])
        best = np.argmin(np.where(told, squares, 0.0), axis=0)
        least, count = (np.take_along_axis(part, best[None], axis=0)[0] for part in (squares, counts))
        odds = 0.5 * count * (squares[0] - squares[1]) / np.maximum(1.0, least)
        touched = told & np.array(_touched(before, after))
        return np.where(touched, odds, 0.0), float(np.nansum(count))


def judging(problem: MotionProblem) -> TrajectoryObjective:
    """The objective of the records for validation; of all where none is."""
    records = [record for record in problem.records if record.settings.use == "validate"] or problem.records
    return TrajectoryObjective(problem, records, problem.file.study.noise)


def _signals(rows: list[list[Array]]) -> list[Array]:
    return [signal[0] for record in rows for signal in record]


def _judged_by_others(problem: MotionProblem) -> bool:
    """Whether the records that judge were not fitted."""
    return any(record.settings.use == "validate" for record in problem.records)


def _size(residual: Array) -> tuple[float, float]:
    """Mean square of a joint's signal (samples,), and how many of its samples are independent."""
    used = np.isfinite(residual)
    if not used.any():
        return np.nan, np.nan
    count = effective_samples(np.where(used, residual, 0.0), used, centred=False)
    return float(np.mean(residual[used] ** 2)), count


def _touched(before: FittedMotion, after: FittedMotion) -> list[bool]:
    """Of which joint's signals anything changes that can be seen."""
    pairs = zip(
        (*before.residuals, *before.fitted_residuals),
        (*after.residuals, *after.fitted_residuals),
        strict=True,
    )
    away = [np.abs(old - new) for old, new in pairs]
    return [bool(np.nanmax(column, initial=0.0) > _TOUCH) for one in away for column in one.T]


def free_parameters(problem: MotionProblem) -> int:
    """Number of parameters that a fit moves."""
    return sum(parameter.free for parameter in problem.parameters)
