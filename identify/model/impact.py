"""The impact of a hammer: a half-sine of force, in time and in the transform."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex


@dataclass(frozen=True)
class Impact:
    """A half-sine of `peak` N that lasts `width` s and begins a record of `record` s."""

    peak: float
    width: float
    record: float

    def begun(self, middle: float) -> Impact:
        """With what is left of the record where the middle of the impact is that long after its start, s."""
        return replace(self, record=self.record - max(middle - self.width / 2, 0.0))

    def lasting(self, times: float) -> Impact:
        """With so many times its width."""
        return replace(self, width=times * self.width)

    def transform(self, s: Complex) -> Complex:
        """Laplace transform, N s, at s (...), rad/s."""
        pulsation = np.pi / self.width
        return np.asarray(self.peak * pulsation * (1 + np.exp(-s * self.width)) / (s * s + pulsation**2))

    def means(self, step: float, steps: int) -> Array:
        """(steps,): mean force over each time step (s), N, so that no impulse is lost however coarse the
        steps are.
        """
        time = np.minimum(step * np.arange(steps + 1), self.width)
        impulse = self.peak * self.width / np.pi * (1 - np.cos(np.pi * time / self.width))
        return np.asarray(np.diff(impulse) / step)
