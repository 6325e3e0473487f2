"""The search for the motion that tells the most: the best of random motions, improved by steps along the
slopes of the criterion, and brought into the workspace.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.interruption import check
from identify.excite.information import Experiment
from identify.excite.limits import Limits
from identify.excite.series import PeriodicMotion, Series, count_of, series_of
from identify.excite.study import ExciteStudy

_PER_HARMONIC = 20
"""Samples per fastest harmonic at which information is summed."""
_DRAWN = 20
"""Random motions per start, of which the best is improved."""
_STEP = 1e-4
_NEAR_M = 0.05
"""A point this far outside its workspace costs as much as a factor e in every standard deviation."""
_HALVINGS = 40


@dataclass(frozen=True)
class Search:
    """A motion's free numbers and what they are worth."""

    study: ExciteStudy
    limits: Limits
    experiment: Experiment

    @property
    def samples(self) -> int:
        """Of a period, for sums."""
        return _PER_HARMONIC * self.study.harmonics

    def series(self, free: Array) -> Series:
        """The motion of free numbers (n,)."""
        return series_of(free, self.limits, self.study.period_s, self.study.harmonics)

    def cost(self, free: Array) -> Array:
        """(motions,), lower is better, of free numbers (motions, n)."""
        check()
        parts = [self.series(one).sampled(self.samples) for one in free]
        whole = PeriodicMotion(
            *(
                np.concatenate([getattr(part, what) for part in parts])
                for what in PeriodicMotion.__match_args__
            )
        )
        score = self.experiment.score(self.experiment.information(whole, len(parts)))
        far = np.zeros(len(free))
        if self.limits.regions:
            outside = self.limits.outside(whole.position).reshape(len(parts), -1)
            far = ((outside / _NEAR_M) ** 2).mean(axis=1)
        return np.asarray(len(self.experiment.names) * far - score)

    def slopes(self, free: Array) -> tuple[float, Array]:
        """The cost of free numbers (n,) and its derivatives, by differences taken all at once."""
        values = self.cost(np.vstack([free, free + _STEP * np.eye(len(free))]))
        return float(values[0]), np.asarray((values[1:] - values[0]) / _STEP)


def best_motion(search: Search, done: Callable[[int, int], None] = lambda number, total: None) -> Series:
    """The best motion found, inside the workspace; done: called with how many starts were improved, of all.

    InputError where no motion within the limits shows all that is to be found.
    """
    study, rng = search.study, np.random.default_rng(search.study.seed)
    drawn = rng.normal(size=(_DRAWN * study.starts, count_of(search.limits, study.harmonics)))
    costs = np.concatenate([search.cost(drawn[n : n + _DRAWN]) for n in range(0, len(drawn), _DRAWN)])
    if not np.isfinite(costs).any():
        raise InputError(
            "identify excite",
            "no motion within the limits shows all that is to be found",
            "room to move",
            "widen the limits, let more joints move, or raise `harmonics`",
        )
    best, least = drawn[int(np.argmin(costs))], np.inf
    for number, start in enumerate(np.argsort(costs)[: study.starts], start=1):
        found = scipy.optimize.minimize(
            search.slopes, drawn[start], jac=True, method="L-BFGS-B", options={"maxiter": study.steps}
        )
        if found.fun < least:
            best, least = found.x, float(found.fun)
        done(number, study.starts)
    return _inside(search, search.series(best))


def random_motions(search: Search, count: int) -> list[Series]:
    """Motions at random within the same limits, to compare with."""
    rng = np.random.default_rng([search.study.seed, 1])
    drawn = rng.normal(size=(count, count_of(search.limits, search.study.harmonics)))
    return [_inside(search, search.series(one)) for one in drawn]


def _inside(search: Search, series: Series) -> Series:
    """The motion as it is, or shrunk about the posture of the study until all points stay in the
    workspace.
    """
    posture, limits = search.limits.posture, search.limits

    def stays(share: float) -> bool:
        motion = series.towards(posture, share).sampled(2 * search.samples)
        return float(limits.outside(motion.position).max()) <= 0

    if not limits.regions or stays(1.0):
        return series
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if stays(middle) else (low, middle)
    return series.towards(posture, low * (1 - 1e-3))
