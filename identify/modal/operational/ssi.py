"""Covariance-driven stochastic subspace identification (SSI-cov): poles of many orders from correlations.

The block Hankel matrix of correlations factors into observability and controllability of the system; its
singular vectors give the first, whose shift the system matrix.  Source: Peeters and De Roeck, Reference-based
stochastic subspace identification, MSSP 13 (1999) 855-878; one decomposition serves all orders.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from identify.core.arrays import Array, Complex
from identify.modal.operational.correlations import Correlations
from identify.modal.poles import PoleSet

_ROUNDING = 1e-7
"""Of the largest singular value, what rounding leaves of others."""


@dataclass(frozen=True)
class Subspace:
    """Leading singular vectors of the Hankel matrix: left (rows x channels, k), right (k, references): the
    first block column; values (k,); size and power (channels,): see `Correlations`.
    """

    rate_hz: float
    left: Array
    right: Array
    values: Array
    size: Array
    power: Array

    def poles(self, order: int) -> PoleSet:
        """Oscillating poles of a model of so many states, of positive frequency; shapes are displacements."""
        channels = len(self.size)
        root = np.sqrt(self.values[:order])
        triangle, shifted = self._shift
        system = scipy.linalg.solve_triangular(
            triangle[:order, :order], shifted[:order, :order], check_finite=False
        )
        values, vectors = np.linalg.eig(system * root / root[:, None])
        kept = np.flatnonzero((values.imag > 0) & (np.abs(values) < 1))
        shapes = ((self.left[:channels, :order] * root) @ vectors[:, kept]).T
        participation = np.linalg.solve(vectors, root[:, None] * self.right[:order])[kept]
        poles = np.log(values[kept]) * self.rate_hz
        moved = self.size * shapes / poles[:, None] ** self.power
        return PoleSet(order, poles, _unit(participation), _unit(moved))

    @cached_property
    def _shift(self) -> tuple[Array, Array]:
        """Triangle R and Q^T B, (k, k) each, of the least squares A X = B for the shift X of the singular
        vectors: those of fewer are their upper left corners.
        """
        channels = len(self.size)
        q, triangle = scipy.linalg.qr(self.left[:-channels], mode="economic", check_finite=False)
        return triangle, q.T @ self.left[channels:]


def subspace(found: Correlations, correlation: Array, rows: int, order: int) -> Subspace:
    """Of correlations (lags, channels, references), the mean of those found or of some blocks of them, for
    models of up to so many states.
    """
    _, channels, references = correlation.shape
    lag = 1 + np.arange(rows + 1)[:, None] + np.arange(rows)
    hankel = correlation[lag].transpose(0, 2, 1, 3).reshape((rows + 1) * channels, rows * references)
    # Its eigenvalues are the squares of the singular values: far faster, and those beyond noise are not lost.
    size = rows * references
    squares, right = scipy.linalg.eigh(
        hankel.T @ hankel, subset_by_index=(size - order, size - 1), check_finite=False
    )
    values = np.sqrt(np.maximum(squares[::-1], _ROUNDING**2 * squares[-1]))
    right = right[:, ::-1]
    left = hankel @ right / values
    return Subspace(found.rate_hz, left, right[:references].T, values, found.size, found.power)


def _unit(rows: Complex) -> Complex:
    return np.asarray(rows / np.linalg.norm(rows, axis=1)[:, None])
