"""Errors of the rigid bodies: the payload's mass, and first moments and inertias of links; all joints feel
them.

A balancer between the carousel (link 1) and the arm (link 2): a spring or gas cylinder beside joint 2.

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
from identify.explain.recorded_motion import RecordedMotion
from identify.robot.description import Link

_REAL = 1e-9
"""Share of the load's torque below which a column is rounding: the first link's first moment along a vertical
axis.
"""


class PayloadMass(MotionEffect):
    """Mass at the centre of the payload beyond what is stated."""

    kind: ClassVar[str] = "payload-mass"
    says: ClassVar[str] = "payload heavier or lighter than stated"
    target: ClassVar[Target] = "torque"
    in_gear: ClassVar[bool] = True
    of_bodies: ClassVar[bool] = True
    coefficients = (Coefficient("mass", "kg"),)

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """The last joint, which carries the payload."""
        yield cls(len(scene.gear_ratio))

    @property
    def name(self) -> str:
        """`payload-mass`."""
        return self.kind

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Torque of a kilogram at the payload's centre."""
        link, centre = scene.payload
        if self not in scene.cache:
            body = Link("payload", 1.0, np.array(centre), np.zeros((3, 3)))
            scene.cache[self] = scene.on_all(scene.arm.added(link, body))
        return scene.cache[self]


BEYOND = 6.0
"""How many times its stated uncertainty the error of a body is expected to be where it is named by itself."""


class _OfLink(MotionEffect):
    """An error of the link that a joint moves."""

    target: ClassVar[Target] = "torque"
    in_gear: ClassVar[bool] = True
    of_bodies: ClassVar[bool] = True

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """The links that the examined joints move."""
        yield from (cls(axis) for axis in scene.axes)

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """A payload on that link, which is known less well than its drawing."""
        carried, _ = scene.arm.robot.carrier(scene.payload[0])
        on_it = scene.arm.robot.links[self.axis].name == carried
        return ((PayloadMass(len(scene.gear_ratio)),),) if on_it else ()

    @property
    def name(self) -> str:
        """`link2.first-moment`."""
        return f"link{self.axis}.{self.kind.removeprefix('link-')}"


class LinkFirstMoment(_OfLink):
    """Mass times centre of a link, in its plane across the joint axis; a joint upright on the ground does not
    feel its weight.
    """

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """The links that the examined joints move, but for the first on an upright axis."""
        robot = scene.arm.robot
        first = robot.joints[0]
        upright = np.linalg.norm(
            np.cross(first.origin[:3, :3] @ first.axis, robot.gravity)
        ) < 1e-6 * np.linalg.norm(robot.gravity)
        yield from (cls(axis) for axis in scene.axes if axis > 1 or not upright)

    kind: ClassVar[str] = "link-first-moment"
    says: ClassVar[str] = (
        "centre of mass of link {axis} elsewhere than stated (first moment across the joint axis)"
    )
    coefficients = (Coefficient("first", "kg m"), Coefficient("second", "kg m"))

    def expected_size(self, scene: RecordedMotion) -> Array:
        """Some times the stated uncertainty of mass and centre."""
        link = scene.arm.robot.links[self.axis]
        reach = np.hypot(scene.stated.mass, scene.stated.centre) * link.mass * np.linalg.norm(link.centre)
        return np.full(2, 1 / (BEYOND * reach) if reach > 0 else 0.0)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Torque of a kg m along two directions across the joint axis."""
        if self not in scene.cache:
            joint = scene.arm.robot.joints[self.axis - 1]
            along = joint.mount[:3, :3].T @ joint.axis
            link = scene.arm.robot.links[self.axis].name
            moments = np.stack([scene.arm.first_moment(link, direction) for direction in range(3)], axis=2)
            across = np.linalg.svd(along[None])[2][1:]
            found = scene.on_all(*(moments @ direction for direction in across))
            scene.cache[self] = np.where(
                np.abs(found).max(axis=(0, 1)) > _REAL * np.abs(scene.load).max(), found, 0.0
            )
        return scene.cache[self]


class LinkInertia(_OfLink):
    """Inertia of a link about its joint axis."""

    kind: ClassVar[str] = "link-inertia"
    says: ClassVar[str] = "inertia of link {axis} about its joint other than stated"
    coefficients = (Coefficient("inertia", "kg m^2"),)

    def expected_size(self, scene: RecordedMotion) -> Array:
        """Some times the stated uncertainty of mass, centre and inertia, about the joint axis."""
        joint, link = scene.arm.robot.joints[self.axis - 1], scene.arm.robot.links[self.axis]
        along = joint.mount[:3, :3].T @ joint.axis
        arm = float(np.linalg.norm(np.cross(along, link.centre)))
        parts = (
            scene.stated.inertia * float(along @ link.inertia @ along),
            scene.stated.mass * link.mass * arm**2,
            scene.stated.centre * 2 * link.mass * arm * float(np.linalg.norm(link.centre)),
        )
        reach = float(np.linalg.norm(parts))
        return np.full(1, 1 / (BEYOND * reach) if reach > 0 else 0.0)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Torque of a kg m^2 about the joint axis."""
        if self not in scene.cache:
            joint = scene.arm.robot.joints[self.axis - 1]
            along = joint.mount[:3, :3].T @ joint.axis
            scene.cache[self] = scene.on_all(scene.arm.inertia(scene.arm.robot.links[self.axis].name, along))
        return scene.cache[self]


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
