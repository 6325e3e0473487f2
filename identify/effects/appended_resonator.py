"""A small body on a spring that slides along one axis of a link: a hose, a cable package, a gripper finger, a local mode."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.effects.attached import Attached
from identify.effects.base import Contribution, DampingValues, Parameter, Values
from identify.effects.site import Added, Site
from identify.effects.springs import START_HZ, parameter, spread
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

_SHARE = 0.02
"""Without a start value the body has this share of the mass that the link carries."""


class AppendedResonator(Attached):
    """A point mass with one coordinate u of its own, along an axis of the link; across it, it goes with the link.

    Its inertia is m (J_a + e_u)' (J_a + e_u) + m sum of J_b' J_b over the two other axes b, with J the rows of the link point's
    Jacobian and e_u the row that picks u; the weight's gravity stiffness includes the coupling of u with the link's rotations.
    """

    kind: Literal["appended-resonator"] = "appended-resonator"
    axis: Literal["x", "y", "z"] = Field(description="axis of the link's frame along which it moves")
    mass: Values = Field(Values(), description="kg; default start: 2 % of what the link carries")
    stiffness: Values = Field(Values(), description="N/m; default start: 20 Hz on the held link")
    damping: DampingValues = Field(DampingValues(), description="N s/m")

    def sentence(self) -> str:
        """For example: appended resonator on link3 along y."""
        return f"appended resonator on {self.link} along {self.axis}"

    @classmethod
    def places(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Each axis at the centre of mass of every moving link."""
        axes: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")
        for link in robot.links[1:]:
            for axis in axes:
                yield cls(link=link.name, axis=axis)

    @property
    def _coordinate(self) -> str:
        return f"{self.link}.resonator_{self.axis}"

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """Its displacement against the link."""
        return [Added(self._coordinate, self.link)]

    def released(self, robot: Robot) -> list[str]:
        """Its displacement against the link."""
        return [self._coordinate]

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """Mass, stiffness, damping."""
        mass = spread(self.mass, np.array([_SHARE * self.carried(robot)]), f"{where}.mass")
        k = spread(self.stiffness, mass * (2 * np.pi * START_HZ) ** 2, f"{where}.stiffness")
        c = spread(self.damping, 2 * self.damping.damping_ratio * np.sqrt(k * mass), f"{where}.damping")
        name = self._coordinate
        return [
            parameter(f"{name}.mass", "kg", float(mass[0]), self.mass, f"{where}.mass"),
            parameter(f"{name}.stiffness", "N/m", float(k[0]), self.stiffness, f"{where}.stiffness"),
            parameter(f"{name}.damping", "N s/m", float(c[0]), self.damping, f"{where}.damping"),
        ]

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """A unit mass with its weight, a unit spring, a unit damper."""
        point, axis = self.position(robot), "xyz".index(self.axis)
        jacobian, own = site.jacobian(self.link, point, self.where), site.vector(self._coordinate)
        moved = jacobian[:3].copy()
        moved[axis] += own
        # The weight's potential -g . (point + u a) has the mixed derivative -g . (w x a) = -w . (a x g), with w the link's rotation.
        coupling = np.outer(np.cross(np.eye(3)[axis], site.gravity(self.link)) @ jacobian[3:], own)
        weight = site.weight_stiffness(self.link, point, self.where) - coupling - coupling.T
        unit = site.unit(self._coordinate)
        return [Contribution(mass=moved.T @ moved, stiffness=weight), Contribution(stiffness=unit), Contribution(damping=unit)]
