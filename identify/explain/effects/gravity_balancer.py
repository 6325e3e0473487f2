"""A balancer between the carousel (link 1) and the arm (link 2): a spring or gas cylinder beside joint 2.

With anchors at distances A and B from the axis and psi the angle between them, the cylinder has length L =
sqrt(A^2 + B^2 - 2 A B cos psi).  A pull F = F_0 + k (L - L_0) asks A B sin(psi) F / L of the drive, which is
k A B sin(psi) + (F_0 - k L_0) B sin(psi) / sqrt(1 + r^2 - 2 r cos psi), r = B / A.  The first term is a sine
of the joint angle whatever the geometry; the second, a preload, has the geometry inside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import ClassVar, Self

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, NonlinearParameter, Target
from identify.explain.effects.rigid_body import LinkFirstMoment
from identify.explain.recorded_motion import RecordedMotion

_JOINT = 2


class GravityBalancer(MotionEffect):
    """The part of the balancer that goes with a sine of the joint angle, as a stretched spring with no slack
    length has it.
    """

    kind: ClassVar[str] = "gravity-balancer"
    says: ClassVar[str] = "gravity balancer beside joint {axis} (a sine of the joint angle)"
    target: ClassVar[Target] = "torque"
    in_gear: ClassVar[bool] = True
    coefficients = (Coefficient("sine at the joint", "N m"), Coefficient("cosine at the joint", "N m"))

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Joint 2."""
        if _JOINT in scene.axes:
            yield cls(_JOINT)

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """A wrong first moment of the arm, which asks for a sine of the angle too."""
        return ((LinkFirstMoment(self.axis),),)

    def reading(self, values: Array) -> str:
        """Largest torque and the angle of none."""
        peak, zero = np.hypot(*values[:2]), np.degrees(np.arctan2(-values[1], values[0]))
        return (
            f"at most {peak:.4g} N m at the joint, none at {zero:.1f}° and {zero - np.sign(zero) * 180:.1f}°"
        )

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Sine and cosine of the joint angle over the gear ratio."""
        angle, ratio = scene.joint_position[:, self.axis - 1], scene.gear_ratio[self.axis - 1]
        return scene.on(self.axis, np.sin(angle) / ratio, np.cos(angle) / ratio)


class BalancerPreload(MotionEffect):
    """The preload of the balancer's spring or gas, whose lever changes with its length."""

    kind: ClassVar[str] = "balancer-preload"
    says: ClassVar[str] = (
        "preload of the balancer beside joint {axis}, whose lever changes with the cylinder's length"
    )
    target: ClassVar[Target] = "torque"
    in_gear: ClassVar[bool] = True
    coefficients = (Coefficient("moment at the joint", "N m"),)
    nonlinear = (
        NonlinearParameter("angle", "rad", -np.pi, np.pi),
        NonlinearParameter("ratio", "1", 0.05, 0.95),
    )
    follows: ClassVar[str] = "gravity-balancer"

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Joint 2."""
        if _JOINT in scene.axes:
            yield cls(_JOINT)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """sin(psi) / sqrt(1 + r^2 - 2 r cos psi) over the gear ratio, psi = q - angle."""
        angle, r = scene.joint_position[:, self.axis - 1] - parameters[0], parameters[1]
        lever = np.sin(angle) / np.sqrt(1 + r**2 - 2 * r * np.cos(angle))
        return scene.on(self.axis, lever / scene.gear_ratio[self.axis - 1])

    def starts(self, scene: RecordedMotion, residual: Array) -> list[Array]:
        """All round, with short and long levers."""
        return [
            np.array([angle, ratio])
            for angle in np.radians([-135.0, -45.0, 45.0, 135.0])
            for ratio in (0.3, 0.7)
        ]
