"""Friction of joints, and what a drive may have wrong about its own torque.

Friction of a joint, seen at its motor: Coulomb, viscous, Stribeck's fall at low speed, and friction that
grows with the load.

Stribeck: (F_s - F_c) exp(-(v / v_s)^2) sign(v) beside Coulomb and viscous friction (Armstrong-Helouvry,
Dupont and Canudas de Wit 1994).

What a drive may have wrong about its own torque: a constant, and the torque constant.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, NonlinearParameter, Target
from identify.explain.recorded_motion import RecordedMotion
from identify.model.laws.friction import BELL, stribeck_decay


class CoulombFriction(MotionEffect):
    """A torque against the direction of travel."""

    kind: ClassVar[str] = "coulomb-friction"
    says: ClassVar[str] = "Coulomb friction of joint {axis}"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("torque", "N m"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Direction of travel."""
        return scene.on(self.axis, scene.direction(self.axis))


class ViscousFriction(MotionEffect):
    """A torque in proportion to speed."""

    kind: ClassVar[str] = "viscous-friction"
    says: ClassVar[str] = "viscous friction of joint {axis}"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("damping", "N m s/rad"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Speed of the joint."""
        return scene.on(self.axis, scene.velocity[:, self.axis - 1])


class StribeckFriction(MotionEffect):
    """More friction at low speed than at high speed, beyond Coulomb and viscous friction."""

    kind: ClassVar[str] = "stribeck-friction"
    says: ClassVar[str] = "Stribeck friction of joint {axis}: more friction at low speed"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("excess", "N m"),)
    follows: ClassVar[str] = "coulomb-friction"

    def parameters(self, scene: RecordedMotion) -> tuple[NonlinearParameter, ...]:
        """The Stribeck speed, between standing and half the top speed."""
        top = float(np.abs(scene.velocity[:, self.axis - 1]).max())
        return (NonlinearParameter("speed", "rad/s", scene.slow, max(0.5 * top, 4 * scene.slow), log=True),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Direction of travel times the bell over speed."""
        bell = stribeck_decay(scene.travel[:, self.axis - 1], parameters[0], BELL)
        return scene.on(self.axis, scene.direction(self.axis) * bell)


class LoadDependentFriction(MotionEffect):
    """Friction in proportion to the torque that the gear carries."""

    kind: ClassVar[str] = "load-dependent-friction"
    says: ClassVar[str] = "friction of joint {axis} that grows with the torque in its gear"
    positive: ClassVar[bool] = True
    of_load: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("share", "1"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Direction of travel times the load at the motor."""
        load = np.abs(scene.load[:, self.axis - 1]) / scene.gear_ratio[self.axis - 1]
        return scene.on(self.axis, scene.direction(self.axis) * load)


class TorqueOffset(MotionEffect):
    """A constant torque: a sensing offset, or friction that differs with the direction of travel."""

    kind: ClassVar[str] = "torque-offset"
    says: ClassVar[str] = (
        "constant torque at motor {axis} (a sensing offset, or friction that differs with direction)"
    )
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("torque", "N m"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Ones."""
        return scene.on(self.axis, np.ones(len(scene.time_s)))


class TorqueConstant(MotionEffect):
    """The torque is stated too high or too low by a share: a wrong torque constant, or all masses wrong by
    it.
    """

    kind: ClassVar[str] = "torque-constant"
    says: ClassVar[str] = "torque constant of motor {axis} off by a share"
    of_load: ClassVar[bool] = True
    of_bodies: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("share", "1"),)

    def possible(self, values: Array) -> bool:
        """A motor that pushes the way it is told to."""
        return bool(values[0] > -1)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """The load at the motor."""
        return scene.on(self.axis, scene.load[:, self.axis - 1] / scene.gear_ratio[self.axis - 1])
