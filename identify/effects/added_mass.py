"""A mass that the robot description lacks or states wrongly: a gripper, a cable package, a payload."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.effects.attached import AttachedMass
from identify.effects.base import Contribution, Parameter, Values
from identify.effects.site import Site
from identify.effects.springs import parameter, spread
from identify.robot.description import Robot
from identify.robot.points import Point


class AddedMass(AttachedMass):
    """A point mass or a rigid body fixed to a link."""

    kind: Literal["added-mass"] = "added-mass"
    mass: Values = Field(Values(initial=1.0, bounds=(0.0, 100.0)), description="kg")

    def sentence(self) -> str:
        """For example: added mass on link6."""
        return f"added {'mass' if self.extent == 'point' else 'body (mass, centre, inertia)'} on {self.link}"

    @classmethod
    def places(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """On every moving link: a point at the centre of mass, and a body anywhere."""
        for link in robot.links[1:]:
            yield cls(link=link.name)
            yield cls(link=link.name, extent="body")

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """The mass; of a body then the moments."""
        initial = float(spread(self.mass, np.ones(1), f"{where}.mass")[0])
        mass = parameter(f"{self.link}.mass", "kg", initial, self.mass, f"{where}.mass", log=False)
        return [mass, *self.moments(robot, self.link, where)]

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """Inertia and weight."""
        return self.inertial(robot, site, np.zeros((3, len(site.coordinates))))
