"""Stability lobes in the frequency domain, with the harmonics of the cut.

A tool in a cut whose factors repeat with the tooth frequency f_T vibrates at f + k f_T together; with
Fourier coefficients W_k of the factors, the loop is at its limit where (Budak and Altintas 1998, J. Dyn.
Syst. Meas. Control 120; Merdol and Altintas 2004, J. Manuf. Sci. Eng. 126)

    det(I - a (1 - exp(-i omega T)) [W_{p-r} H(i (omega + r omega_T))]) = 0,   p, r = -h ... h.

Teeth at uneven angles repeat with the turn, and each harmonic has delays of its own
(`Engagement.regenerated`).

A real a is looked for over 0 <= f <= f_T / 2, which holds all of it; at its end lie the flip lobes, which one
frequency alone does not show.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.interruption import check
from identify.machining.engagement import Engagement
from identify.machining.lobes import Limits

_MOST_HARMONICS = 12
_NEAR = 0.5
"""An eigenvalue moves less than this part of its size from a line to the next."""
_REAL = 1e-7


def multi_frequency(
    cut: Engagement, receptance: Callable[[Array], Complex], line_hz: Array, highest_hz: float, rpm: Array
) -> Limits:
    """The limits at spindle speeds rpm (speeds,).

    receptance: (lines,) Hz, of any sign, to (lines, 3, 3), m/N; line_hz (lines,): frequencies that follow its
    resonances; highest_hz: the highest that matters.
    """
    found = []
    for speed in rpm:
        check()
        tooth_hz = cut.repeats * speed / 60
        least, most = (count * cut.teeth // cut.repeats for count in (3, _MOST_HARMONICS))
        harmonics = int(np.clip(np.ceil(highest_hz / tooth_hz) + least, least, most))
        lines = _folded(line_hz, tooth_hz, harmonics)
        orders = np.arange(-harmonics, harmonics + 1)
        values = _eigenvalues(cut, receptance, lines, tooth_hz, orders)
        half = np.array(
            [tooth_hz / 2]
        )  # an even number of orders is symmetric there, and its values are real
        flip = _eigenvalues(cut, receptance, half, tooth_hz, np.arange(-harmonics - 1, harmonics + 1))[0]
        found.append(max(_greatest_real(values, lines), _greatest_flip(flip, tooth_hz / 2)))
    inverse, hz = np.array(found).T
    with np.errstate(divide="ignore"):
        return Limits(1.0 / inverse, np.where(inverse > 0, hz, np.nan))


def _folded(line_hz: Array, tooth_hz: float, harmonics: int) -> Array:
    """The lines as distances from the nearest harmonic, with both ends."""
    near = line_hz[line_hz < harmonics * tooth_hz]
    folded = np.abs(near - np.round(near / tooth_hz) * tooth_hz)
    return np.unique(np.concatenate([folded, np.linspace(0, tooth_hz / 2, 200)]))


def _eigenvalues(
    cut: Engagement,
    receptance: Callable[[Array], Complex],
    lines: Array,
    tooth_hz: float,
    orders: Index,
) -> Complex:
    """(lines, n): the inverse depths, 1/m, real or not; orders: harmonics that take part."""
    most = len(orders) - 1
    numbers = np.arange(-most, most + 1)
    coefficients = dict(zip(numbers.tolist(), cut.harmonics(numbers), strict=True))
    used = np.flatnonzero(np.abs(coefficients[0]).sum(axis=0) > 0)
    factors = np.block([[coefficients[p - r][:, used] for r in orders] for p in orders])
    at = (lines[:, None] + orders * tooth_hz).ravel()
    tip = receptance(at).reshape(len(lines), len(orders), 3, 3)[:, :, used, :]
    kept, count = len(used), len(orders)
    blocks = factors.reshape(count, 3, count * kept)
    loop = np.einsum("lpij,pjc->lpic", tip, blocks).reshape(len(lines), kept * count, kept * count)
    late = cut.regenerated(orders, lines / tooth_hz)
    if not cut.pitches:
        return np.asarray(late[:, :1, 0] * np.linalg.eigvals(loop))
    return np.asarray(np.linalg.eigvals(loop * np.repeat(np.repeat(late, kept, 1), kept, 2)))


def _greatest_real(values: Complex, lines: Array) -> tuple[float, float]:
    """The greatest positive real eigenvalue on the way through the lines, and its frequency; 0 where there is
    none.
    """
    before, after = values[:-1], values[1:]
    nearest = np.argmin(np.abs(before[:, :, None] - after[:, None, :]), axis=2)
    next_to = np.take_along_axis(after, nearest, axis=1)
    crossed = (before.imag * next_to.imag < 0) & (
        np.abs(next_to - before) < _NEAR * np.maximum(np.abs(before), np.abs(next_to))
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        part = before.imag / (before.imag - next_to.imag)
        real = np.where(crossed, before.real + part * (next_to.real - before.real), 0.0)
    hz = lines[:-1, None] + np.where(crossed, part, 0.0) * np.diff(lines)[:, None]
    best = int(np.argmax(real))
    return max(float(real.flat[best]), 0.0), float(hz.flat[best])


def _greatest_flip(values: Complex, half_hz: float) -> tuple[float, float]:
    """The same among the eigenvalues (n,) at half the tooth frequency."""
    real = values.real[np.abs(values.imag) < _REAL * np.abs(values)]
    return float(real.max(initial=0.0)), half_hz
