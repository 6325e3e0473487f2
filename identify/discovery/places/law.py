"""A law laid through the measured dynamic stiffness of a place: the unknowns that it has instead of one per
line, with all that the data say of both.

Near the fitted place the data are |e + J_A dA + J_x dx|^2, dA the change of the unknowns of all lines and dx
that of the known parameters.  A law says A(p), so what it adds to the sum of squares is the least over dx of

    |G^(1/2) (A(p) - A) + G^(-1/2) C dx|^2 + |N^(1/2) dx|^2

with G = J_A' J_A line by line, C = J_A' J_x and N the information on x without the unknowns: a few hundred
numbers, whatever the data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Complex
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.places.update import a_of, triangle

_LEAST = 1e-2
"""Least information on a parameter: a standard deviation of ten on the search scale."""
_TRIED, _SMALL, _EVALUATIONS = 2, 4, 16
"""Starts from which a law with few parameters is refined; how many are few; steps, half for one with many."""


@dataclass(frozen=True)
class LawFit:
    """Values (q,) of a law on the scale that it was searched on, change (x,) of the known parameters on their
    search scale, and what the law adds to the place's sum of squares.
    """

    values: Array
    change: Array
    squares: float


class Whitened:
    """The unknowns of a place with what the data say of them."""

    def __init__(self, fit: SemiParametricFit, sign: float) -> None:
        self.unknown, self.sign = fit.unknown, sign
        root = _root(fit.normal.gram)
        self._root = root
        self._through = _columns(root @ fit.normal.inverse @ fit.normal.coupling)
        values, vectors = np.linalg.eigh(fit.normal.information)
        half = np.sqrt(np.maximum(values, _LEAST))[:, None] * vectors.T
        basis, self._triangle = np.linalg.qr(np.concatenate([self._through, half]))
        self._basis, self._rows = basis, len(self._through)

    def residual(self, stiffness: Complex) -> Array:
        """(rows,): what a dynamic stiffness (l, d, d) would leave, known parameters adjusted."""
        e = self._whitened(stiffness)
        return np.concatenate([e, np.zeros(len(self._basis) - len(e))]) - self._basis @ (
            self._basis[: self._rows].T @ e
        )

    def change(self, stiffness: Complex) -> Array:
        """(x,): how the known parameters would be adjusted."""
        along = self._basis[: self._rows].T @ self._whitened(stiffness)
        return np.asarray(-np.linalg.solve(self._triangle, along))

    def _whitened(self, stiffness: Complex) -> Array:
        a = triangle(a_of(stiffness, self.unknown.reference, self.sign))
        return _real((self._root @ (a - self.unknown.values)[..., None])[..., 0])


def fit_law(
    whitened: Whitened,
    law: Callable[[Array], Complex],
    starts: Array,
    lower: Array,
    upper: Array,
    evaluations: int | None = None,
) -> LawFit:
    """A law (q,) -> (l, d, d) from the best of starts (n, q), within bounds; evaluations: from each of two,
    however many parameters it has.
    """

    def left(q: Array) -> Array:
        with np.errstate(all="ignore"):
            e = whitened.residual(law(q))
        return np.nan_to_num(e, nan=1e6, posinf=1e6, neginf=-1e6)

    starts = np.clip(starts, lower + 1e-9 * (upper - lower), upper - 1e-9 * (upper - lower))
    few = len(lower) <= _SMALL or evaluations is not None
    order = np.argsort([float(np.sum(left(q) ** 2)) for q in starts])[: _TRIED if few else 1]
    budget = evaluations or (_EVALUATIONS if few else _EVALUATIONS // 2)
    ends = [
        scipy.optimize.least_squares(left, starts[n], bounds=(lower, upper), max_nfev=budget, ftol=1e-3)
        for n in order
    ]
    best = min(ends, key=lambda end: float(end.cost))
    return LawFit(best.x, whitened.change(law(best.x)), 2 * float(best.cost))


def _root(gram: Complex) -> Complex:
    """(l, m, m): R with R' R the Gram matrix."""
    values, vectors = np.linalg.eigh(gram)
    return np.asarray(np.sqrt(np.maximum(values, 0))[..., None] * np.conj(np.swapaxes(vectors, 1, 2)))


def _columns(matrix: Complex) -> Array:
    """(l, m, x) complex as real rows (2 l m, x)."""
    flat = matrix.reshape(-1, matrix.shape[-1])
    return np.concatenate([flat.real, flat.imag])


def _real(vector: Complex) -> Array:
    flat = vector.ravel()
    return np.concatenate([flat.real, flat.imag])
