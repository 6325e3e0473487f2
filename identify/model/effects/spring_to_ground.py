"""A spring and damper between a point of a link and the ground: a weight balancer, a hose to the ceiling, a
hand that holds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field

from identify.core.parameters import DampingValues, Parameter, Values, parameter, spread
from identify.model.effects.attached import Attached
from identify.model.effects.base import Contribution
from identify.model.effects.site import Site
from identify.model.effects.springs import unique
from identify.robot.description import Robot
from identify.robot.points import Point

_REACH = 1e3
_START_HZ = 5.0
"""Without a start value, the link and all that it carries would resonate here on this spring alone: a soft
start, that hardly disturbs.
"""


class SpringToGround(Attached):
    """Springs without preload along axes of the base; small displacements, so that their directions stay."""

    kind: Literal["spring-to-ground"] = "spring-to-ground"
    axes: Annotated[list[Literal["x", "y", "z"]], AfterValidator(unique)] = Field(
        ["x", "y", "z"], min_length=1, description="directions in the base's frame"
    )
    stiffness: Values = Field(Values(), description="N/m")
    damping: DampingValues = Field(DampingValues(), description="N s/m")
    leaning: bool = Field(
        False, description="also couple the directions, for a spring that stands askew to the base's axes"
    )

    def sentence(self) -> str:
        """For example: spring between link2 and the ground (x, y, z)."""
        directions = "in any direction" if self.leaning else f"({', '.join(self.axes)})"
        return (
            f"spring between {self.link}{'' if self.at_m is None else ' at ' + str(list(self.at_m))} and the"
            f" ground {directions}"
        )

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """In any direction, at the centre of mass and at the far end of every moving link."""
        for link in robot.links[1:]:
            ends = [joint.origin[:3, 3] for joint in robot.joints if joint.parent == link.name]
            for at in (None, *((float(x), float(y), float(z)) for x, y, z in ends)):
                yield cls(link=link.name, at_m=at, leaning=True)

    def variants(self) -> list[Self]:
        """Along the base's axes, and each of them alone."""
        if not self.leaning:
            return (
                [self.model_copy(update={"axes": [axis]}) for axis in self.axes] if len(self.axes) > 1 else []
            )
        return [self.model_copy(update={"leaning": False})]

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """A stiffness and a damping per direction."""
        mass = np.full(len(self.axes), self.carried(robot))
        k = spread(self.stiffness, mass * (2 * np.pi * _START_HZ) ** 2, f"{where}.stiffness")
        c = spread(self.damping, 2 * self.damping.damping_ratio * np.sqrt(k * mass), f"{where}.damping")
        result = []
        for axis, stiffness, damping in zip(self.axes, k, c, strict=True):
            name = f"{self.link}.ground_{axis}"
            result.append(
                parameter(f"{name}.stiffness", "N/m", stiffness, self.stiffness, f"{where}.stiffness")
            )
            result.append(parameter(f"{name}.damping", "N s/m", damping, self.damping, f"{where}.damping"))
        return [*result, *self._couplings(max(k), max(c), where)]

    def _couplings(self, k: float, c: float, where: str) -> list[Parameter]:
        """Stiffness and damping between directions, no more than some multiple of their start values; none
        unless leaning.
        """
        result = []
        for one, other in combinations(self.axes, 2) if self.leaning else ():
            for what, unit, reach in (("stiffness", "N/m", _REACH * k), ("damping", "N s/m", _REACH * c)):
                values = Values(initial=0.0, bounds=(-reach, reach))
                name = f"{self.link}.ground_{one}{other}.{what}"
                result.append(parameter(name, unit, 0.0, values, f"{where}.{what}", log=False))
        return result

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """J' J of the point's motion along each direction, and J1' J2 + J2' J1 for two."""
        rows = site.base_jacobian(self.link, self.position(robot), self.where)[
            ["xyz".index(axis) for axis in self.axes]
        ]
        units = [np.outer(row, row) for row in rows]
        if self.leaning:
            units += [np.outer(one, other) + np.outer(other, one) for one, other in combinations(rows, 2)]
        return [part for unit in units for part in (Contribution(stiffness=unit), Contribution(damping=unit))]
