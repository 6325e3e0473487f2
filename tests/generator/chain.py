"""The measurement chain from continuous motion to sampled, noisy records: sensors, anti-alias filter,
sampling, noise.

Force and responses, simulated at `oversampling` times the sampling rate, pass the same linear-phase filter
(windowed sinc, Kaiser window, 80 dB, flat to 0.4 and closed from 0.6 of the sampling rate); then every
`oversampling`-th value is kept.  The filter's delay, common to all, only shifts the record's beginning.  What
aliases lands above 0.4 of the rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import upfirdn

from tests.generator.rigid import Array

_ATTENUATION_DB = 80.0
_EDGES = (0.4, 0.6)
_QUIET = 2
"""Samples of rest before the filter first sees the impact; with half the filter's length they make the
pre-trigger (29 ms at 512 Hz).
"""


@dataclass(frozen=True)
class Chain:
    """Sampling and what happens to each signal on the way.

    rate (Hz), duration (s); sensors maps a point's name to the matrix (3, 3) from true to recorded x, y, z;
    delay (s) of all responses against the force; window_decay (1/s) that is really applied; noise (standard
    deviations) of force (N) and response (m/s^2).
    """

    rate: float
    duration: float
    oversampling: int
    noise_force: float
    noise_response: float
    window_decay: float
    delay: float = 0.0
    sensors: Mapping[str, Array] = field(default_factory=dict)

    @property
    def samples(self) -> int:
        """Samples in a record."""
        return round(self.duration * self.rate)

    @property
    def step(self) -> float:
        """Time step of the simulation, s."""
        return 1 / (self.rate * self.oversampling)

    @property
    def steps(self) -> int:
        """How many steps of the simulation fill a record, which begins some samples (the pre-trigger) before
        it.
        """
        return (self.samples - _QUIET) * self.oversampling

    def window(self) -> Array:
        """The exponential window (samples,)."""
        return np.asarray(np.exp(-self.window_decay * np.arange(self.samples) / self.rate))

    def force(self, signal: Array, rng: np.random.Generator) -> Array:
        """Recorded force (samples,), not yet windowed, of the true one (steps,)."""
        return self._record(signal, 0.0) + self.noise_force * rng.normal(size=self.samples)

    def responses(self, signal: Array, names: list[str], rng: np.random.Generator) -> Array:
        """Recorded accelerations (samples, points, 3), not yet windowed, of true ones (steps, points, 3)."""
        clean = self._record(signal, self.delay)
        for number, name in enumerate(names):
            if name in self.sensors:
                clean[:, number] = clean[:, number] @ self.sensors[name].T
        return np.asarray(clean + self.noise_response * rng.normal(size=clean.shape))

    def _record(self, signal: Array, delay: float) -> Array:
        """Filtered and sampled; before the simulation there is nothing but rest."""
        quiet = np.zeros((_QUIET * self.oversampling, *signal.shape[1:]))
        return np.asarray(
            upfirdn(self._kernel(delay), np.concatenate([quiet, signal]), down=self.oversampling, axis=0)[
                : self.samples
            ]
        )

    @property
    def _half(self) -> int:
        """Half the filter's length in steps (Kaiser's formula)."""
        transition = 2 * np.pi * (_EDGES[1] - _EDGES[0]) / self.oversampling
        return int(np.ceil((_ATTENUATION_DB - 8) / (2.285 * transition) / 2)) + 1

    def _kernel(self, delay: float) -> Array:
        """The filter (odd length), delayed further by `delay`, which must stay well within it."""
        half = self._half
        beta = 0.1102 * (_ATTENUATION_DB - 8.7)
        steps = np.arange(-half, half + 1) - delay / self.step
        inside = np.clip(1 - (steps / (half + 1)) ** 2, 0, None)
        cutoff = 2 * np.mean(_EDGES) / self.oversampling / 2
        kernel = 2 * cutoff * np.sinc(2 * cutoff * steps) * np.i0(beta * np.sqrt(inside)) / np.i0(beta)
        return np.asarray(kernel / kernel.sum())
