"""Inertia of the rotor and the fast gear parts: n^2 J at the joint, n J a at the motor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.effects.rigid_body import LinkInertia
from identify.explain.recorded_motion import RecordedMotion


@dataclass(frozen=True)
class RotorInertia(MotionEffect):
    """The rotor's inertia, or what it is off where the drive's inertia is known; stated: that, kg m^2."""

    stated: float = 0.0
    kind: ClassVar[str] = "rotor-inertia"
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("inertia", "kg m^2"),)

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Every examined joint, with what is stated of its rotor."""
        yield from (cls(axis, float(scene.rotor_inertia[axis - 1])) for axis in scene.axes)

    def possible(self, values: Array) -> bool:
        """A rotor that has an inertia, all in all."""
        return bool(self.stated + values[0] > 0)

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
