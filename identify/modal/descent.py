"""Damped Gauss-Newton steps over few unknowns whose normal equations are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np
import scipy

from identify.core.arrays import Array


class Costed(Protocol):
    """A state of a fit."""

    @property
    def cost(self) -> float:
        """Squared error."""


State = TypeVar("State", bound=Costed)


def descent(
    state: State,
    slope: Callable[[State], tuple[Array, Array]],
    trial: Callable[[State, Array], State | None],
    steps: int,
    tolerance: float,
) -> State:
    """The state after steps, each damped until it does not raise the cost (Marquardt, J. SIAM 11 (1963)
    431-441).

    slope: right side (n,) and matrix (n, n) of a state; trial: the state after a step (n,), None where that
    goes too far; tolerance: relative fall of the cost that ends it.
    """
    damping = 1e-3
    for _ in range(steps):
        gradient, normal = slope(state)
        there = None
        while there is None and damping < 1e8:
            there = trial(state, _step(normal, gradient, damping))
            if there is None or there.cost > state.cost:
                there, damping = None, damping * 10
        if there is None:
            break
        done = state.cost - there.cost <= tolerance * state.cost
        state, damping = there, max(damping / 10, 1e-9)
        if done:
            break
    return state


def _step(normal: Array, gradient: Array, damping: float) -> Array:
    diagonal = np.diag(normal)
    # Of a pole that changes nothing, rounding leaves a diagonal on either side of zero.
    scale = np.sqrt(np.maximum(diagonal, 1e-30 * np.max(np.abs(diagonal))) + np.finfo(float).tiny)
    factor = factored(normal / np.outer(scale, scale), damping)
    return np.asarray(solved(factor, gradient / scale) / scale)


def factored(matrix: Array, ridge: float) -> Array:
    """Lower Cholesky factor of a matrix of unit diagonal with a ridge, as small a one as rounding allows."""
    while np.isfinite(ridge):
        ridged = matrix.copy()
        ridged.flat[:: len(matrix) + 1] += ridge
        # What cho_factor calls, without checks that take longer than factoring a small matrix does.
        factor, failed = scipy.linalg.lapack.dpotrf(ridged, lower=True, overwrite_a=True)
        if not failed:
            return np.asarray(factor)
        ridge *= 10
    raise np.linalg.LinAlgError("a normal matrix that is not finite")


def solved(factor: Array, right: Array) -> Array:
    """The solution of equations with such a factor, for right sides (n,) or (n, k)."""
    return np.asarray(scipy.linalg.lapack.dpotrs(factor, right, lower=True)[0])
