"""Whether a parameter is the same at all postures, as far as the intervals of its estimates can tell.

For estimates x_i with standard deviations s_i, weights w_i = 1/s_i^2 and their weighted mean m, Cochran's Q =
sum w_i (x_i - m)^2 is chi-square with n - 1 degrees of freedom if all are the same (W. G. Cochran, Biometrics
10, 1954). The scatter beyond the intervals is DerSimonian and Laird's tau (Controlled Clinical Trials 7,
1986).  The trend is the weighted line over one joint angle that explains most; its standard deviation counts
the scatter about the line, so that a trend is not claimed for scatter of another kind, and its p-value counts
that the angle was chosen among several.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array

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
