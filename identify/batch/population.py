"""What fits of several robots of one type, or of one robot several times, say together: the mean and the
scatter of each parameter, and of each robot what its own fit and all others say of it.

Two levels: the values of fit i are drawn about the mean, theta_i ~ N(mu, D), with D = diag(tau^2), zero for
parameters that are shared; its estimate is z_i ~ N(theta_i, J_i).  The scatters have the largest restricted
likelihood (REML; Patterson and Thompson, Biometrika 58, 1971), the means and values the least variance
given them; the interval of a mean counts that scatters are known from few fits by Satterthwaite's degrees of
freedom (Biometrics Bulletin 2, 1946).  The interval of a scatter is that of Cochran's Q (Viechtbauer,
Statistics in Medicine 26, 2007), exact for normal estimates.

Nuisance parameters that all fits have in common, such as the mass of a link in the description that all
of them use, do not average out: z_i ~ N(theta_i + A_i nu, J_i) with nu ~ N(0, 1), the same for all.

Whether a parameter is the same at all postures, as far as the intervals of its estimates can tell.

For estimates x_i with standard deviations s_i, weights w_i = 1/s_i^2 and their weighted mean m, Cochran's Q =
sum w_i (x_i - m)^2 is chi-square with n - 1 degrees of freedom if all are the same (W. G. Cochran, Biometrics
10, 1954). The scatter beyond the intervals is DerSimonian and Laird's tau (Controlled Clinical Trials 7,
1986).  The trend is the weighted line over one joint angle that explains most; its standard deviation counts
the scatter about the line, so that a trend is not claimed for scatter of another kind, and its p-value counts
that the angle was chosen among several.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from identify.core.arrays import Array, Index

_LEAST_SPAN = np.deg2rad(1.0)


@dataclass(frozen=True)
class Trend:
    """The line over one joint angle: joint (from 1), slope and its standard deviation per rad, and the
    p-value of a slope of zero.
    """

    joint: int
    slope: float
    std: float
    p_value: float


@dataclass(frozen=True)
class Homogeneity:
    """count estimates, their weighted mean and its standard deviation, Q with its degrees of freedom and
    p-value, the scatter tau.
    """

    count: int
    mean: float
    mean_std: float
    chi_square: float
    freedom: int
    p_value: float
    scatter: float
    trend: Trend | None


def homogeneity(x: Array, std: Array, angles: Array) -> Homogeneity | None:
    """The test for estimates x (n,) with standard deviations std (n,) at joint angles (n, joints), rad; None
    with fewer than two.

    x is on the scale on which the estimates are normal: the logarithm of a stiffness.  Estimates without a
    finite std are left out.
    """
    known = np.isfinite(x) & np.isfinite(std) & (std > 0)
    x, std, angles = x[known], std[known], angles[known]
    if len(x) < 2:
        return None
    w = std**-2
    mean = float(np.sum(w * x) / w.sum())
    q, freedom = float(np.sum(w * (x - mean) ** 2)), len(x) - 1
    excess = (q - freedom) / (w.sum() - np.sum(w**2) / w.sum())
    p_value = float(scipy.special.chdtrc(freedom, q))
    return Homogeneity(
        len(x),
        mean,
        float(w.sum() ** -0.5),
        q,
        freedom,
        p_value,
        float(np.sqrt(max(0.0, excess))),
        _trend(x, w, angles),
    )


def _trend(x: Array, w: Array, angles: Array) -> Trend | None:
    """The steepest trend in units of its own standard deviation; None without three postures or an angle that
    varies.
    """
    varied = [
        joint
        for joint, angle in enumerate(angles.T)
        if np.isfinite(angle).all() and np.ptp(angle) > _LEAST_SPAN
    ]
    if len(x) < 3 or not varied:
        return None
    lines = [_line(x, w, angles[:, joint]) for joint in varied]
    steepest = int(np.argmax([abs(slope) / std for slope, std in lines]))
    slope, std = lines[steepest]
    p_value = 2 * float(scipy.special.stdtr(len(x) - 2, -abs(slope) / std))
    return Trend(varied[steepest] + 1, slope, std, min(1.0, len(varied) * p_value))


def _line(x: Array, w: Array, angle: Array) -> tuple[float, float]:
    """Slope of the weighted line and its standard deviation, widened where the scatter about the line is more
    than the intervals say.
    """
    away = angle - np.sum(w * angle) / w.sum()
    information = float(np.sum(w * away**2))
    slope = float(np.sum(w * away * x)) / information
    mean = np.sum(w * x) / w.sum()
    left = float(np.sum(w * (x - mean - slope * away) ** 2)) / (len(x) - 2)
    return slope, float(np.sqrt(max(1.0, left) / information))


def holm(p_values: Array) -> Array:
    """p-values (m,) adjusted for m tests at once (S. Holm, Scandinavian Journal of Statistics 6, 1979); NaN
    stays.
    """
    order = np.argsort(p_values)
    known = int(np.sum(np.isfinite(p_values)))
    adjusted = np.full(len(p_values), np.nan)
    adjusted[order[:known]] = np.minimum(
        1.0, np.maximum.accumulate(p_values[order[:known]] * np.arange(known, 0, -1))
    )
    return adjusted


_NONE = 1e-12
"""Part of the variance of a parameter's estimates that is no scatter."""


