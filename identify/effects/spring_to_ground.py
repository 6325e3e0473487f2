"""A spring and damper between a point of a link and the ground: a weight balancer, a hose to the ceiling, a hand that holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field

from identify.effects.attached import Attached
from identify.effects.base import Contribution, DampingValues, Parameter, Values
from identify.effects.site import Site
from identify.effects.springs import parameter, spread, unique
from identify.robot.description import Robot
from identify.robot.points import Point

_START_HZ = 5.0
"""Without a start value, the link and all that it carries would resonate here on this spring alone: a soft start, that hardly disturbs."""


class SpringToGround(Attached):
    """Springs without preload along axes of the base; small displacements, so that their directions stay."""

    kind: Literal["spring-to-ground"] = "spring-to-ground"
    axes: Annotated[list[Literal["x", "y", "z"]], AfterValidator(unique)] = Field(
        ["x", "y", "z"], min_length=1, description="directions in the base's frame"
    )
    stiffness: Values = Field(Values(), description="N/m")
    damping: DampingValues = Field(DampingValues(), description="N s/m")

    def sentence(self) -> str:
        """For example: spring between link2 and the ground (x, y, z)."""
        return f"spring between {self.link} and the ground ({', '.join(self.axes)})"

    @classmethod
    def places(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """All three directions at the centre of mass of every moving link."""
        for link in robot.links[1:]:
            yield cls(link=link.name)

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """A stiffness and a damping per direction."""
        mass = np.full(len(self.axes), self.carried(robot))
        k = spread(self.stiffness, mass * (2 * np.pi * _START_HZ) ** 2, f"{where}.stiffness")
        c = spread(self.damping, 2 * self.damping.damping_ratio * np.sqrt(k * mass), f"{where}.damping")
        result = []
        for axis, stiffness, damping in zip(self.axes, k, c, strict=True):
            name = f"{self.link}.ground_{axis}"
            result.append(parameter(f"{name}.stiffness", "N/m", stiffness, self.stiffness, f"{where}.stiffness"))
            result.append(parameter(f"{name}.damping", "N s/m", damping, self.damping, f"{where}.damping"))
        return result

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """J' J of the point's motion along each direction."""
        rows = site.base_jacobian(self.link, self.position(robot), self.where)[["xyz".index(axis) for axis in self.axes]]
        units = [np.outer(row, row) for row in rows]
        return [part for unit in units for part in (Contribution(stiffness=unit), Contribution(damping=unit))]
