"""A drive that stiffens as it winds up: a cubic spring T = k_3 q^3 parallel to the joint's own, as of teeth
and flexsplines under load.
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
from identify.model.effects.springs import START_HZ
from identify.model.effects.torque_law import TorqueLaw
from identify.robot.description import Robot

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
