"""Effects whose share in the motion depends on its amplitude: torques at joints that are no linear function
of what the joint does.

They change no matrix.  The model simulates the hammer impact with the torque as feedback
(`identify.model.transient`), so the FRFs depend on how hard it was: each measurement must say its `impact`,
and only force levels that differ can tell such an effect from a linear one.

A drive that stiffens as it winds up: a cubic spring T = k_3 q^3 parallel to the joint's own, as of teeth
and flexsplines under load.

Coulomb friction of a joint, parallel to its spring: a torque against the motion that does not grow with
it.

    T = clip(D (v + tau dv/dt), -T_c, T_c)

T_c is the friction torque.  While it is not reached the joint sticks, and D and tau say how: D is the
resistance to creep (T_c / D is the rate at which it creeps), tau the time in which a joint that is caught
comes to rest.  D without bound and tau = 0 are the ideal of rigid Coulomb friction; tau = 0 alone is the
usual friction smoothed over a rate of T_c / D; a finite tau is the soft stick of simulators that solve
friction as a constraint (MuJoCo documentation, Computation, "Constraint model": a reference acceleration of
-v / tau and an impedance below one).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.parameters import Values, parameter, spread
from identify.model.effects.base import Effect, Term, Torque
from identify.model.effects.site import Site
from identify.model.effects.springs import START_HZ, Joints, joint_coordinates
from identify.model.effects.torque_law import TorqueLaw
from identify.robot.description import Robot
from identify.robot.points import Point


class NonlinearEffect(Effect):
    """A torque law at some joint axes that a compliance frees; a subclass brings the law and its terms."""

    needs_levels: ClassVar[bool] = True
    of_amplitude: ClassVar[bool] = True
    joints: Joints = Field("all", description="`all`, or joint numbers (from 1) or names")
    axes: list[Literal["rx", "ry", "rz"]] = Field(
        ["rz"], min_length=1, description="axes at each joint, which a compliance must free"
    )

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The drive of every joint."""
        for number in range(1, len(robot.joints) + 1):
            yield cls.model_validate({"kind": cls.model_fields["kind"].default, "joints": [number]})

    def coordinates(self, robot: Robot) -> list[str]:
        """joint1.rz and so on: where the law acts; its terms are in this order."""
        return joint_coordinates(robot, self.joints, list(self.axes), f"effects.{self.kind}.joints")

    def which(self) -> str:
        """For example: joints 2, 3 (rz)."""
        joints = (
            "all joints"
            if self.joints == "all"
            else f"joint{'s' if len(self.joints) > 1 else ''} {', '.join(map(str, self.joints))}"
        )
        return f"{joints} ({', '.join(self.axes)})"


_FELT, _SPAN = 1e-4, 1e6
"""Deflection, rad, at which the cubic spring of the default start is a tenth as stiff as the linear one, and
the factor of its stiffness either side: felt from 0.1 rad, by which the drive of a small arm winds up, down
to 0.1 urad, by which a hammer deflects a large one.
"""


class CubicSpring(TorqueLaw):
    """own: k_3 (N m/rad^3)."""

    count: ClassVar[int] = 1

    def probe(self, own: Array) -> Array:
        """The angle."""
        return np.array([np.ones_like(own[0]), np.zeros_like(own[0]), np.zeros_like(own[0])])

    def solver(self, compliance: Array, own: Array) -> Callable[[Array], Array]:
        """One step of Newton from the free angle: within a time step the torque hardly moves it."""

        def torque(free: Array) -> Array:
            square = own[0] * free * free
            return np.asarray(square * free / (1 + 3 * square * compliance))

        return torque


class HardeningStiffness(NonlinearEffect):
    """Cubic springs parallel to those of some joints; their stiffness is known as well as the impulse of the
    impacts, squared.
    """

    kind: Literal["hardening-stiffness"] = "hardening-stiffness"
    law: ClassVar[TorqueLaw] = CubicSpring()
    cubic: Values = Field(
        Values(),
        description="k_3, N m/rad^3; default start: a tenth of the linear stiffness at 0.1 mrad, default"
        " bounds: a factor of 1e6 either side",
    )

    def sentence(self) -> str:
        """For example: hardening stiffness of joint 2 (rz)."""
        return f"hardening stiffness of {self.which()}"

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """k_3 per coordinate."""
        names, key = self.coordinates(robot), f"{where}.cubic"
        linear = np.array([site.inertia(name) for name in names]) * (2 * np.pi * START_HZ) ** 2
        starts = spread(self.cubic, 0.1 * linear / _FELT**2, key)
        return [
            Term(
                parameter(f"{name}.cubic_stiffness", "N m/rad^3", start, self.cubic, key, span=_SPAN),
                torque=Torque(self.law, name),
            )
            for name, start in zip(names, starts, strict=True)
        ]


_STICK_RATE = 300.0
"""Start of D per inertia of the joint, 1/s."""


class StickingFriction(TorqueLaw):
    """own: T_c (N m), D (N m s/rad), tau (s)."""

    count: ClassVar[int] = 3

    def probe(self, own: Array) -> Array:
        """Rate and, in the share of tau, acceleration."""
        return np.array([np.zeros_like(own[2]), np.ones_like(own[2]), own[2]])

    def solver(self, compliance: Array, own: Array) -> Callable[[Array], Array]:
        """What sticking takes, as far as the friction torque goes."""
        give, most, least = 1 / own[1] + compliance, own[0], -own[0]

        def torque(free: Array) -> Array:
            sticking: Array = np.maximum(np.minimum(free / give, most), least)
            return sticking

        return torque


class JointFriction(NonlinearEffect):
    """Coulomb friction parallel to the springs of some joints; the torque is known as well as the impulse of
    the impacts is.
    """

    kind: Literal["joint-friction"] = "joint-friction"
    law: ClassVar[TorqueLaw] = StickingFriction()
    torque: Values = Field(Values(initial=1.0, bounds=(1e-3, 1e4)), description="T_c, N m")
    stick_damping: Values = Field(
        Values(),
        description="D, N m s/rad: resistance to creep while sticking; default start: from the inertia",
    )
    stick_time: Values = Field(
        Values(initial=3e-3, bounds=(1e-5, 0.1)),
        description="tau, s: in which a joint that sticks comes to rest",
    )

    def sentence(self) -> str:
        """For example: dry friction of joint 2 (rz)."""
        return f"dry friction of {self.which()}"

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """T_c, D and tau per coordinate."""
        names = self.coordinates(robot)
        one, stiff = np.ones(len(names)), _STICK_RATE * np.array([site.inertia(name) for name in names])
        rows = (
            ("friction_torque", "N m", self.torque, f"{where}.torque", one),
            ("stick_damping", "N m s/rad", self.stick_damping, f"{where}.stick_damping", stiff),
            ("stick_time", "s", self.stick_time, f"{where}.stick_time", one),
        )
        starts = [spread(values, default, key) for _, _, values, key, default in rows]
        return [
            Term(parameter(f"{name}.{what}", unit, start[number], values, key), torque=Torque(self.law, name))
            for number, name in enumerate(names)
            for (what, unit, values, key, _), start in zip(rows, starts, strict=True)
        ]
