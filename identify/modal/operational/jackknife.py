"""How sure poles and shapes from responses are: the analysis again and again, each time without one block.

Errors of correlations hang together over lags and channels; blocks of the record are independent of each
other, whatever their correlations are (Miller, The jackknife, Biometrika 61 (1974) 1-15; the same idea with
derivatives in place of repetitions: Doehler and Mevel, MSSP 38 (2013) 346-366).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Mask
from identify.core.interruption import check
from identify.core.thresholds import PERCENTILES_95, SIGMAS_95
from identify.modal.operational.correlations import Correlations
from identify.modal.operational.ssi import Subspace, subspace
from identify.modal.poles import PoleSet
from identify.modal.selection import Candidate

_ORDERS = 8
"""Of all orders but the lowest third, so many are repeated."""


@dataclass(frozen=True)
class Scatter:
    """Standard deviations, widened so that 1.96 of them are a 95 % interval for so few blocks: frequency_hz
    (m,), damping (m,), shapes (m, channels) of shapes whose largest component is 1.
    """

    frequency_hz: Array
    damping: Array
    shapes: Array

    def __getitem__(self, rows: Mask) -> Scatter:
        return Scatter(self.frequency_hz[rows], self.damping[rows], self.shapes[rows])


def jackknife(found: Correlations, rows: int, modes: Sequence[Candidate], orders: Sequence[int]) -> Scatter:
    """Of modes found in models of some of these orders (see `ssi`)."""
    picked = sorted({orders[k] for k in np.linspace(len(orders) // 3, len(orders) - 1, _ORDERS).astype(int)})
    count, mean = len(found.blocks), found.mean
    whole = _sets(subspace(found, mean, rows, picked[-1]), picked)
    moved = []
    for block in found.blocks:
        check()
        left = (count * mean - block) / (count - 1)
        moved.append(_followed(whole, _sets(subspace(found, left, rows, picked[-1]), picked), modes))
    widened = scipy.stats.t.ppf(PERCENTILES_95[1] / 100, count - 1) / SIGMAS_95
    return Scatter(*(widened * _deviation(np.array(values)) for values in zip(*moved, strict=True)))


def _sets(found: Subspace, orders: Sequence[int]) -> list[PoleSet]:
    return [found.poles(order) for order in orders]


def _followed(
    whole: list[PoleSet], left: list[PoleSet], modes: Sequence[Candidate]
) -> tuple[Array, Array, Complex]:
    """By how much frequency, damping and shape of every mode move, NaN where no order has the mode.

    The median over orders, as the modes themselves are: single orders move by more.
    """
    size = len(modes[0].shape) if modes else 0
    frequency, damping = np.full(len(modes), np.nan), np.full(len(modes), np.nan)
    shapes = np.full((len(modes), size), np.nan, dtype=complex)
    for r, mode in enumerate(modes):
        moves = [_move(a, b, mode) for a, b in zip(whole, left, strict=True)]
        known = [move for move in moves if move is not None]
        if known:
            parts = [np.array(part) for part in zip(*known, strict=True)]
            frequency[r], damping[r] = np.median(parts[0]), np.median(parts[1])
            shapes[r] = np.median(parts[2].real, axis=0) + 1j * np.median(parts[2].imag, axis=0)
    return frequency, damping, shapes


def _move(whole: PoleSet, left: PoleSet, mode: Candidate) -> tuple[float, float, Complex] | None:
    """Of one order; None where either model lacks the mode."""
    a, b = _nearest(whole, mode.pole, mode.half_bandwidth), None
    if a is not None:
        b = _nearest(left, whole.poles[a], mode.half_bandwidth)
    if a is None or b is None:
        return None
    old, new = whole.poles[a], left.poles[b]
    frequency = (abs(new) - abs(old)) / (2 * np.pi)
    damping = old.real / abs(old) - new.real / abs(new)
    return frequency, damping, _aligned(left.shapes[b]) - _aligned(whole.shapes[a])


def _nearest(found: PoleSet, pole: complex, reach: float) -> int | None:
    if not len(found.poles):
        return None
    apart = np.abs(found.poles - pole)
    nearest = int(np.argmin(apart))
    return nearest if apart[nearest] <= reach else None


def _aligned(shape: Complex) -> Complex:
    return np.asarray(shape / shape[int(np.argmax(np.abs(shape)))])


def _deviation(moves: Array | Complex) -> Array:
    """Standard deviation of an estimate from what leaving out each of n blocks does to it, (n, ...)."""
    known = np.isfinite(moves)
    count = np.maximum(known.sum(axis=0), 1)
    values = np.where(known, moves, 0.0)
    spread = np.where(known, values - values.sum(axis=0) / count, 0.0)
    variance = np.sum(np.abs(spread) ** 2, axis=0) * np.maximum(count - 1, 0) / count
    return np.asarray(np.where(count > len(moves) // 2, np.sqrt(variance), np.nan))
