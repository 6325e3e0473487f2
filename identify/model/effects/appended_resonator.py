"""A small body on a spring that slides along one axis of a link: a hose, a cable package, a gripper finger, a
local mode.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.parameters import DampingValues, Values, parameter, spread
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.attached import Attached
from identify.model.effects.base import Term
from identify.model.effects.place import Place
from identify.model.effects.rigid_body import RigidBody
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import spring_terms
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

_SHARE = 0.02
"""Without a start value the body has this share of the mass that the link carries."""


class AppendedResonator(RigidBody, Attached):
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

    def limits(self) -> list[AddedMass]:
        """Far above the band a body that is fixed to the link."""
        return [AddedMass(link=self.link, extent="body")] if self.extent == "body" else []

    @property
    def _coordinate(self) -> str:
        return f"{self.link}.resonator_{self.axis}"

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """Its displacement against the link."""
        return [Added(self._coordinate, self.link)]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """Its displacement against the link."""
        return [self._coordinate]

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """A point of the link; of a body with what turns it."""
        return self.body_places(robot, self.extent)

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """Mass with its weight, stiffness, damping; of a body then the moments."""
        name = self._coordinate
        start = spread(self.mass, np.array([_SHARE * self.carried(robot)]), f"{where}.mass")
        mass = parameter(f"{name}.mass", "kg", float(start[0]), self.mass, f"{where}.mass")
        own = np.outer(np.eye(3)["xyz".index(self.axis)], site.vector(name))
        first, *moments = self.masses(robot, site, self.link, self.position(robot), own, mass, where)
        keys, places = (f"{where}.stiffness", f"{where}.damping"), [(name, "N/m", site.unit(name))]
        return [first, *spring_terms(places, start, self.stiffness, self.damping, keys), *moments]
