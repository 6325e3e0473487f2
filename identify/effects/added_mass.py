"""A mass that the robot description lacks: a gripper, a cable package, a wrong payload."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.effects.base import Contribution, Effect, Parameter, Site, Values
from identify.effects.springs import parameter, spread
from identify.robot.description import Robot


class AddedMass(Effect):
    """A point mass fixed to a link, with its weight; negative bounds let it correct a mass that is stated too large."""

    kind: Literal["added-mass"] = "added-mass"
    link: str = Field(description="link or frame that carries it")
    at_m: tuple[float, float, float] | None = Field(None, description="position in the link's frame; default: the link's centre of mass")
    mass: Values = Field(Values(initial=1.0, bounds=(0.0, 100.0)), description="kg")

    def sentence(self) -> str:
        """For example: added mass on link6."""
        return f"added mass on {self.link}"

    @classmethod
    def places(cls, robot: Robot) -> Iterator[Self]:
        """The centre of mass of every moving link."""
        for link in robot.links[1:]:
            yield cls(link=link.name)

    def released(self, robot: Robot) -> list[str]:
        """None: the mass only adds inertia and weight to coordinates that others release."""
        return []

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """The mass."""
        initial = float(spread(self.mass, np.ones(1), f"{where}.mass")[0])
        return [parameter(f"{self.link}.mass", "kg", initial, self.mass, f"{where}.mass", log=False)]

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """Inertia J' J of a unit mass and the gravity stiffness of its weight."""
        where = "effects.added-mass.link"
        point = np.asarray(self.at_m) if self.at_m is not None else robot.link(self.link, where).centre
        jacobian = site.jacobian(self.link, point, where)[:3]
        weight = site.weight_stiffness(self.link, point, where)
        return [Contribution(mass=jacobian.T @ jacobian, stiffness=weight)]
