"""The spring of a gear: hardening (Nagoya Eq. 8), transmission error (Eq. 9) and backlash.

The linear spring and damper are the effect `joint-compliance` about rz.  With theta the drive's turn at the
gear output (the rotor's turn over the ratio) and delta the coordinate rz, the link is at theta + delta, and
the torque on the link is tau = k e + A_3 e^3, where e is what is left of delta - theta_TE(n theta) once half
the backlash either way is taken out.  The transmission error acts back on the rotor, so that energy is kept.

Angular transmission error of a gear: its output waves about its input (Nagoya Eq. 9).

    theta_TE = sum over i of A_i cos(i n theta + phi_i)

theta is the drive's turn at the gear output and n the gear ratio, so that n theta is the angle of the motor,
and an order i counts waves per turn of the motor.  Recorded motion, which knows the joint's angle and not
every ratio exactly, counts the waves of a turn of the joint instead: i n.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array


@dataclass(frozen=True)
class GearSpring:
    """The spring of gears, arrays (lanes, joints): a component of the transmission error is (order,
    amplitude, phase).
    """

    ratio: Array
    stiffness: Array
    cubic: Array
    backlash: Array
    ripples: tuple[tuple[int, Array, Array], ...]

    @cached_property
    def nonlinear(self) -> bool:
        """Whether anything is left to do beside the engine's own linear spring."""
        return bool(self.ripples or np.any(self.cubic) or np.any(self.backlash))

    @cached_property
    def _slack(self) -> bool:
        return bool(np.any(self.backlash))

    def transmission_error(self, turn: Array) -> tuple[Array, Array]:
        """theta_TE, rad, at the drive's turn (rad, gear output), and its derivative with respect to that."""
        error, slope = np.zeros_like(turn), np.zeros_like(turn)
        for component in self.ripples:
            one, its_slope = ripple(turn, self.ratio, *component)
            error += one
            slope += its_slope
        return error, slope

    def torque(self, windup: Array) -> Array:
        """k e + A_3 e^3 for delta - theta_TE = windup."""
        e = windup
        if self._slack:
            e = windup - np.clip(windup, -self.backlash / 2, self.backlash / 2)
        return np.asarray(self.stiffness * e + self.cubic * e**3)

    def beyond_linear(self, turn: Array, delta: Array) -> tuple[Array, Array]:
        """What acts on drive and rz, N m, beside the linear spring -k delta on rz."""
        error, slope = self.transmission_error(turn)
        torque = self.torque(delta - error)
        return torque * slope, self.stiffness * delta - torque

    def windup(self, torque: Array) -> Array:
        """delta - theta_TE under a torque (..., lanes, joints), N m, by Newton's method; the inverse of
        `torque`, at the near stop of the backlash.
        """
        stiffness = np.where(self.stiffness > 0, self.stiffness, 1.0)
        e = torque / stiffness
        for _ in range(30):
            e = e - (stiffness * e + self.cubic * e**3 - torque) / (stiffness + 3 * self.cubic * e**2)
        return np.asarray(e + np.sign(torque) * self.backlash / 2)


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
