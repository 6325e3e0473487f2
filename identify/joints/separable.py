"""Least squares where most values are linear and a few shapes are not: variable projection (Golub and Pereyra
1973).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from identify.core.arrays import Array

_STEP = 1e-5


@dataclass(frozen=True)
class Fitted:
    """Coefficients (p,), shapes (s,), the derivatives (n, p + s) of the prediction with respect to both, and
    what is left (n,).
    """

    coefficients: Array
    shapes: Array
    jacobian: Array
    residual: Array


def solve(columns: Array, wanted: Array) -> Array:
    """The best coefficients (p,) of columns (n, p), which are brought to one length first."""
    scale = np.sqrt((columns**2).sum(axis=0))
    scale[scale == 0] = 1.0
    return np.asarray(np.linalg.lstsq(columns / scale, wanted, rcond=1e-10)[0] / scale)


def separable(
    columns: Callable[[Array], Array], wanted: Array, starts: Sequence[Array], lower: Array, upper: Array
) -> Fitted:
    """The best coefficients and shapes; the search goes from the best of the starts, each (s,), between lower
    and upper (s,).
    """

    def left(shapes: Array) -> Array:
        matrix = columns(shapes)
        return wanted - matrix @ solve(matrix, wanted)

    losses = [float((left(start) ** 2).sum()) for start in starts]
    shapes = starts[int(np.argmin(losses))]
    if len(shapes):
        size = max(float(np.sqrt(min(losses))), 1e-300)
        found = least_squares(
            lambda x: left(x) / size,
            shapes,
            bounds=(lower, upper),
            x_scale=(upper - lower) / 10,
            diff_step=1e-6,
        )
        shapes = found.x
    matrix = columns(shapes)
    coefficients = solve(matrix, wanted)
    slopes = [
        _slope(columns, shapes, number, (upper - lower)[number] * _STEP) @ coefficients
        for number in range(len(shapes))
    ]
    return Fitted(coefficients, shapes, np.column_stack([matrix, *slopes]), wanted - matrix @ coefficients)


def _slope(columns: Callable[[Array], Array], shapes: Array, number: int, step: float) -> Array:
    off = np.zeros(len(shapes))
    off[number] = step
    return (columns(shapes + off) - columns(shapes - off)) / (2 * step)
