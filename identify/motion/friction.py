"""Friction of a drive, seen at the gear output: Coulomb, Stribeck and viscous (Nagoya Eq. 11).

tau_f = sgn(v) (F_c + F_s exp(-|v| / v_s)) + F_v v
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.motion.numbers import Number, Settings, quantity

Array = NDArray[np.float64]


class Friction(Settings):
    """Coefficients of Eq. 11 per joint."""

    coulomb: Number = quantity("N m", "F_c, at any speed", 0.0)
    viscous: Number = quantity("N m s/rad", "F_v, in proportion to speed", 0.0)
    stribeck: Number = quantity("N m", "F_s, what is added near standstill", 0.0)
    stribeck_velocity: Number = quantity("rad/s", "v_s, over which F_s dies out", 0.05, least=1e-9)
    creep_velocity: Number = quantity("rad/s", "below this, sgn(v) is a slope: what a joint that sticks still creeps", 1e-4, least=1e-9)


def friction_torque(velocity: Array, coulomb: Array, viscous: Array, stribeck: Array, stribeck_velocity: Array) -> Array:
    """Eq. 11 as it is written, N m, for velocities of the gear output, rad/s."""
    return np.sign(velocity) * (coulomb + stribeck * np.exp(-np.abs(velocity) / stribeck_velocity)) + viscous * velocity


def friction_damper(velocity: Array, numbers: dict[str, Array]) -> Array:
    """Eq. 11 as a damper, N m s/rad: friction over velocity, finite at standstill, which a step may then take implicitly."""
    speed = np.sqrt(velocity**2 + numbers["friction.creep_velocity"] ** 2)
    dry = numbers["friction.coulomb"] + numbers["friction.stribeck"] * np.exp(-speed / numbers["friction.stribeck_velocity"])
    return np.asarray(dry / speed + numbers["friction.viscous"])
