"""What a fitted motion says on the records that judge, which were not fitted: its gap, and the evidence for
one model over another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array
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
    def powers(self) -> list[Power]:
        """Of each joint's signal on the records that judge and then on those that were fitted."""
        return [power(column) for one in (*self.residuals, *self.fitted_residuals) for column in one.T]

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
    these were not fitted, from which they confirm a gain; prior: natural logarithm of how likely a model is
    before any data.
    """

    models: Sequence[FittedMotion] = ()
    least: float = 0.0
    prior: Callable[[FittedMotion], float] = lambda _: 0.0

    def gain(self, before: FittedMotion, after: FittedMotion) -> Gain:
        """Log odds from the likelihood of Gaussian residuals; explained: the fraction of the gap that goes.

        At each frequency of each joint's signal the variance is that of its noise, or what the best of all
        models leaves there where that is more: what all models get wrong is no evidence for any.  Parameters
        have the price of Schwarz 1978.
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
        price += self.prior(before) - self.prior(after)
        return Gain(float(odds.sum() - price), 1 - after.gap / before.gap, confirmed)

    def _log_odds(self, before: FittedMotion, after: FittedMotion) -> tuple[Array, float]:
        """What each joint's signal says for the second model, (signals,), without a price; how many
        independent samples all have.
        """
        among = [one for one in (before, after, *self.models) if np.isfinite(one.gap)]
        odds, independent = list[float](), 0.0
        for touched, old, new, *others in zip(
            _touched(before, after), *(one.powers for one in among), strict=True
        ):
            scale = min((old, new, *others), key=lambda one: one.total).scale
            odds.append(0.5 * float(np.sum((old.values - new.values) / scale)) if touched else 0.0)
            independent += old.used * float(np.mean(1 / scale)) if old.used else 0.0
        return np.array(odds), independent


@dataclass(frozen=True)
class Power:
    """Squares of a joint's signal over noise by frequency (n,), whose sum is that over its samples, and how
    many of these there are (Whittle 1953).
    """

    values: Array
    used: int

    @property
    def total(self) -> float:
        """Sum of squares."""
        return float(self.values.sum())

    @cached_property
    def scale(self) -> Array:
        """Variance over that of the noise at each frequency (n,): one, or what there is of an octave, or at a
        higher one where that is more; the mean less its standard error, as a mean of few lines is above one
        by chance.  What is wrong slowly is hardly smaller than what is wrong faster, and a single number can
        take away what is slowest.
        """
        size, lines = len(self.values), np.arange(len(self.values))
        octave = np.floor(np.log2(np.maximum(np.minimum(lines, size - lines), 1))).astype(int)
        count = np.bincount(octave)
        mean = np.bincount(octave, self.values) / count * size / max(self.used, 1)
        sure = np.maximum(mean / (1 + np.sqrt(2 / count)), 1.0)
        return np.asarray(np.maximum.accumulate(sure[::-1])[::-1][octave])


def power(residual: Array) -> Power:
    """Of a joint's signal (samples,), NaN where nothing was measured."""
    used = np.isfinite(residual)
    spectrum = np.fft.fft(np.where(used, residual, 0.0))
    return Power(np.abs(spectrum) ** 2 / len(residual), int(used.sum()))


def judging(problem: MotionProblem) -> TrajectoryObjective:
    """The objective of the records for validation; of all where none is."""
    records = [record for record in problem.records if record.settings.use == "validate"] or problem.records
    return TrajectoryObjective(problem, records, problem.file.study.noise)


def _signals(rows: list[list[Array]]) -> list[Array]:
    return [signal[0] for record in rows for signal in record]


def _judged_by_others(problem: MotionProblem) -> bool:
    """Whether the records that judge were not fitted."""
    return any(record.settings.use == "validate" for record in problem.records)


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
