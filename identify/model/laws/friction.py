"""Friction of a drive, seen at the gear output: Coulomb, Stribeck and viscous.

    tau_f = sgn(v) (F_c + F_s exp(-|v / v_s|^delta)) + F_v v

delta = 1 is Nagoya Eq. 11 (Kim, Seki and Iwasaki, JMST 28-4, 2014), which simulated motion and the curves of
single joints use; delta = 2 is the bell of Armstrong-Helouvry, Dupont and Canudas de Wit (Automatica 30-7,
1994), which the regression on recorded motion uses.  v_s means another speed in each.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from identify.core.arrays import Array

EXPONENTIAL, BELL = 1, 2
"""delta of Nagoya Eq. 11, and of Armstrong-Helouvry and others."""

Smoothing = Literal["root", "tanh"]
"""How sgn(v) passes through zero: v / sqrt(v^2 + v_c^2), or tanh(v / v_c)."""


def smooth_sign(velocity: Array, creep_velocity: Array, smoothing: Smoothing) -> Array:
    """sgn(v) with a slope of 1 / v_c at zero, v_c the creep velocity, rad/s."""
    if smoothing == "tanh":
        return np.asarray(np.tanh(velocity / creep_velocity))
    return np.asarray(velocity / np.sqrt(velocity**2 + creep_velocity**2))


def stribeck_decay(velocity: Array, stribeck_velocity: Array | float, delta: int) -> Array:
    """exp(-|v / v_s|^delta): the share of F_s that is left at a velocity, rad/s."""
    return np.asarray(np.exp(-((np.abs(velocity) / stribeck_velocity) ** delta)))


def friction_torque(
    velocity: Array, coulomb: Array, viscous: Array, stribeck: Array, stribeck_velocity: Array
) -> Array:
    """Nagoya Eq. 11, N m, for velocities of the gear output, rad/s."""
    decay = stribeck_decay(velocity, stribeck_velocity, EXPONENTIAL)
    return np.asarray(np.sign(velocity) * (coulomb + stribeck * decay) + viscous * velocity)
