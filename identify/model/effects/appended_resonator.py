"""A small body on a spring that slides along one axis of a link: a hose, a cable package, a gripper finger, a
local mode.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.parameters import DampingValues, Parameter, Values, parameter, spread
from identify.model.effects.attached import AttachedMass
from identify.model.effects.base import Contribution
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import START_HZ
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

_SHARE = 0.02
"""Without a start value the body has this share of the mass that the link carries."""


class AppendedResonator(AttachedMass):
    """A point mass or a rigid body with one coordinate u of its own, along an axis of the link; otherwise it
    goes with the link.

    A point's inertia is m (J_a + e_u)' (J_a + e_u) + m sum of J_b' J_b over the two other axes b, with J the
    rows of the link point's Jacobian and e_u the row that picks u; the weight's gravity stiffness includes
    the coupling of u with the link's rotations.
    """

    kind: Literal["appended-resonator"] = "appended-resonator"
    axis: Literal["x", "y", "z"] = Field(description="axis of the link's frame along which it moves")
    mass: Values = Field(Values(), description="kg; default start: 2 % of what the link carries")
    stiffness: Values = Field(Values(), description="N/m; default start: 20 Hz on the held link")
    damping: DampingValues = Field(DampingValues(), description="N s/m")

    def sentence(self) -> str:
        """For example: appended resonator on link3 along y."""
        return (
            f"appended resonator{'' if self.extent == 'point' else ' (mass, centre, inertia)'} on {self.link}"
            f" along {self.axis}"
        )

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Along each axis of every moving link, as a body: a point at the centre of mass is rarely where it
        sits.
        """
        axes: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")
        for link in robot.links[1:]:
            for axis in axes:
                yield cls(link=link.name, axis=axis, extent="body")

    def variants(self) -> list[Self]:
        """A point at the link's centre of mass."""
        return [self.model_copy(update={"extent": "point"})] if self.extent == "body" else []

    @property
    def _coordinate(self) -> str:
        return f"{self.link}.resonator_{self.axis}"

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """Its displacement against the link."""
        return [Added(self._coordinate, self.link)]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """Its displacement against the link."""
        return [self._coordinate]

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """Mass, stiffness, damping; of a body then the moments."""
        mass = spread(self.mass, np.array([_SHARE * self.carried(robot)]), f"{where}.mass")
        k = spread(self.stiffness, mass * (2 * np.pi * START_HZ) ** 2, f"{where}.stiffness")
        c = spread(self.damping, 2 * self.damping.damping_ratio * np.sqrt(k * mass), f"{where}.damping")
        name = self._coordinate
        return [
            parameter(f"{name}.mass", "kg", float(mass[0]), self.mass, f"{where}.mass"),
            parameter(f"{name}.stiffness", "N/m", float(k[0]), self.stiffness, f"{where}.stiffness"),
            parameter(f"{name}.damping", "N s/m", float(c[0]), self.damping, f"{where}.damping"),
            *self.moments(robot, name, where),
        ]

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """A unit mass with its weight, a unit spring, a unit damper; of a body then the moments."""
        own, unit = site.vector(self._coordinate), site.unit(self._coordinate)
        mass, *moments = self.inertial(robot, site, np.outer(np.eye(3)["xyz".index(self.axis)], own))
        return [mass, Contribution(stiffness=unit), Contribution(damping=unit), *moments]