@dataclass(frozen=True)
class Estimate:
    """What one fit says: numbers (k,) of its parameters among all, their values (k,), what one standard
    deviation of each error in common adds to them, common (k, e), and the covariance (k, k) of all else.
    """

    numbers: Index
    value: Array
    covariance: Array
    common: Array

    def design(self, size: int) -> Array:
        """(k, size + e): its values by the means of all parameters and the errors in common."""
        return np.concatenate([np.eye(size)[self.numbers], self.common], axis=1)


@dataclass(frozen=True)
class Population:
    """mean (p,) and half its 95 % interval, scatter tau (p,); value and half its 95 % interval (n, p) of each
    fit; on the scale of the estimates, NaN where nothing is known.  errors (e,): those in common.
    """

    mean: Array
    mean_half: Array
    scatter: Array
    value: Array
    half: Array
    errors: Array


def population(estimates: Sequence[Estimate], scatters: NDArray[np.bool_]) -> Population:
    """The two levels of p parameters; scatters (p,): which of them differ between fits."""
    start = _spread(estimates, len(scatters)) * scatters
    free, variance = np.flatnonzero(start > 0), np.zeros(len(scatters))

    def restricted(share: Array) -> tuple[float, Array]:
        variance[free] = share * start[free]
        at = _Level.at(estimates, variance)
        return at.likelihood, at.slopes()[free] * start[free]

    if len(free):
        begin, bounds = np.full(len(free), 0.5), [(0.0, None)] * len(free)
        found = scipy.optimize.minimize(restricted, begin, jac=True, method="L-BFGS-B", bounds=bounds).x
        variance[free] = np.where(found > _NONE, found, 0.0) * start[free]
    return _Level.at(estimates, variance).population(free)


def _spread(estimates: Sequence[Estimate], size: int) -> Array:
    """(p,): mean square of the values about their mean, zero for those that fewer than two fits have."""
    table = np.full((len(estimates), size), np.nan)
    for row, one in zip(table, estimates, strict=True):
        row[one.numbers] = one.value
    several = np.sum(np.isfinite(table), axis=0) > 1
    spread = np.zeros(size)
    spread[several] = np.nanvar(table[:, several], axis=0)
    return spread


@dataclass(frozen=True)
class _Fit:
    """An estimate with its design X_i (k, u), the inverse of V_i (k, k), and V_i^-1 X_i (k, u)."""

    one: Estimate
    design: Array
    inverse: Array
    weighted: Array


