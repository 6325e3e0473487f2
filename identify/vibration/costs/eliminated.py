"""The likelihood as a function of the parameters alone, for optimizers that search without gradients: errors
of what was stated are where they are best at each point, by what they change where the search begins
(variable projection; Golub and Pereyra, Inverse Problems 19, 2003).

    cost^2 = min over d of |r + J d|^2 + |nu + d|^2,   J = dr/dnu where the search begins
"""

from __future__ import annotations

import numpy as np
import scipy

from identify.core.arrays import Array, Index
from identify.fitting.objective import Objective, ProductObjective
from identify.vibration.costs.base import in_chunks, real_rows
from identify.vibration.costs.frf_least_squares import PosteriorObjective
from identify.vibration.costs.target import FrfTarget


class EliminatedObjective(ProductObjective):
    """The cost of `PosteriorObjective` with errors eliminated, linearised about values (unknowns,)."""

    def __init__(self, whole: PosteriorObjective, about: Array) -> None:
        self._whole, self._about = whole, about[whole.errors]
        slopes = [_rows(target, about, whole.errors)[1] for target in whole.targets]
        among = np.eye(len(whole.errors)) + sum(one.T @ one for one in slopes)
        self._slopes, self._among = slopes, scipy.linalg.cho_factor(among, lower=True)

    def at(self, values: Array) -> Objective:
        """Linearised anew."""
        return EliminatedObjective(self._whole, values)

    def costs(self, candidates: Array) -> Array:
        """Of many at once."""
        squares = np.full(len(candidates), np.inf)
        with np.errstate(all="ignore"):
            for part in in_chunks(self._whole.targets, candidates):
                squares[part] = self._squares(candidates[part])
        known = np.where(np.isfinite(squares), np.maximum(squares, 0.0), np.inf)
        return np.asarray(np.sqrt(known / self._whole.count))

    def _squares(self, candidates: Array) -> Array:
        squares = np.full(len(candidates), float(self._about @ self._about))
        pull = np.tile(self._about, (len(candidates), 1))
        for target, slopes in zip(self._whole.targets, self._slopes, strict=True):
            r = (target.predict_pairs(candidates) - target.measured) / target.sigma
            rows = np.concatenate([r.real, r.imag], axis=1).reshape(len(candidates), -1)
            squares += np.sum(rows**2, axis=1)
            pull += rows @ slopes
        explained = scipy.linalg.solve_triangular(self._among[0], pull.T, lower=True, check_finite=False)
        return np.asarray(squares - np.sum(explained**2, axis=0))

    def product(self, values: Array, free: Index) -> Array:
        """Of the errors where they are best."""
        product = np.zeros((len(free) + 1,) * 2)
        cross = np.zeros((len(self._about), len(free) + 1))
        cross[:, -1] = self._about
        with np.errstate(all="ignore"):
            for target, slopes in zip(self._whole.targets, self._slopes, strict=True):
                rows = np.column_stack(_rows(target, values, free)[::-1])
                product += rows.T @ rows
                cross += slopes.T @ rows
        product[-1, -1] += self._about @ self._about
        if not np.isfinite(cross).all():
            return np.full_like(product, np.inf)
        return np.asarray(product - cross.T @ scipy.linalg.cho_solve(self._among, cross))


def _rows(target: FrfTarget, values: Array, free: Index) -> tuple[Array, Array]:
    """Residuals in units of noise, and derivatives."""
    h, gradient = target.gradient_pairs(values, free)
    return real_rows((h - target.measured) / target.sigma, gradient / target.sigma[..., None])
