"""A mass that the robot description lacks or states wrongly: a gripper, a cable package, a payload."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.parameters import Values, single_parameter
from identify.model.effects.attached import Attached
from identify.model.effects.base import Term
from identify.model.effects.place import Place
from identify.model.effects.rigid_body import RigidBody
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point


class AddedMass(RigidBody, Attached):
    """A point mass or a rigid body fixed to a link."""

    kind: Literal["added-mass"] = "added-mass"
    mass: Values = Field(Values(initial=1.0, bounds=(0.0, 100.0)), description="kg")

    def sentence(self) -> str:
        """For example: added mass on link6."""
        return f"added {'mass' if self.extent == 'point' else 'body (mass, centre, inertia)'} on {self.link}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """On every moving link, as a body; the mass may be negative, where the description says too much."""
        whole = sum(link.mass for link in robot.links)
        for link in robot.links[1:]:
            if link.mass > 0:
                reach = (-round(link.mass / 2, 3), round(link.mass + 0.1 * whole, 3))
                yield cls(
                    link=link.name,
                    extent="body",
                    mass=Values(initial=round(0.02 * link.mass, 6), bounds=reach),
                )

    def variants(self) -> list[Self]:
        """A point at the link's centre of mass."""
        return [self.model_copy(update={"extent": "point"})] if self.extent == "body" else []

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """A point of the link; of a body with what turns it."""
        return self.body_places(robot, self.extent)

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The mass with its weight; of a body then the moments."""
        mass = single_parameter(f"{self.link}.mass", "kg", self.mass, f"{where}.mass", default=1.0)
        own = np.zeros((3, len(site.coordinates)))
        return self.masses(robot, site, self.link, self.position(robot), own, mass, where)
