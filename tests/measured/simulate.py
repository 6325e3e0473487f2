"""Closed-form structures and hammer tests in the time domain, written for these tests alone: nothing here
comes from `identify`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SAMPLE_RATE_HZ = 512.0
SAMPLES = 820


@dataclass(frozen=True)
class Structure:
    """Modes of a proportionally damped structure: frequency (Hz), damping ratio and mass-normalised shapes
    (modes, places).
    """

    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    shapes: np.ndarray

    def receptance(self, s: np.ndarray, struck: slice = slice(None)) -> np.ndarray:
        """(lines, places, struck places): sum of shape shape^T / (s^2 + 2 zeta w s + w^2)."""
        w = 2 * np.pi * self.frequency_hz
        parts = 1 / (s[:, None] ** 2 + 2 * self.damping_ratio * w * s[:, None] + w**2)
        products = self.shapes[:, :, None] * self.shapes[:, None, struck]
        return np.asarray((parts @ products.reshape(len(w), -1)).reshape(len(s), *products.shape[1:]))


def two_masses() -> Structure:
    """Masses of 20 and 10 kg in a row on springs of 4e5 and 2e5 N/m, 3 % modal damping: modes at 15.9 and
    31.8 Hz.
    """
    mass, stiffness = np.diag([20.0, 10.0]), np.array([[6e5, -2e5], [-2e5, 2e5]])
    root = np.diag(1 / np.sqrt(np.diag(mass)))
    values, vectors = np.linalg.eigh(root @ stiffness @ root)
    return Structure(np.sqrt(values) / (2 * np.pi), np.full(2, 0.03), (root @ vectors).T)


def random_structure(seed: int, places: int, modes: int = 6) -> Structure:
    """Modes from 6 to 70 Hz with 1.5 to 5 % damping."""
    random = np.random.default_rng(seed)
    frequency = np.sort(random.uniform(6, 70, modes))
    return Structure(frequency, random.uniform(0.015, 0.05, modes), random.normal(size=(modes, places)) / 3)


def half_sine(start_s: float, width_s: float, peak_n: float) -> np.ndarray:
    """A hammer's force (samples,)."""
    time = np.arange(SAMPLES) / SAMPLE_RATE_HZ
    inside = (time >= start_s) & (time < start_s + width_s)
    return np.where(inside, peak_n * np.sin(np.pi * (time - start_s) / width_s), 0.0)


def response(structure: Structure, force: np.ndarray, place: int) -> np.ndarray:
    """Acceleration (samples, places) to a force (samples,) at one place, from rest; made over 32 blocks so
    that nothing wraps around.
    """
    length = 32 * len(force)
    s = 2j * np.pi * np.fft.rfftfreq(length, 1 / SAMPLE_RATE_HZ)
    accelerance = structure.receptance(s, slice(place, place + 1))[:, :, 0] * s[:, None] ** 2
    spectrum = np.fft.rfft(force, length)[:, None] * accelerance
    return np.asarray(np.fft.irfft(spectrum, length, axis=0)[: len(force)])


def hammer_test(structure: Structure, place: int, hits: int, random: np.random.Generator) -> np.ndarray:
    """Clean signals (hits, samples, 1 + places): force and accelerations; half-sines of about 180 N and 6
    ms.
    """
    force = half_sine(0.01, 0.006, 180.0)
    one = np.column_stack([force, response(structure, force, place)])
    return np.exp(0.1 * random.normal(size=hits))[:, None, None] * one


def random_test(
    structure: Structure, places: list[int], samples: int, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """White forces (samples, inputs) of 10 N RMS and the accelerations (samples, places) to them, running
    since long before.
    """
    force = 10 * random.normal(size=(samples, len(places)))
    s = 2j * np.pi * np.fft.rfftfreq(samples, 1 / SAMPLE_RATE_HZ)
    accelerance = structure.receptance(s)[:, :, places] * s[:, None, None] ** 2
    return force, np.fft.irfft(
        np.einsum("lij,lj->li", accelerance, np.fft.rfft(force, axis=0)), samples, axis=0
    )
