"""Stability lobes in the frequency domain.

The cut closes a loop: force = a W (r(t) - r(t - T)), r = H force.  With the mean W_0 of W over a tooth period
T (zeroth order; Altintas and Budak 1995, Ann. CIRP 44), the loop is at its limit where

    det(I - a (1 - exp(-i omega T)) W_0 H(i omega)) = 0.

With an eigenvalue 1/m of W_0 H, the depth a is real where cot(omega T / 2) = Im m / Re m, and is then
a = Re m (1 + (Im m / Re m)^2) / 2.  All nine receptances of the tip and any lead angle take part.
Without the delay, det(I - a W_0 H) = 0 is the limit of mode coupling (Gasparetto 1998, Pan et al. 2006).
Of uneven teeth, exp(-i omega T) is the mean over the teeth, each with a time of its own (Altintas, Engin and
Budak 1999): the depth is then real where the inverse depth (1 - mean exp(-i omega T_j)) / m is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from identify.core.arrays import Array, Complex

_RANK, _PER_WAVE = 1e-9, 40
"""Least part of an eigenvalue that counts; lines for each wave between two teeth."""


@dataclass(frozen=True)
class Limits:
    """The least depth, m, at each spindle speed (..., speeds), inf where there is none, and the frequency,
    Hz, at which the tool then chatters, NaN where there is none.
    """

    depth: Array
    chatter_hz: Array


def inverse_eigenvalues(mean: Array, receptance: Complex) -> Complex:
    """m (..., lines, branches), N/m per m of depth: inverse eigenvalues of W_0 H, of full rank alone, each
    branch continuous over the lines.

    mean (3, 3): W_0; receptance (..., lines, 3, 3).
    """
    left, sizes, right = np.linalg.svd(mean)
    kept = sizes > _RANK * sizes[0]
    reduced = (right[kept] @ receptance @ left[:, kept]) * sizes[kept]
    with np.errstate(divide="ignore", invalid="ignore"):
        return 1.0 / _continuous(np.linalg.eigvals(reduced))


def _continuous(values: Complex) -> Complex:
    """Values (..., lines, branches) in the order that follows them from line to line."""
    count = values.shape[-1]
    orders = np.array(list(permutations(range(count))))
    moved = np.abs(values[..., 1:, None, :] - values[..., :-1, :][..., orders])
    best = np.argmin(moved.sum(axis=-1), axis=-1)  # the order of the line before that is nearest to this one
    flat = best.reshape(-1, best.shape[-1])
    chosen = np.tile(np.arange(count), (len(flat), flat.shape[1] + 1, 1))
    inverse = np.argsort(orders, axis=1)
    for row, line in np.argwhere(flat):
        # from here on, a branch is where its place at the line before went; order 0 leaves it where it is
        chosen[row, line + 1 :] = inverse[flat[row, line]][chosen[row, line]]
    return np.take_along_axis(values, chosen.reshape(*values.shape[:-1], count), axis=-1)


def zeroth_order(inverse: Complex, line_hz: Array, teeth: int, rpm: Array) -> Limits:
    """The limits at spindle speeds rpm (speeds,); inverse (..., lines, branches): `inverse_eigenvalues`."""
    first = crossings(inverse, line_hz, teeth, rpm, 1)
    return Limits(first.depth[..., 0], first.chatter_hz[..., 0])


def crossings(inverse: Complex, line_hz: Array, teeth: int, rpm: Array, count: int) -> Limits:
    """(..., speeds, count): the first of the depths where the loop is at a limit, the least of which is the
    limit; infinite beyond those that there are.
    """
    real, imaginary = inverse.real, inverse.imag
    positive = real > 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depth = np.where(positive, (real + imaginary**2 / real) / 2, np.inf)
    phase = np.arctan2(np.where(positive, real, np.nan), imaginary) / np.pi  # of 2 pi, in (0, 1)
    hz = line_hz[:, None]
    found, where = [], []
    for speed in rpm:
        waves = hz * (60.0 / (teeth * speed)) - phase  # whole where the depth is real
        least, at = _least_at_whole(waves, depth, hz, count)
        found.append(least)
        where.append(at)
    return Limits(np.stack(found, axis=-2), np.stack(where, axis=-2))


def uneven_crossings(
    inverse: Complex, line_hz: Array, pitches: tuple[float, ...], rpm: Array, count: int
) -> Limits:
    """`crossings` (speeds, count) of teeth that are so far, rad, from the one before; inverse (lines,
    branches).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        eigenvalues = np.nan_to_num(1 / inverse).T  # none where the tip is rigid
    depth, at = np.full((len(rpm), count), np.inf), np.full((len(rpm), count), np.nan)
    for row, turn_s in enumerate(60.0 / rpm):
        waves = line_hz[-1] * turn_s * max(pitches) / (2 * np.pi)
        fine = np.union1d(line_hz, np.linspace(line_hz[0], line_hz[-1], int(_PER_WAVE * waves) + 2))
        late = 1 - np.mean(np.exp(-1j * np.outer(fine * turn_s, pitches)), axis=1)
        values = np.array([late * np.interp(fine, line_hz, one) for one in eigenvalues]).T
        before, after = values[:-1], values[1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            part = before.imag / (before.imag - after.imag)
            real = before.real + part * (after.real - before.real)
        real = np.where((before.imag * after.imag < 0) & (real > 0), real, 0.0)
        hz = fine[:-1, None] + part * np.diff(fine)[:, None]
        best = np.argsort(-real, axis=None)[:count]
        found = real.flat[best]
        depth[row, : len(best)] = np.where(found > 0, 1 / np.where(found > 0, found, 1.0), np.inf)
        at[row, : len(best)] = np.where(found > 0, hz.flat[best], np.nan)
    return Limits(depth, at)


def _least_at_whole(waves: Array, depth: Array, hz: Array, count: int) -> tuple[Array, Array]:
    """The least depths (..., count), and their frequencies, where waves (..., lines, branches) pass a whole
    number.
    """
    low, high = waves[..., :-1, :], waves[..., 1:, :]
    below, above = np.minimum(low, high), np.maximum(low, high)
    first, last = np.ceil(below), np.floor(above)
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = (first <= last) & (last >= 0)
        span = high - low
        least, at = np.full(crossed.shape, np.inf), np.full(crossed.shape, np.nan)
        for whole in (np.maximum(first, 0.0), last):
            part = np.where(span == 0, 0.0, (whole - low) / span)
            value = depth[..., :-1, :] + part * (depth[..., 1:, :] - depth[..., :-1, :])
            better = crossed & (part >= 0) & (part <= 1) & (value < least)
            least = np.where(better, value, least)
            at = np.where(better, hz[:-1] + part * (hz[1:] - hz[:-1]), at)
    flat, flat_at = (one.reshape(*one.shape[:-2], -1) for one in (least, at))
    best = np.argmin(flat, axis=-1)[..., None] if count == 1 else np.argsort(flat, axis=-1)[..., :count]
    return np.take_along_axis(flat, best, -1), np.take_along_axis(flat_at, best, -1)


def mode_coupling(inverse: Complex, line_hz: Array) -> Limits:
    """The least depth at which the cut is unstable without regeneration, (...,), and its frequency: 0 where
    the tool is pulled in without oscillating.
    """
    real, imaginary = inverse.real, inverse.imag
    with np.errstate(invalid="ignore", divide="ignore"):
        at_rest = (line_hz[:-1, None] == 0) & (
            np.abs(imaginary[..., :-1, :]) <= 1e-9 * np.abs(real[..., :-1, :])
        )
        crossed = (imaginary[..., :-1, :] * imaginary[..., 1:, :] < 0) | at_rest
        part = np.where(
            at_rest, 0.0, imaginary[..., :-1, :] / (imaginary[..., :-1, :] - imaginary[..., 1:, :])
        )
        value = real[..., :-1, :] + part * (real[..., 1:, :] - real[..., :-1, :])
    least = np.where(crossed & (value > 0), value, np.inf)
    at = line_hz[:-1, None] + part * np.diff(line_hz)[:, None]
    flat, flat_at = (one.reshape(*one.shape[:-2], -1) for one in (least, np.broadcast_to(at, least.shape)))
    best = np.argmin(flat, axis=-1)[..., None]
    depth = np.take_along_axis(flat, best, -1)[..., 0]
    chatter = np.take_along_axis(flat_at, best, -1)[..., 0]
    return Limits(depth, np.where(np.isinf(depth), np.nan, chatter))
