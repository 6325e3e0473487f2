"""Angular transmission error of a gear: its output waves about its input (Nagoya Eq. 9).

    theta_TE = sum over i of A_i cos(i n theta + phi_i)

theta is the drive's turn at the gear output and n the gear ratio, so that n theta is the angle of the motor,
and an order i counts waves per turn of the motor.  Recorded motion, which knows the joint's angle and not
every ratio exactly, counts the waves of a turn of the joint instead: i n.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array


def per_joint_turn(order: float, ratio: float) -> float:
    """Waves per turn of the joint, for an order per turn of the motor."""
    return order * ratio


def harmonic(angle: Array, order: float) -> tuple[Array, Array]:
    """Cosine and sine of an order of an angle, both of the motor or both of the joint."""
    return np.cos(order * angle), np.sin(order * angle)


def ripple(turn: Array, ratio: Array, order: int, amplitude: Array, phase: Array) -> tuple[Array, Array]:
    """One component of theta_TE, rad, of that order per turn of the motor, and its derivative with respect to
    the drive's turn, rad, at the gear output.
    """
    angle = order * ratio * turn + phase
    return amplitude * np.cos(angle), -(amplitude * order * ratio * np.sin(angle))