@dataclass(frozen=True)
class _Level:
    """What estimates say of the means of p parameters and of e errors in common, u together, at given
    variances of scatters (p,): values (u,), NaN where nothing is said, and covariance (u, u); likelihood: -2
    ln of the restricted one, but for a constant.
    """

    fits: Sequence[_Fit]
    variance: Array
    mean: Array
    covariance: Array
    likelihood: float

    @classmethod
    def at(cls, estimates: Sequence[Estimate], variance: Array) -> _Level:
        """By generalised least squares."""
        prior = np.append(np.zeros(len(variance)), np.ones(estimates[0].common.shape[1]))
        fits, likelihood = [], 0.0
        total, right = np.diag(prior), np.zeros(len(prior))
        for one in estimates:
            factor = scipy.linalg.cho_factor(one.covariance + np.diag(variance[one.numbers]))
            inverse = scipy.linalg.cho_solve(factor, np.eye(len(one.numbers)))
            design = one.design(len(variance))
            weighted = inverse @ design
            total += design.T @ weighted
            right += one.value @ weighted
            likelihood += _logarithm(factor) + float(one.value @ inverse @ one.value)
            fits.append(_Fit(one, design, inverse, weighted))
        known = np.flatnonzero(np.diag(total) > 0)
        covariance, mean = np.zeros((len(prior), len(prior))), np.full(len(prior), np.nan)
        whole = scipy.linalg.cho_factor(total[np.ix_(known, known)])
        covariance[np.ix_(known, known)] = scipy.linalg.cho_solve(whole, np.eye(len(known)))
        mean[known] = covariance[np.ix_(known, known)] @ right[known]
        likelihood += _logarithm(whole) - float(right[known] @ mean[known])
        return cls(fits, variance, mean, covariance, likelihood)

    def slopes(self) -> Array:
        """(p,): of the likelihood by the variances."""
        found = np.zeros(len(self.variance))
        for fit in self.fits:
            pull, spread = (
                self._pull(fit),
                np.einsum("ku,uv,kv->k", fit.weighted, self.covariance, fit.weighted),
            )
            found[fit.one.numbers] += np.diag(fit.inverse) - spread - pull**2
        return found

    def _pull(self, fit: _Fit) -> Array:
        """V_i^-1 (z_i - X_i mean)."""
        return np.asarray(fit.inverse @ (fit.one.value - fit.design @ np.nan_to_num(self.mean)))

    def population(self, places: Index) -> Population:
        """The two levels, with scatters at these places (s,) among the parameters."""
        size, columns = len(self.variance), [_columns(fit, places) for fit in self.fits]
        uncertain: Array = np.linalg.pinv(self._information(columns, places)).astype(float)
        value, half = np.full((2, len(self.fits), size), np.nan)
        for row, fit in enumerate(self.fits):
            value[row, fit.one.numbers], half[row, fit.one.numbers] = self._own(fit, places, uncertain)
        mean = self.mean[:size]
        variance: Array = np.where(np.isfinite(mean), np.diag(self.covariance)[:size], np.nan)
        slopes = np.zeros((len(self.mean), len(places)))
        for column in columns:
            slopes += (self.covariance @ column) ** 2
        mean_half = np.sqrt(variance) * _quantile(variance, slopes[:size], uncertain, 1)
        return Population(mean, mean_half, np.sqrt(self.variance), value, half, self.mean[size:])

    def _own(self, fit: _Fit, places: Index, uncertain: Array) -> tuple[Array, Array]:
        """Values (k,) of one fit, drawn to the means, and half their intervals, which count that means and
        scatters are uncertain (Kass and Steffey, JASA 84, 1989).
        """
        numbers, variance, pull = fit.one.numbers, self.variance[fit.one.numbers], self._pull(fit)
        keep = np.eye(len(numbers)) - variance[:, None] * fit.inverse
        mine = np.isin(numbers, places)
        among = np.searchsorted(places, numbers[mine])
        uncertain = uncertain[np.ix_(among, among)]
        by_mean = fit.one.design(len(self.variance)) - variance[:, None] * fit.weighted
        by_mean[:, len(self.variance) :] -= fit.one.common
        slopes = keep[:, mine] * pull[mine]
        spread = keep * variance + by_mean @ self.covariance @ by_mean.T + slopes @ uncertain @ slopes.T
        squares = np.maximum(np.diag(spread), 0.0)
        quantile = _quantile(squares, keep[:, mine] ** 2, uncertain, max(len(self.fits) - 1, 1))
        return self.mean[numbers] + variance * pull, np.sqrt(squares) * quantile

    def _information(self, columns: Sequence[Array], places: Index) -> Array:
        """(s, s): what is expected of the restricted likelihood about the variances of scatters,
        tr(P dV P dV) / 2, with P that of all estimates at once.
        """
        information = np.zeros((len(places), len(places)))
        for i, first in enumerate(columns):
            for j, second in enumerate(columns):
                cross = -first.T @ self.covariance @ second
                information += 0.5 * (cross + first[places] if i == j else cross) ** 2
        return information


def _logarithm(factor: tuple[Array, bool]) -> float:
    """Of the determinant of a matrix with this Cholesky factor."""
    return 2 * float(np.sum(np.log(np.diag(factor[0]))))


def _columns(fit: _Fit, places: Index) -> Array:
    """(u, s): X_i' V_i^-1 by the parameters that scatter, zero for those that a fit does not have."""
    found = np.zeros((fit.design.shape[1], len(places)))
    for column, number in enumerate(places):
        own = np.flatnonzero(fit.one.numbers == number)
        if len(own):
            found[:, column] = fit.weighted[own[0]]
    return found


def _quantile(variance: Array, by_scatter: Array, uncertain: Array, least: int) -> Array:
    """(u,): standard deviations on each side of 95 % intervals of variances (u,), with slopes (u, s) by those
    of scatters, which are uncertain (s, s): Satterthwaite's degrees of freedom, at least so many.
    """
    own = np.einsum("uk,kl,ul->u", by_scatter, uncertain, by_scatter)
    freedom = 2 * variance**2 / np.maximum(own, np.finfo(float).tiny)
    return np.asarray(scipy.special.stdtrit(np.maximum(freedom, least), 0.975))


def scatter_interval(value: Array, std: Array) -> tuple[float, float]:
    """95 % interval of the scatter of values (n,) with standard deviations (n,): where Cochran's Q, which
    falls with it, is what chi-square of n - 1 degrees of freedom has with 97.5 and 2.5 %; NaN of fewer than
    two.
    """
    if len(value) < 2:
        return np.nan, np.nan
    low, high = scipy.special.chdtri(len(value) - 1, np.array([0.025, 0.975]))
    return _scatter_at(value, std, low), _scatter_at(value, std, high)


def _scatter_at(value: Array, std: Array, chi_square: float) -> float:
    """The scatter at which Cochran's Q is `chi_square`; zero where it never is that large."""

    def excess(scatter: float) -> float:
        weight = 1 / (std**2 + scatter**2)
        mean = np.sum(weight * value) / weight.sum()
        return float(np.sum(weight * (value - mean) ** 2)) - chi_square

    if excess(0.0) <= 0:
        return 0.0
    most = float(np.sqrt(np.sum((value - value.mean()) ** 2) / chi_square))
    return float(scipy.optimize.brentq(excess, 0.0, 2 * most + float(std.max()), xtol=1e-9 * most))
