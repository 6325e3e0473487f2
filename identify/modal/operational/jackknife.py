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
from identify.modal.operational.ssi import Correlations, Subspace, subspace
from identify.modal.poles import PoleSet
from identify.modal.selection import Candidate

_ORDERS = 14
"""Of all orders, so many are repeated."""


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
    """Of modes that are medians over all orders (see `ssi`): of the median over some of these orders.

    High orders split a mode, each in its own way, and scatter by that; in the median it averages out.
    """
    first = min(2, len(orders) - 1)
    picked = sorted({orders[k] for k in np.linspace(first, len(orders) - 1, _ORDERS).astype(int)})
    count, mean = len(found.blocks), found.mean
    whole = _sets(subspace(found, mean, rows, picked[-1]), picked)
    moved = []
    for block in found.blocks:
        check()
        left = (count * mean - block) / (count - 1)
        moved.append(_followed(whole, _sets(subspace(found, left, rows, picked[-1]), picked), modes))
    widened = scipy.special.stdtrit(count - 1, PERCENTILES_95[1] / 100) / SIGMAS_95
    frequency, damping, shapes = (np.array(values) for values in zip(*moved, strict=True))
    parts = _median(shapes.real) + 1j * _median(shapes.imag)
    return Scatter(*(widened * _deviation(moves) for moves in (_median(frequency), _median(damping), parts)))


def _median(moves: Array) -> Array:
    """Over the orders that know a mode, of (blocks, modes, orders, ...), NaN where none does."""
    known = np.isfinite(moves).any(axis=2)
    found = np.full(known.shape, np.nan)
    found[known] = np.nanmedian(np.moveaxis(moves, 2, -1)[known], axis=-1)
    return found


def _sets(found: Subspace, orders: Sequence[int]) -> list[PoleSet]:
    return [found.poles(order) for order in orders]


def _followed(
    whole: list[PoleSet], left: list[PoleSet], modes: Sequence[Candidate]
) -> tuple[Array, Array, Complex]:
    """By how much frequency, damping (modes, orders) and shape (modes, orders, channels) of every mode move,
    NaN in orders that lack the mode.
    """
    size = len(modes[0].shape) if modes else 0
    frequency, damping = np.full((2, len(modes), len(whole)), np.nan)
    shapes = np.full((len(modes), len(whole), size), np.nan, dtype=complex)
    for r, mode in enumerate(modes):
        for k, (a, b) in enumerate(zip(whole, left, strict=True)):
            move = _move(a, b, mode)
            if move is not None:
                frequency[r, k], damping[r, k], shapes[r, k] = move
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
    largest = int(np.argmax(np.abs(mode.shape)))  # always the same one: two may be as large
    before, after = whole.shapes[a], left.shapes[b]
    return frequency, damping, after / after[largest] - before / before[largest]


def _nearest(found: PoleSet, pole: complex, reach: float) -> int | None:
    if not len(found.poles):
        return None
    apart = np.abs(found.poles - pole)
    nearest = int(np.argmin(apart))
    return nearest if apart[nearest] <= reach else None


def _deviation(moves: Array | Complex) -> Array:
    """Standard deviation of an estimate from what leaving out each of n blocks does to it, (n, ...).

    A block may be as short as the memory of the slowest mode, so that it knows its neighbours: they count
    with half the weight of itself (Kuensch, Annals of Statistics 17 (1989) 1217-1241: overlapping blocks).
    """
    known = np.isfinite(moves)
    count = np.maximum(known.sum(axis=0), 1)
    values = np.where(known, moves, 0.0)
    spread = np.where(known, values - values.sum(axis=0) / count, 0.0)
    beside = np.sum((spread[1:] * spread[:-1].conj()).real, axis=0)
    variance = (np.sum(np.abs(spread) ** 2, axis=0) + beside) * np.maximum(count - 1, 0) / count
    return np.asarray(np.where(count > len(moves) // 2, np.sqrt(np.maximum(variance, 0.0)), np.nan))
