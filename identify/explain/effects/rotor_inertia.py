"""Inertia of the rotor and the fast gear parts: n^2 J at the joint, n J a at the motor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.effects.rigid_body import LinkInertia
from identify.explain.recorded_motion import RecordedMotion


class RotorInertia(MotionEffect):
    """The rotor's inertia, or what it is off where the drive's inertia is known."""

    kind: ClassVar[str] = "rotor-inertia"
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("inertia", "kg m^2"),)

    def sentence(self) -> str:
        """What this instance is."""
        return f"inertia of the rotor of joint {self.axis} beyond what is known"

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """A wrong inertia of the link that the joint moves, which asks for a torque with its acceleration
        too.
        """
        return ((LinkInertia(self.axis),),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Acceleration of the motor."""
        return scene.on(self.axis, scene.gear_ratio[self.axis - 1] * scene.acceleration[:, self.axis - 1])
