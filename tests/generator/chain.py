"""The measurement chain from continuous motion to sampled, noisy records: sensors, anti-alias filter, sampling, noise.

Force and responses pass the same linear-phase filter (windowed sinc, Kaiser window, 80 dB, flat to 0.4 and closed from 0.6 of
the sampling rate), sampled by the simulation at `oversampling` times the rate, its delay taken out; then every
`oversampling`-th sample is kept.  What aliases lands above 0.4 of the rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import oaconvolve

from tests.generator.rigid import Array

_ATTENUATION_DB = 80.0
_EDGES = (0.4, 0.6)


@dataclass(frozen=True)
class Chain:
    """Sampling and what happens to each signal on the way.

    rate (Hz), duration (s); sensors maps a point's name to the matrix (3, 3) from true to recorded x, y, z; delay (s) of all
    responses against the force; window_decay (1/s) that is really applied; noise (standard deviations) of force (N) and response (m/s^2).
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
    def reach(self) -> int:
        """Half the filter's length in simulation steps."""
        transition = 2 * np.pi * (_EDGES[1] - _EDGES[0]) / self.oversampling
        return int(np.ceil((_ATTENUATION_DB - 8) / (2.285 * transition) / 2)) + 1

    def window(self) -> Array:
        """The exponential window (samples,)."""
        return np.asarray(np.exp(-self.window_decay * np.arange(self.samples) / self.rate))

    def record(self, signal: Array, first: int, delay: float = 0.0) -> Array:
        """Samples (samples, ...) of a signal (steps, ...) that begins `first` steps after the record and is zero before; it must outlast it."""
        kernel = self._kernel(delay)
        filtered = oaconvolve(signal, kernel.reshape(-1, *(1,) * (signal.ndim - 1)), axes=0)
        index = np.arange(self.samples) * self.oversampling - first + self.reach
        result = np.zeros((self.samples, *signal.shape[1:]))
        result[index >= 0] = filtered[index[index >= 0]]
        return result

    def steps(self, first: int) -> int:
        """How many steps from `first` on must be simulated to fill a record."""
        return (self.samples - 1) * self.oversampling - first + self.reach + 1

    def responses(self, signal: Array, names: list[str], first: int, rng: np.random.Generator) -> Array:
        """Recorded accelerations (samples, points, 3), not yet windowed, of true ones (steps, points, 3)."""
        matrices = np.array([self.sensors.get(name, np.eye(3)) for name in names])
        clean = self.record(np.einsum("pij,tpj->tpi", matrices, signal), first, self.delay)
        return clean + self.noise_response * rng.normal(size=clean.shape)

    def force(self, signal: Array, first: int, rng: np.random.Generator) -> Array:
        """Recorded force (samples,), not yet windowed."""
        return self.record(signal, first) + self.noise_force * rng.normal(size=self.samples)

    def _kernel(self, delay: float) -> Array:
        """The filter, delayed by any part of a step besides whole ones (it must stay well within its length)."""
        beta = 0.1102 * (_ATTENUATION_DB - 8.7)
        steps = np.arange(-self.reach, self.reach + 1) - delay / self.step
        inside = np.clip(1 - (steps / (self.reach + 1)) ** 2, 0, None)
        cutoff = 2 * np.mean(_EDGES) / self.oversampling / 2
        kernel = 2 * cutoff * np.sinc(2 * cutoff * steps) * np.i0(beta * np.sqrt(inside)) / np.i0(beta)
        return np.asarray(kernel / kernel.sum())
