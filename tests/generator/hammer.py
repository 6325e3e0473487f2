"""Impacts of an instrumented hammer: half-sines of random amplitude, width and, if wanted, direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tests.generator.rigid import Array, turn


@dataclass(frozen=True)
class Impact:
    """A half-sine of `peak` N from `start` for `width` s; along (3,) is where the hammer pushes, a unit
    vector.

    The load cell reads the whole force, whichever way the hammer is held.
    """

    peak: float
    start: float
    width: float
    along: Array

    @property
    def end(self) -> float:
        """When the hammer leaves, s."""
        return self.start + self.width

    def reading(self, time: ArrayLike) -> Array:
        """What the load cell reads, N, at any times (s)."""
        phase = (np.asarray(time) - self.start) / self.width
        return np.where((phase > 0) & (phase < 1), self.peak * np.sin(np.pi * phase), 0.0)

    def force(self, time: float) -> Array:
        """The force (3,), N."""
        return np.asarray(self.reading(time) * self.along)

    def forces(self, times: Array) -> Array:
        """The same (times, 3), N, at several times."""
        return np.outer(self.reading(times), self.along)


def swing(rng: np.random.Generator, axis: int, level: float, error_deg: float, step: float) -> Impact:
    """One impact along an axis (0, 1, 2): level (N) give or take 20 %, 5 to 8 ms wide, beginning anywhere in
    the first step.

    error_deg is the standard deviation of the two angles by which the hammer is held askew.
    """
    along = np.eye(3)[axis]
    askew = np.radians(error_deg) * rng.normal(size=2)
    across = np.roll(along, 1), np.roll(along, 2)
    along = turn(across[1], askew[1]) @ turn(across[0], askew[0]) @ along
    return Impact(level * rng.uniform(0.8, 1.2), step * rng.uniform(0.0, 1.0), rng.uniform(5e-3, 8e-3), along)
