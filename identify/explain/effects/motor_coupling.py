"""A wrist motor that also turns with another joint: its friction and inertia go with the sum of both motions.

With C_ij the share of joint j in the motion of motor i, friction and rotor of motor i see q_i' + C_ij q_j',
and motor j, which holds the gear of i against, carries -C_ij times the torque of joint i.

Coupled wrist gears: a motor feels a share of the torque of its neighbour, as hollow-shaft wrists have
it.

Inertia of the rotor and the fast gear parts: n^2 J at the joint, n J a at the motor.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, NonlinearParameter, Target
from identify.explain.effects.friction import CoulombFriction, ViscousFriction
from identify.explain.effects.rigid_body import LinkInertia
from identify.explain.recorded_motion import RecordedMotion

_LEAST, _MOST = 0.1, 1.6
"""Couplings that are looked for; those of robots are one, or about a half."""
WRIST = 4
"""First joint of a wrist."""


@dataclass(frozen=True)
class MotorCoupling(MotionEffect):
    """The motor of `axis` turns with the joint `other` too; stated: inertia of its rotor, kg m^2."""

    other: int = 0
    stated: float = 0.0
    kind: ClassVar[str] = "motor-coupling"
    says: ClassVar[str] = "motor {axis} also turns with joint {other}: friction and inertia of their sum"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    replaces: ClassVar[str] = "coulomb-friction"
    coefficients = (
        Coefficient("Coulomb friction", "N m"),
        Coefficient("viscous friction", "N m s/rad"),
        Coefficient("rotor inertia", "kg m^2"),
    )
    nonlinear = (NonlinearParameter("coupling", "1", -_MOST, _MOST),)

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Every pair of examined wrist joints; none where the coupling is stated."""
        wrist = [axis for axis in scene.axes if axis >= WRIST and scene.coupling is None]
        pairs = ((axis, other) for axis in wrist for other in wrist if other != axis)
        yield from (cls(axis, other, float(scene.rotor_inertia[axis - 1])) for axis, other in pairs)

    @property
    def name(self) -> str:
        """`joint6.motor-coupling.joint5`."""
        return f"{super().name}.joint{self.other}"

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """Friction and inertia of its own joint alone."""
        return ((CoulombFriction(self.axis), ViscousFriction(self.axis), RotorInertia(self.axis)),)

    def possible(self, values: Array) -> bool:
        """Friction and inertia of a motor that really turns with the other joint."""
        return bool(values[0] >= 0 and self.stated + values[2] > 0 and abs(values[3]) > _LEAST)

    def reading(self, values: Array) -> str:
        """The number for the study."""
        return (
            f"{values[3]:.3g} turns with joint {self.other}: row {self.axis}, column {self.other} of"
            " drives.coupling"
        )

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Direction, speed and acceleration of the motor."""
        own, other, share = self.axis - 1, self.other - 1, parameters[0]
        speed = scene.velocity[:, own] + share * scene.velocity[:, other]
        acceleration = scene.acceleration[:, own] + share * scene.acceleration[:, other]
        direction = np.tanh(2 * speed / scene.slow)
        return scene.on(self.axis, direction, speed, scene.gear_ratio[own] * acceleration)

    def starts(self, scene: RecordedMotion, residual: Array) -> list[Array]:
        """Shares on both sides, as those of robots."""
        return [np.array([share]) for share in (-1.0, -0.5, 0.5, 1.0)]


@dataclass(frozen=True)
class GearCoupling(MotionEffect):
    """A share of the joint torque of `other` at the motor of `axis`."""

    other: int = 0
    kind: ClassVar[str] = "gear-coupling"
    says: ClassVar[str] = "gear coupling: motor {axis} carries a share of the torque of joint {other}"
    of_load: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("share", "1"),)

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Every pair of examined wrist joints."""
        wrist = [axis for axis in scene.axes if axis >= WRIST]
        yield from (cls(axis, other) for axis in wrist for other in wrist if other != axis)

    @property
    def name(self) -> str:
        """`joint4.gear-coupling.joint5`."""
        return f"{super().name}.joint{self.other}"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Load of the other joint at this motor."""
        return scene.on(self.axis, scene.load[:, self.other - 1] / scene.gear_ratio[self.axis - 1])


@dataclass(frozen=True)
class RotorInertia(MotionEffect):
    """The rotor's inertia, or what it is off where the drive's inertia is known; stated: that, kg m^2."""

    stated: float = 0.0
    kind: ClassVar[str] = "rotor-inertia"
    says: ClassVar[str] = "inertia of the rotor of joint {axis} beyond what is known"
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("inertia", "kg m^2"),)

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Every examined joint, with what is stated of its rotor."""
        yield from (cls(axis, float(scene.rotor_inertia[axis - 1])) for axis in scene.axes)

    def possible(self, values: Array) -> bool:
        """A rotor that has an inertia, all in all."""
        return bool(self.stated + values[0] > 0)

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """A wrong inertia of the link that the joint moves, which asks for a torque with its acceleration
        too.
        """
        return ((LinkInertia(self.axis),),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Acceleration of the motor."""
        return scene.on(self.axis, scene.gear_ratio[self.axis - 1] * scene.acceleration[:, self.axis - 1])
