"""A convex quadratic within bounds: min d'A d / 2 - b'd, lower <= d <= upper."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array

_PASSES = 100


def bounded_step(curvature: Array, slope: Array, lower: Array, upper: Array) -> Array:
    """(f,), by an active set: what leaves its bounds is held there, and let go, one at a time, where the
    slope points inside (Nocedal and Wright, Numerical Optimization, 2006, section 16.7).
    """
    side = np.zeros(len(slope), dtype=int)
    change = np.zeros(len(slope))
    for _ in range(_PASSES):
        moving = side == 0
        change = np.where(side < 0, lower, np.where(side > 0, upper, 0.0))
        if moving.any():
            held = curvature[np.ix_(moving, ~moving)] @ change[~moving]
            change[moving] = np.linalg.solve(curvature[np.ix_(moving, moving)], slope[moving] - held)
        low, high = moving & (change < lower), moving & (change > upper)
        if low.any() or high.any():
            side[low], side[high] = -1, 1
            continue
        inward = side * (curvature @ change - slope)
        if not np.any(inward > 1e-9 * (1 + np.abs(slope))):
            break
        side[int(np.argmax(inward))] = 0
    return np.clip(change, lower, upper)
