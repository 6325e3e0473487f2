"""95 % intervals of least-squares values by the scatter of what is left, and what they say: determined, weak,
not determined, or impossible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Mask
from identify.core.correlated import covariance
from identify.core.thresholds import SIGMAS_95
from identify.results.joints import JointValues

_RANK = 1e-8
"""Singular value of a Jacobian with columns of length 1 below which a direction counts as not there."""
_BLIND = 1e-4
"""Part in such a direction from which a value is not determined."""
_SURE = np.log(2) / 2 * SIGMAS_95
"""Half interval over value up to which a value counts as determined, as in `identify.fitting.uncertainty`."""
DETERMINED, WEAK, ZERO, BLIND = "determined", "weak", "not told from zero", "not determined"
IMPOSSIBLE = "cannot be negative"
"""Of a value whose whole interval is where it cannot be: what is not in the model pulls it there."""
AS_DESCRIBED = "as described"
"""Of a value that rests on the robot's description rather than on the runs."""


@dataclass(frozen=True)
class Value:
    """One value with its interval; plain: an angle or a constant that may well be zero, so its size says
    nothing about how sure it is; positive: an inertia or a friction, which cannot be below zero.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    plain: bool = False
    expected: float = float("nan")
    meaning: str = ""
    positive: bool = False

    @property
    def status(self) -> str:
        """Whether the data determine it."""
        half = (self.high - self.low) / 2
        if not np.isfinite(half):
            return BLIND
        if self.plain:
            return DETERMINED
        if self.positive and self.high < 0:
            return IMPOSSIBLE
        if self.low <= 0 <= self.high:
            return ZERO
        return DETERMINED if half <= _SURE * abs(self.value) else WEAK


def symmetric(name: str, unit: str, value: float, half: float, **more: object) -> Value:
    """A value with the same reach to both sides."""
    return Value(name, unit, float(value), float(value - half), float(value + half), **more)  # type: ignore[arg-type]


def table(values: Sequence[Value]) -> JointValues:
    """The values as they are kept."""
    return JointValues(
        name=tuple(v.name for v in values),
        unit=tuple(v.unit for v in values),
        value=np.array([v.value for v in values]),
        low_95=np.array([v.low for v in values]),
        high_95=np.array([v.high for v in values]),
        status=tuple(v.status for v in values),
        expected=np.array([v.expected for v in values]),
        meaning=tuple(v.meaning for v in values),
    )


def blind(jacobian: Array) -> Mask:
    """Which values (p,) have a part in a combination that the rows (n, p) do not see at all."""
    scale = np.sqrt((jacobian**2).sum(axis=0))
    if len(jacobian) < jacobian.shape[1]:
        return np.ones(jacobian.shape[1], dtype=bool)
    _, sizes, directions = np.linalg.svd(jacobian / np.where(scale > 0, scale, 1.0), full_matrices=False)
    return np.asarray(
        (np.abs(directions[sizes < _RANK * max(sizes.max(initial=0.0), 1e-300)]) > _BLIND).any(axis=0)
        | (scale == 0)
    )


def independent(jacobian: Array, residual: Array) -> tuple[Array, Array]:
    """Covariance (p, p) and half intervals (p,) where rows (n, p) are independent and their residuals (n,)
    alike, of unknown size.

    Student's t with n - p degrees of freedom; infinite where the rows do not determine a value, or are no
    more than the values.
    """
    rows, count = jacobian.shape
    freedom = rows - count
    if freedom < 1:
        return np.full((count, count), np.inf), np.full(count, np.inf)
    scale = np.sqrt((jacobian**2).sum(axis=0))
    scale[scale == 0] = 1.0
    bread = np.linalg.pinv((jacobian / scale).T @ (jacobian / scale), rcond=_RANK**2) / np.outer(scale, scale)
    matrix = bread * float(residual @ residual) / freedom
    half = scipy.special.stdtrit(freedom, 0.975) * np.sqrt(np.maximum(np.diag(matrix), 0.0))
    return matrix, np.where(blind(jacobian), np.inf, half)


def in_time(jacobian: Array, residual: Array, used: Mask) -> tuple[Array, Array]:
    """The same for histories: jacobian (samples, joints, p), residual and used (samples, joints), correlated
    in time.
    """
    matrix, freedom = covariance(jacobian, residual, used)
    half = scipy.special.stdtrit(freedom, 0.975) * np.sqrt(np.maximum(np.diag(matrix), 0.0))
    return matrix, np.where(blind(jacobian[used]), np.inf, half)


def over_time(jacobian: Array, residual: Array, used: Mask) -> tuple[Array, Array]:
    """The same for one history of which only the samples that count are given: jacobian (n, p), residual
    (n,), used (samples,).
    """
    whole, left = np.zeros((len(used), 1, jacobian.shape[1])), np.zeros((len(used), 1))
    whole[used, 0], left[used, 0] = jacobian, residual
    return in_time(whole, left, used[:, None])
