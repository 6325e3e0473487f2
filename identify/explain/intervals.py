"""How sure the values of a fit are: 95 % intervals by the scatter of what is left, and which effects are
distinguished from nothing.
"""

from __future__ import annotations

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.correlated import covariance
from identify.explain.effects.base import MotionEffect
from identify.explain.regression import Fit, RegressionProblem, jacobian, parameter_prior, solve

_SURE = 0.95


def intervals(problem: RegressionProblem, fit: Fit) -> tuple[Array, Array]:
    """Values of all effects, coefficients then nonlinear parameters of each, and half their 95 % intervals;
    infinite where nothing determines them.

    A nonlinear parameter searched on a log scale has the interval of the value itself, by its derivative.
    Least squares that believe the columns, and those that believe their instruments, are the two ends between
    which the truth lies where either has errors (Frisch 1934), so an interval reaches as far beyond as they
    differ.
    """
    matrix, freedom, instrumental = _covariance(problem, fit)
    values = _values(fit)
    apart = np.zeros_like(values)
    if instrumental:
        plain = solve(problem, fit.effects, fit.nonlinear, fit.weights, plain=True)
        apart = np.abs(values - _values(plain))
    half = scipy.special.stdtrit(freedom, 0.975) * np.sqrt(np.maximum(np.diag(matrix), 0.0))[: len(values)]
    return values, np.where(half > 0, half + apart, np.inf)


def told_from_nothing(problem: RegressionProblem, fit: Fit) -> dict[MotionEffect, bool]:
    """Whether the 95 % region of an effect's coefficients leaves out zero (Wald); of a wave, whichever its
    phase: over a small part of it a wave is a straight line and a parabola, of which only one may be there.

    Not asked of effects with parameters inside their columns, about which this region is no ellipsoid.
    """
    matrix, freedom, _ = _covariance(problem, fit)
    found, first = {}, 0
    for effect, parameters in zip(fit.effects, fit.nonlinear, strict=True):
        count = len(effect.coefficients)
        own = slice(first, first + count)
        values = fit.of(effect)[:count]
        size = float(values @ np.linalg.pinv(matrix[own, own], hermitian=True) @ values) / count
        if effect.harmonic:
            size = (
                float(values @ values) / count / max(float(np.linalg.eigvalsh(matrix[own, own])[-1]), 1e-300)
            )
        least = float(scipy.special.fdtri(count, freedom, _SURE))
        found[effect] = bool(len(parameters)) or size > least
        first += count + len(parameters)
    return found


def _covariance(problem: RegressionProblem, fit: Fit) -> tuple[Array, float, bool]:
    """(p, p) of all values and its degrees of freedom; whether instruments were used."""
    columns, probes = (
        jacobian(problem, fit, probes=which) * fit.weights[None, :, None] for which in (False, True)
    )
    left, prior = fit.residual(problem) * fit.weights, parameter_prior(problem, fit)
    matrix, freedom = covariance(columns, left, problem.mask, prior, probes)
    return matrix, freedom, not np.array_equal(columns, probes)


def _values(fit: Fit) -> Array:
    return np.concatenate([fit.of(effect) for effect in fit.effects]) if fit.effects else np.zeros(0)
