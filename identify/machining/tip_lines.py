"""The receptance of a tip as it was measured: at the lines of its FRFs, with their noise.

Between its lines the accelerance is taken as straight, above them as constant, as of a mass; below the lowest
line the tip is as soft as there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex


def between(line_hz: Array, known_hz: Array, accelerance: Complex) -> Complex:
    """Receptances (l, ...), m/N, at lines (l,), Hz, not below the lowest known one, of accelerances (lines,
    ...) at the known ones.
    """
    columns = np.moveaxis(accelerance, 0, -1).reshape(-1, len(known_hz))
    parts = np.array([np.interp(line_hz, known_hz, part) for part in columns]).T
    found = parts.reshape(len(line_hz), *accelerance.shape[1:])
    return np.asarray(found / _squares(line_hz, found.ndim))


def _squares(line_hz: Array, dimensions: int) -> Complex:
    """s^2 (l, 1, ...)."""
    return np.asarray((2j * np.pi * line_hz) ** 2).reshape(-1, *[1] * (dimensions - 1))


@dataclass(frozen=True)
class TipLines:
    """Accelerances (lines, 3, 3), m/s^2/N, at lines (lines,), Hz, above 0, along the tool's axes, and the
    standard deviation of their real and of their imaginary parts.
    """

    line_hz: Array
    accelerance: Complex
    noise: Array

    def receptance(self, line_hz: Array) -> Complex:
        """(l, 3, 3), m/N, at lines (l,), Hz, of 0 or more."""
        return between(np.maximum(line_hz, self.line_hz[0]), self.line_hz, self.accelerance)

    def own(self, line_hz: Array) -> Array:
        """(l, 3, 3), m/N: standard deviation of either part by noise of that line alone."""
        at = np.maximum(line_hz, self.line_hz[0])
        right = np.clip(np.searchsorted(self.line_hz, at), 1, len(self.line_hz) - 1)
        low, high = self.line_hz[right - 1], self.line_hz[right]
        part = np.clip((at - low) / (high - low), 0.0, 1.0)[:, None, None]
        found = np.hypot((1 - part) * self.noise[right - 1], part * self.noise[right])
        return np.asarray(found / np.abs(_squares(at, 3)))

    def shared(self, line_hz: Array) -> Complex:
        """(l, 3, 3, 0): noise has nothing in common from line to line."""
        return np.zeros((len(line_hz), 3, 3, 0), dtype=complex)
