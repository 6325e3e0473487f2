"""Least squares with unknowns that are not negative, for a handful of them."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from identify.core.arrays import Array


def nonnegative(columns: Array, wanted: Array) -> Array:
    """The x >= 0, (n,), that minimises |columns x - wanted|, of columns (rows, n) and wanted (rows,).

    Where x is positive at the optimum it solves its columns alone, so the best of all sets of columns whose
    solution is positive is the optimum: 2^n solutions of a triangle.  scipy.optimize has the same for many
    unknowns, but takes longer to import than a whole analysis of modes takes here.
    """
    count = columns.shape[1]
    q, triangle = np.linalg.qr(columns)
    wanted = q.T @ wanted
    best, least = np.zeros(count), float(wanted @ wanted)
    for size in range(1, count + 1):
        for chosen in map(list, combinations(range(count), size)):
            found = np.linalg.lstsq(triangle[:, chosen], wanted, rcond=None)[0]
            error = float(np.sum((triangle[:, chosen] @ found - wanted) ** 2))
            if np.all(found >= 0) and error < least:
                least, best = error, np.zeros(count)
                best[chosen] = found
    return best
