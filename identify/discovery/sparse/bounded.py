"""A convex quadratic within bounds: min d'A d / 2 - b'd, lower <= d <= upper."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array

_PASSES = 200


def bounded_step(curvature: Array, slope: Array, lower: Array, upper: Array) -> Array:
    """(f,), by an active set: what leaves its bounds is held there, and let go, one at a time, where the
    slope points inside (Nocedal and Wright, Numerical Optimization, 2006, section 16.7).

    Few are held: their multipliers are solved for by their block of the inverse, which is found once.
    """
    size = np.sqrt(np.diag(curvature))
    inverse = np.linalg.inv(curvature / np.outer(size, size))
    free, low, high = inverse @ (slope / size), lower * size, upper * size
    side, change = np.zeros(len(slope), dtype=int), free
    for _ in range(_PASSES):
        held = np.flatnonzero(side)
        ends = np.where(side[held] < 0, low[held], high[held])
        pull = np.linalg.solve(inverse[np.ix_(held, held)], ends - free[held])
        change = free + inverse[:, held] @ pull
        change[held] = ends
        below, above = change < low, change > high
        if below.any() or above.any():
            side[below], side[above] = -1, 1
            continue
        inward = side[held] * pull
        if not np.any(inward > 1e-9 * (1 + np.abs(slope[held] / size[held]))):
            break
        side[held[int(np.argmax(inward))]] = 0
    return np.asarray(np.clip(change / size, lower, upper))
