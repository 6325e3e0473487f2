"""Structures drawn at random with their measured FRFs, for the exam of `identify modes` (`modal_exam`).

A structure is a modal damping matrix, frequencies and shapes of modes in and around the band; FRFs are the
solution of s^2 I + s D + Omega^2 at every line, true poles the eigenvalues of its state matrix.  Nothing here
comes from identify.modal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet, Quantity

POWER: dict[Quantity, int] = {"receptance": 0, "mobility": 1, "accelerance": 2}


@dataclass(frozen=True)
class Structure:
    """frequency_hz (L,) of the lines; omega (n,) and modal damping matrix (n, n) of unit modal masses; shapes
    (channels, n); the first `references` channels are hit; decay: of the exponential window (1/s).
    """

    frequency_hz: np.ndarray
    omega: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray
    references: int
    quantity: Quantity
    decay: float
    noise_kind: str

    @property
    def s(self) -> np.ndarray:
        """Where the FRFs are measured, sigma + j omega (L,)."""
        return np.asarray(self.decay + 2j * np.pi * self.frequency_hz)

    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Every oscillating pole (m,), rad/s, of the whole structure, and its shape (m, channels)."""
        n = len(self.omega)
        lower = np.concatenate([-np.diag(self.omega**2), -self.damping], axis=1)
        state = np.concatenate([np.eye(n, 2 * n, n), lower])
        values, vectors = np.linalg.eig(state)
        kept = np.flatnonzero(values.imag > 1e-9 * np.abs(values))
        kept = kept[np.argsort(np.abs(values[kept]))]
        return values[kept], (self.shapes @ vectors[:n, kept]).T

    def frf(self) -> np.ndarray:
        """Exact FRFs (L, channels, references)."""
        n, s = len(self.omega), self.s[:, None, None]
        dynamic = s**2 * np.eye(n) + s * self.damping + np.diag(self.omega**2)
        motion = np.linalg.solve(dynamic, self.shapes[: self.references].T[None].astype(complex))
        return np.asarray(s ** POWER[self.quantity] * (self.shapes @ motion))

    def deviation(self, frf: np.ndarray, noise: float) -> np.ndarray:
        """Standard deviation of the noise on every value of the FRFs, for a noise of that part."""
        rms = np.sqrt(np.mean(np.abs(frf) ** 2, axis=0, keepdims=True))
        if self.noise_kind == "all alike":
            rms = np.full_like(rms, np.sqrt(np.mean(rms**2)))
        coloured = np.sqrt(np.abs(frf) * rms) if self.noise_kind == "coloured" else np.zeros_like(frf, float)
        return np.asarray(noise * np.maximum(rms * (self.noise_kind != "coloured"), coloured))

    def measured(self, noise: float, seed: int) -> FrfSet:
        """The FRFs with noise of that part of their RMS, complex, normal, independent from line to line."""
        frf, rng = self.frf(), np.random.default_rng(seed)
        white = (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape)) / np.sqrt(2)
        sensors = tuple(Channel(node + 1, 3) for node in range(len(self.shapes)))
        return FrfSet(
            self.frequency_hz,
            frf + self.deviation(frf, noise) * white,
            sensors,
            sensors[: self.references],
            self.quantity,
            window_decay_per_s=self.decay,
            source="drawn at random",
        )


def draw(rng: np.random.Generator) -> Structure:
    """A structure of 6 to 40 modes in the band and up to 10 around it."""
    lines = int(rng.choice([400, 800, 1600]))
    high = 10 ** rng.uniform(1.7, 3.5)
    low = high / rng.uniform(4, 30)
    frequency = np.linspace(low, high, lines)
    spacing = frequency[1] - frequency[0]
    inside, zeta = _modes(rng, low, high, spacing)
    below = low * rng.uniform(0.15, 0.92, size=rng.integers(0, 4))
    above = high * rng.uniform(1.06, 3.0, size=rng.integers(1, 7))
    around = np.concatenate([np.zeros(3 * rng.integers(0, 2)), below, above])
    hz = np.concatenate([inside, around])
    zeta = np.concatenate([zeta, np.exp(rng.uniform(np.log(0.003), np.log(0.05), size=len(around)))])
    channels = int(rng.integers(6, 25))
    return Structure(
        frequency,
        2 * np.pi * hz,
        _damping(rng, hz, zeta),
        _shapes(rng, channels, len(hz)),
        int(rng.choice([1, 1, 2, 3])),
        rng.choice(["receptance", "mobility", "accelerance", "accelerance"]),
        float(rng.choice([0.0, 0.0, rng.uniform(1.5, 4.0)]) * spacing),
        str(rng.choice(["each FRF", "each FRF", "all alike", "coloured"])),
    )


def _modes(
    rng: np.random.Generator, low: float, high: float, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and damping ratios of the band; every fourth mode stands beside another one, a tenth to
    three half-power bandwidths away.
    """
    count = int(rng.integers(6, 41))
    hz = low + (high - low) * rng.uniform(0.03, 0.97, size=count)
    middle = np.exp(rng.uniform(np.log(0.002), np.log(0.03)))
    spread = rng.choice([1.0, 2.0, 6.0])
    zeta = np.clip(middle * spread ** rng.uniform(-1, 1, size=count), 0.001, 0.08)
    for k in rng.choice(count // 2, size=count // 4, replace=False):
        beside = count // 2 + k
        width = 2 * zeta[k] * hz[k]
        side = 1 if hz[k] < (low + high) / 2 else -1
        hz[beside] = hz[k] + side * width * np.exp(rng.uniform(np.log(0.1), np.log(3)))
        zeta[beside] = np.clip(zeta[k] * rng.uniform(0.6, 1.6), 0.001, 0.08)
    # A peak narrower than a line is no subject of these lines.
    return hz, np.clip(np.maximum(zeta, spacing / (2 * hz)), 0.001, 0.08)


def _damping(rng: np.random.Generator, hz: np.ndarray, zeta: np.ndarray) -> np.ndarray:
    """2 zeta omega on the diagonal; in every second structure neighbours are coupled by damping."""
    diagonal = 4 * np.pi * zeta * hz
    n = len(hz)
    if rng.random() < 0.5 or n < 2:
        return np.diag(diagonal)
    root = rng.normal(size=(n, 2 * n)) / np.sqrt(2 * n)
    share = rng.uniform(0.1, 0.5)
    mixed = (1 - share) * np.eye(n) + share * (root @ root.T)
    size = np.sqrt(np.diag(mixed))
    scale = np.sqrt(diagonal)
    return np.asarray(scale[:, None] * (mixed / np.outer(size, size)) * scale)


def _shapes(rng: np.random.Generator, channels: int, modes: int) -> np.ndarray:
    """Waves over a plate at random points, or nothing smooth at all."""
    if rng.random() < 0.4:
        return rng.normal(size=(channels, modes))
    at = rng.uniform(size=(channels, 2))
    waves = rng.integers(1, 2 + int(np.sqrt(modes)), size=(modes, 2))
    turn = rng.uniform(0, 2 * np.pi, size=(modes, 2))
    shapes = np.prod(np.sin(np.pi * at[:, None] * waves + turn), axis=2)
    return np.asarray(shapes + 0.1 * rng.normal(size=shapes.shape))
