"""A convex quadratic within bounds: min d'A d / 2 - b'd, lower <= d <= upper."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array

_PASSES = 1000


def bounded_step(curvature: Array, slope: Array, lower: Array, upper: Array) -> Array:
    """(f,), by a primal active set (Nocedal and Wright, Numerical Optimization, 2006, section 16.5): what
    leaves its bounds is held there until all are within; then held ones whose slope points inside are let
    go, one at a time, and each step ends at the first bound that it meets.

    Few are held: their multipliers are solved for by their block of the inverse, which is found once.
    """
    size = np.sqrt(np.diag(curvature))
    inverse = np.linalg.inv(curvature / np.outer(size, size))
    free, low, high = inverse @ (slope / size), lower * size, upper * size
    side, change, within = np.zeros(len(slope), dtype=int), np.clip(free, low, high), False
    for _ in range(_PASSES):
        held = np.flatnonzero(side)
        ends = np.where(side[held] < 0, low[held], high[held])
        pull = np.linalg.solve(inverse[np.ix_(held, held)], ends - free[held])
        aim = free + inverse[:, held] @ pull
        aim[held] = ends
        leaving = np.where(aim < low, -1, np.where(aim > high, 1, 0))
        if leaving.any():
            if not within:
                side += leaving
                continue
            out = np.flatnonzero(leaving)
            room = np.where(leaving[out] < 0, low[out], high[out]) - change[out]
            share = room / (aim[out] - change[out])
            first = int(np.argmin(share))
            change = change + share[first] * (aim - change)
            side[out[first]] = leaving[out[first]]
            continue
        change, within = aim, True
        inward = side[held] * pull
        if not np.any(inward > 1e-9 * (1 + np.abs(slope[held] / size[held]))):
            break
        side[held[int(np.argmax(inward))]] = 0
    found = np.where(side < 0, lower, np.where(side > 0, upper, change / size))
    return np.asarray(np.clip(found, lower, upper))
