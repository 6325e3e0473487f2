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

_ORDERS = 14
"""Of all orders, so many are repeated."""
_BEST = 25.0
"""Percentile over orders: high orders split a mode, each in its own way, and scatter by that too. Modes are
medians over all orders, in which it averages out; the orders that scatter least show what the record leaves
open. Of records simulated at random (`tests.benchmarks.output_only`)."""


@dataclass(frozen=True)
class Scatter:
    """Standard deviations, widened so that 1.96 of them are a 95 % interval for so few blocks: frequency_hz
    (m,), damping (m,), shapes (m, channels) of shapes whose largest component is 1; wander_hz (m,): of the
    median over these orders, high ones too.
    """

    frequency_hz: Array
    damping: Array
    shapes: Array
    wander_hz: Array

    def __getitem__(self, rows: Mask) -> Scatter:
        return Scatter(self.frequency_hz[rows], self.damping[rows], self.shapes[rows], self.wander_hz[rows])


def jackknife(found: Correlations, rows: int, modes: Sequence[Candidate], orders: Sequence[int]) -> Scatter:
    """Of modes found in models of some of these orders (see `ssi`)."""
    first = min(2, len(orders) - 1)
    picked = sorted({orders[k] for k in np.linspace(first, len(orders) - 1, _ORDERS).astype(int)})
    count, mean = len(found.blocks), found.mean
    whole = _sets(subspace(found, mean, rows, picked[-1]), picked)
    moved = []
    for block in found.blocks:
        check()
        left = (count * mean - block) / (count - 1)
        moved.append(_followed(whole, _sets(subspace(found, left, rows, picked[-1]), picked), modes))
    widened = scipy.stats.t.ppf(PERCENTILES_95[1] / 100, count - 1) / SIGMAS_95
    moves = [np.array(values) for values in zip(*moved, strict=True)]
    best = [widened * _best(_deviation(values)) for values in moves]
    return Scatter(best[0], best[1], best[2], widened * _deviation(_median(moves[0])))


def _median(moves: Array) -> Array:
    """Over the orders that know a mode, of (blocks, modes, orders), NaN where none does."""
    known = np.isfinite(moves).any(axis=2)
    found = np.full(known.shape, np.nan)
    found[known] = np.nanmedian(moves[known], axis=1)
    return found


def _best(values: Array) -> Array:
    """The percentile over orders of values (modes, orders, ...), NaN where no order has the mode."""
    found = np.full((len(values), *values.shape[2:]), np.nan)
    for r, of_mode in enumerate(values):
        known = np.isfinite(of_mode.reshape(len(of_mode), -1)).all(axis=1)
        if known.any():
            found[r] = np.percentile(of_mode[known], _BEST, axis=0)
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
    """Standard deviation of an estimate from what leaving out each of n blocks does to it, (n, ...)."""
    known = np.isfinite(moves)
    count = np.maximum(known.sum(axis=0), 1)
    values = np.where(known, moves, 0.0)
    spread = np.where(known, values - values.sum(axis=0) / count, 0.0)
    variance = np.sum(np.abs(spread) ** 2, axis=0) * np.maximum(count - 1, 0) / count
    return np.asarray(np.where(count > len(moves) // 2, np.sqrt(variance), np.nan))
