"""The receptance of a tip by the modes that were found in its FRFs, as smooth as these:

    H(s) = sum_k R_k / (s - lambda_k) + R_k* / (s - lambda_k*) + U + L / s^2

with the poles of a modal analysis, and residues R, and U and L for modes above and below, as they give its
rebuilt FRFs back by least squares.  Uncertain are frequencies and dampings, as the analysis says, and
residues, U and L, as what it left of the FRFs does, taken as their noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.results.modes import ModeTable


@dataclass(frozen=True)
class TipModes:
    """line_hz (lines,), Hz: those of the FRFs; poles (m,), rad/s; parts (2 m + 2, 3, 3) along the tool's
    axes: real and imaginary parts of residues, U, L; moved (2 m,), rad/s: change of a pole per standard
    deviation of its frequency, then of its damping; root (2 m + 2, 2 m + 2): of the parts' covariance, per
    noise of an FRF, spread (3, 3).
    """

    line_hz: Array
    poles: Complex
    parts: Array
    moved: Complex
    root: Array
    spread: Array

    def receptance(self, line_hz: Array) -> Complex:
        """(l, 3, 3), m/N, at lines (l,), Hz, of 0 or more; below the lowest known one as there."""
        columns = _columns(self._s(line_hz), self.poles)
        return np.asarray(np.einsum("lk,kij->lij", columns, self.parts))

    def own(self, line_hz: Array) -> Array:
        """(l, 3, 3): nothing is of one line alone."""
        return np.zeros((len(line_hz), 3, 3))

    def shared(self, line_hz: Array) -> Complex:
        """(l, 3, 3, c), m/N: change per standard deviation of each frequency, each damping, and each
        combination of the parts of each FRF.
        """
        s, count = self._s(line_hz), len(self.poles)
        residues = self.parts[:count] + 1j * self.parts[count : 2 * count]
        slopes = [
            np.einsum("lk,kij->lijk", moved / (s[:, None] - poles) ** 2, by)
            for moved, poles, by in (
                (self.moved, np.tile(self.poles, 2), np.tile(residues, (2, 1, 1))),
                (self.moved.conj(), np.tile(self.poles.conj(), 2), np.tile(residues.conj(), (2, 1, 1))),
            )
        ]
        by_parts = _columns(s, self.poles) @ self.root
        each = np.einsum("lc,ij,ia,jb->lijabc", by_parts, self.spread, np.eye(3), np.eye(3))
        return np.concatenate([slopes[0] + slopes[1], each.reshape(len(s), 3, 3, -1)], axis=-1)

    def _s(self, line_hz: Array) -> Complex:
        return np.asarray(2j * np.pi * np.maximum(line_hz, self.line_hz[0]))


def tip_modes(
    modes: ModeTable, line_hz: Array, s: Complex, power: int, rebuilt: Complex, spread: Array
) -> TipModes:
    """From modes and rebuilt FRFs (lines, 3, 3), s^power times receptances in m/N, at s (lines,), rad/s, of
    lines (lines,), Hz; spread (3, 3): RMS of either part of what the modes leave of the measured ones.
    """
    omega, ratio = 2 * np.pi * modes.frequency_hz, modes.damping_ratio
    root = np.sqrt(1 - ratio**2)
    poles = omega * (-ratio + 1j * root)
    std_hz, std_ratio = (np.nan_to_num(one) for one in (modes.frequency_std_hz, modes.damping_std))
    moved = np.concatenate(
        [poles * std_hz / modes.frequency_hz, omega * (-1 - 1j * ratio / root) * std_ratio]
    )
    columns = (s**power)[:, None] * _columns(s, poles)
    size = np.linalg.norm(columns, axis=0)
    left, right = (np.concatenate([one.real, one.imag]) for one in (columns / size, rebuilt.reshape(-1, 9)))
    q, r = np.linalg.qr(left)
    back = np.linalg.inv(r) / size[:, None]
    return TipModes(line_hz, poles, (back @ (q.T @ right)).reshape(-1, 3, 3), moved, back, spread)


def _columns(s: Complex, poles: Complex) -> Complex:
    """(l, 2 m + 2): what real and imaginary parts of residues, U and L are multiplied with at s (l,)."""
    line = s[:, None]
    one, other = 1 / (line - poles), 1 / (line - poles.conj())
    return np.concatenate([one + other, 1j * (one - other), np.ones_like(line), 1 / line**2], axis=1)
