"""The friction curve of Nagoya Eq. 11, F_c + F_s exp(-|v| / v_s) with the sign of v, and F_v v: its columns
and its values.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from identify.core.arrays import Array
from identify.core.separable import Separated, separable
from identify.joints.intervals import Value, symmetric
from identify.model.laws.friction import EXPONENTIAL, friction_torque, stribeck_decay

Model = Literal["coulomb-viscous", "stribeck"]
_STARTS = 25


def friction_columns(velocity: Array, shapes: Array) -> Array:
    """Torque (n, 2 or 3) per unit of F_c, F_v and, where there is a shape ln v_s, F_s."""
    columns = [np.sign(velocity), velocity]
    if len(shapes):
        columns.append(np.sign(velocity) * stribeck_decay(velocity, np.exp(shapes[0]), EXPONENTIAL))
    return np.column_stack(columns)


def fit_friction(velocity: Array, torque: Array, model: Model, other: Array, weights: Array) -> Separated:
    """The friction at velocities (n,) beside other columns (n, m): coefficients F_c, F_v, (F_s), others;
    shape ln v_s.

    v_s is searched from half the slowest velocity to half the fastest; weights (n,) multiply rows.
    """
    speed = np.abs(velocity)
    limits = np.log([0.5 * speed.min(), 0.5 * speed.max()]) if model == "stribeck" else np.zeros((2, 0))
    lower, upper = (np.atleast_1d(limit) for limit in limits)
    starts = (
        [np.array([value]) for value in np.linspace(lower[0], upper[0], _STARTS)]
        if len(lower)
        else [np.zeros(0)]
    )

    def columns(shapes: Array) -> Array:
        return np.column_stack([friction_columns(velocity, shapes), other]) * weights[:, None]

    return separable(columns, torque * weights, starts, lower, upper)


def friction_values(fitted: Separated, half: Array) -> list[Value]:
    """F_c, F_v, F_s and v_s; half (p + s,): their half intervals, of ln v_s last.

    A velocity over which nothing dies out means nothing: not determined where F_s may be zero.
    """
    c = fitted.coefficients
    values = [
        symmetric("coulomb", "N m", c[0], half[0], meaning="F_c of Eq. 11"),
        symmetric("viscous", "N m s/rad", c[1], half[1], meaning="F_v of Eq. 11"),
    ]
    if len(fitted.shapes):
        values.append(symmetric("stribeck", "N m", c[2], half[2], meaning="F_s of Eq. 11"))
        reach = half[-1] if half[2] < abs(c[2]) else np.inf
        shape = fitted.shapes[0]
        low, high = (float(np.exp(shape + side * reach)) for side in (-1, 1))
        values.append(
            Value("stribeck_velocity", "rad/s", float(np.exp(shape)), low, high, meaning="v_s of Eq. 11")
        )
    return values


def friction_at(fitted: Separated, velocity: Array) -> Array:
    """The identified curve, N m, at velocities (n,)."""
    c = fitted.coefficients
    part = (c[2], np.exp(fitted.shapes[0])) if len(fitted.shapes) else (0.0, 1.0)
    return friction_torque(velocity, c[0], c[1], *part)
