"""The rotation that lays places on others, in closed form."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array


def closest_turn(places: Array, aims: Array) -> Array:
    """The rotation (3, 3) that lays places (n, 3) nearest to aims (n, 3), each less its mean (Kabsch, Acta
    Cryst. A 32 (1976) 922).
    """
    u, _, vh = np.linalg.svd((places - places.mean(axis=0)).T @ (aims - aims.mean(axis=0)))
    return np.asarray((u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vh))]) @ vh).T)
