"""Vibrating systems with known modes: FRFs by solving M, C, K at every line, modes by the eigenvalues of the
state matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet, Quantity


@dataclass(frozen=True)
class System:
    """Mass, damping and stiffness (n, n), SI."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray

    @property
    def poles(self) -> np.ndarray:
        """Decaying oscillating poles (m,), rad/s, by size."""
        return self._modes()[0]

    @property
    def shapes(self) -> np.ndarray:
        """Shapes (m, n) of the poles."""
        return self._modes()[1]

    def _modes(self) -> tuple[np.ndarray, np.ndarray]:
        n = len(self.mass)
        state = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [-np.linalg.solve(self.mass, self.stiffness), -np.linalg.solve(self.mass, self.damping)],
            ]
        )
        values, vectors = np.linalg.eig(state)
        kept = np.flatnonzero(values.imag > 0)
        kept = kept[np.argsort(np.abs(values[kept]))]
        return values[kept], vectors[:n, kept].T

    def frf(self, s: np.ndarray, power: int = 2) -> np.ndarray:
        """s^power (s^2 M + s C + K)^-1 at s (L,), (L, n, n)."""
        dynamic = s[:, None, None] ** 2 * self.mass + s[:, None, None] * self.damping + self.stiffness
        return s[:, None, None] ** power * np.linalg.inv(dynamic)


def chain(frequency_hz: list[float], damping_ratio: list[float], seed: int = 0) -> System:
    """Proportionally damped system of unit modal masses with these modes and random orthogonal shapes."""
    shapes = np.linalg.qr(np.random.default_rng(seed).normal(size=(len(frequency_hz),) * 2))[0]
    omega = 2 * np.pi * np.array(frequency_hz)
    damping, stiffness = (
        shapes @ np.diag(values) @ shapes.T for values in (2 * np.array(damping_ratio) * omega, omega**2)
    )
    return System(np.eye(len(omega)), damping, stiffness)


def channels(count: int, direction: int = 3) -> tuple[Channel, ...]:
    """Channels 1:+Z, 2:+Z, ..."""
    return tuple(Channel(node, direction) for node in range(1, count + 1))


def measure(
    system: System,
    frequency_hz: np.ndarray,
    inputs: list[int],
    *,
    noise: float = 0.0,
    seed: int = 0,
    decay: float = 0.0,
    quantity: Quantity = "accelerance",
) -> FrfSet:
    """FRFs of all coordinates against some inputs, with complex white noise of that part of their RMS."""
    frf = system.frf(decay + 2j * np.pi * frequency_hz, POWER[quantity])[:, :, inputs]
    random = np.random.default_rng(seed)
    white = (random.normal(size=frf.shape) + 1j * random.normal(size=frf.shape)) / np.sqrt(2)
    frf = frf + noise * np.sqrt(np.mean(np.abs(frf) ** 2)) * white
    sensors = channels(len(system.mass))
    return FrfSet(
        frequency_hz,
        frf,
        sensors,
        tuple(sensors[i] for i in inputs),
        quantity,
        window_decay_per_s=decay,
        source="simulated",
    )
