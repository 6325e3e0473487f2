"""A convex quadratic within bounds: min d'A d / 2 - b'd, lower <= d <= upper."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array

_PASSES = 1000
_PATIENCE = 3
"""Exchanges of all wrong ones that may leave as many wrong ones as before."""
ASIDE = 0.1
"""How far along a step residuals are looked at to tell how they bend."""


def aside(x: Array, step: Array, lower: Array, upper: Array) -> Array:
    """(f,): so much of a step from x, but for unknowns so near a bound that there is nothing on its other
    side.
    """
    reach = ASIDE * np.abs(step)
    return np.where((lower <= x - reach) & (x + reach <= upper), ASIDE * step, 0.0)


def bounded_step(curvature: Array, slope: Array, lower: Array, upper: Array) -> Array:
    """(f,), by exchanging all at once that are on the wrong side, held ones whose slope points inside and
    free ones that are out of bounds (block principal pivoting: Portugal, Judice and Vicente, Mathematics of
    Computation 63, 1994), which ends after a few exchanges or not at all.  Where some exchanges leave no
    fewer wrong ones, a primal active set (Nocedal and Wright, Numerical Optimization, 2006, section 16.5)
    goes on from there: held ones are let go one at a time, and each step ends at the first bound it meets.
    """
    size = np.sqrt(np.diag(curvature))
    scaled, pulled, low, high = curvature / np.outer(size, size), slope / size, lower * size, upper * size
    side, change = np.zeros(len(slope), dtype=int), np.zeros(len(slope))
    fewest, patience, tolerance = len(slope) + 1, _PATIENCE, 1e-9 * (1 + np.abs(pulled))
    for _ in range(_PASSES):
        held, loose = np.flatnonzero(side), np.flatnonzero(side == 0)
        aim, rows = np.where(side < 0, low, high), scaled[loose]
        aim[loose] = np.linalg.solve(rows[:, loose], pulled[loose] - rows[:, held] @ aim[held])
        pull = scaled[held] @ aim - pulled[held]
        leaving = np.where(aim < low, -1, np.where(aim > high, 1, 0))
        inward = held[side[held] * pull > tolerance[held]]
        wrong = int(np.count_nonzero(leaving)) + len(inward)
        if not wrong:
            change = aim
            break
        if patience:
            patience = _PATIENCE if wrong < fewest else patience - 1
            fewest = min(fewest, wrong)
            side += leaving
            if patience:
                side[inward] = 0
            change = np.clip(aim, low, high)
        elif leaving.any():
            out = np.flatnonzero(leaving)
            room = np.where(leaving[out] < 0, low[out], high[out]) - change[out]
            share = room / (aim[out] - change[out])
            first = int(np.argmin(share))
            change = change + share[first] * (aim - change)
            side[out[first]] = leaving[out[first]]
        else:
            change = aim
            side[held[int(np.argmax(side[held] * pull))]] = 0
    found = np.where(side < 0, lower, np.where(side > 0, upper, change / size))
    return np.asarray(np.clip(found, lower, upper))
