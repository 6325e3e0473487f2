"""What a servo loop leaves of a command: the tracking error (command minus motor position) of position P,
velocity PI control.

With K_v the position gain, K the velocity gain and T_i its integral time, torque = K (K_v e - v) + K / T_i *
integral(K_v e - v), so e = v / K_v + torque / (K K_v) - integral(e - v / K_v) / T_i; a feed-forward of speed
or torque that is only partly right leaves the first or the second term with other factors.
"""

from __future__ import annotations

from typing import ClassVar

import scipy

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.recorded_motion import RecordedMotion


class PositionLag(MotionEffect):
    """Error in proportion to speed."""

    kind: ClassVar[str] = "position-lag"
    says: ClassVar[str] = "position loop of joint {axis}: error in proportion to speed"
    target: ClassVar[Target] = "tracking"
    coefficients = (Coefficient("lag", "s"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Speed."""
        return scene.on(self.axis, scene.velocity[:, self.axis - 1])


class AccelerationLag(MotionEffect):
    """Error in proportion to acceleration."""

    kind: ClassVar[str] = "acceleration-lag"
    says: ClassVar[str] = (
        "servo loop of joint {axis}: error in proportion to acceleration (no or partial"
        " feed-forward of inertia)"
    )
    target: ClassVar[Target] = "tracking"
    coefficients = (Coefficient("lag squared", "s^2"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Acceleration."""
        return scene.on(self.axis, scene.acceleration[:, self.axis - 1])


class ServoCompliance(MotionEffect):
    """Error in proportion to the motor's torque."""

    kind: ClassVar[str] = "servo-compliance"
    says: ClassVar[str] = "servo loop of joint {axis} as a spring: error in proportion to the motor's torque"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "tracking"
    coefficients = (Coefficient("compliance", "rad/(N m)"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Torque of the motor."""
        return scene.on(self.axis, scene.motor_torque[:, self.axis - 1])


class IntegralAction(MotionEffect):
    """The velocity loop's integrator works the error off."""

    kind: ClassVar[str] = "integral-action"
    says: ClassVar[str] = "integral action of the velocity loop of joint {axis}"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "tracking"
    coefficients = (Coefficient("rate", "1/s"), Coefficient("rate times lag", "1"))

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Minus the integral of the error, and the angle travelled."""
        if scene.error is None:
            raise ValueError("a tracking error without a command")
        joint = self.axis - 1
        integral = scipy.integrate.cumulative_trapezoid(scene.error[:, joint], scene.time_s, initial=0.0)
        return scene.on(self.axis, -integral, scene.position[:, joint] - scene.position[0, joint])
