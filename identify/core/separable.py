"""Least squares where most values are linear and a few, here shapes, are not: variable projection (Golub and
Pereyra, SIAM J. Numer. Anal. 10-2, 1973).

`eliminate` finds the linear coefficients; what it leaves is a function of the shapes alone, which any search
may minimise: `separable` by trust-region least squares between bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array

_STEP = 1e-5
_RANK = 1e-10
"""Share of the largest singular value, of columns of one length, below which nothing is determined."""


@dataclass(frozen=True)
class Eliminated:
    """The best linear coefficients (p, ...), an orthonormal basis (n, r) of the columns, and what is left of
    the target (n, ...).
    """

    coefficients: Array
    basis: Array
    residual: Array


@dataclass(frozen=True)
class Separated:
    """Coefficients (p,), shapes (s,), the derivatives (n, p + s) of the prediction with respect to both, and
    what is left (n,).
    """

    coefficients: Array
    shapes: Array
    jacobian: Array
    residual: Array


def eliminate(columns: Array, target: Array, rank: float = _RANK) -> Eliminated:
    """The best coefficients of columns (n, p) for one target (n,) or several (n, k), the columns brought to
    one length first; of columns that cannot be distinguished, the smallest.
    """
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    basis, triangle = np.linalg.qr(columns / scale)
    left, sizes, right = np.linalg.svd(triangle)
    kept = sizes > rank * sizes.max(initial=0.0)
    basis = basis @ left[:, : len(sizes)][:, kept]
    along = basis.T @ target
    coefficients = right[: len(sizes)][kept].T @ (along.T / sizes[kept]).T
    return Eliminated((coefficients.T / scale).T, basis, target - basis @ along)


def separable(
    columns: Callable[[Array], Array], target: Array, starts: Sequence[Array], lower: Array, upper: Array
) -> Separated:
    """The best coefficients and shapes; the search goes from the best of the starts, each (s,), between lower
    and upper (s,).
    """

    def left(shapes: Array) -> Array:
        return eliminate(columns(shapes), target).residual

    losses = [float((left(start) ** 2).sum()) for start in starts]
    shapes = starts[int(np.argmin(losses))]
    if len(shapes):
        size = max(float(np.sqrt(min(losses))), 1e-300)
        found = scipy.optimize.least_squares(
            lambda x: left(x) / size,
            shapes,
            bounds=(lower, upper),
            x_scale=(upper - lower) / 10,
            diff_step=1e-6,
        )
        shapes = found.x
    matrix = columns(shapes)
    best = eliminate(matrix, target)
    slopes = [
        _slope(columns, shapes, number, (upper - lower)[number] * _STEP) @ best.coefficients
        for number in range(len(shapes))
    ]
    return Separated(best.coefficients, shapes, np.column_stack([matrix, *slopes]), best.residual)


def _slope(columns: Callable[[Array], Array], shapes: Array, number: int, step: float) -> Array:
    off = np.zeros(len(shapes))
    off[number] = step
    return (columns(shapes + off) - columns(shapes - off)) / (2 * step)
