"""Coulomb friction of a joint, parallel to its spring: a torque against the motion that does not grow with
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

from collections.abc import Callable
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.parameters import Values, parameter, spread
from identify.model.effects.base import Term, Torque
from identify.model.effects.nonlinear import NonlinearEffect
from identify.model.effects.site import Site
from identify.model.effects.torque_law import TorqueLaw
from identify.robot.description import Robot

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
