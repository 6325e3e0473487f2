"""A spring and damper between a point of a link and the ground: a weight balancer, a hose to the ceiling, a
hand that holds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from identify.core.arrays import Array
from identify.core.parameters import DampingValues, Parameter, Values, parameter
from identify.model.effects.attached import Attached
from identify.model.effects.base import Term
from identify.model.effects.place import Place
from identify.model.effects.site import Site
from identify.model.effects.springs import spring_terms, unique
from identify.robot.description import Robot
from identify.robot.points import Point

_REACH = 1e3
_START_HZ = 5.0
"""Without a start value, the link and all that it carries would resonate here on this spring alone: a soft
start, that hardly disturbs.
"""


class SpringToGround(Attached):
    """Springs without preload along axes of the base; small displacements, so that their directions stay."""

    RENAMED: ClassVar[Mapping[str, str]] = {"leaning": "cross_coupling"}
    kind: Literal["spring-to-ground"] = "spring-to-ground"
    axes: Annotated[list[Literal["x", "y", "z"]], AfterValidator(unique)] = Field(
        ["x", "y", "z"], min_length=1, description="directions in the base's frame"
    )
    stiffness: Values = Field(Values(), description="N/m")
    damping: DampingValues = Field(DampingValues(), description="N s/m")
    cross_coupling: bool = Field(
        False, description="also couple the directions, for a spring that is inclined to the base's axes"
    )
    direction: tuple[float, float, float] | None = Field(
        None, description="of a single strut, in the base's frame, in place of axes; of any length"
    )

    @model_validator(mode="after")
    def _one_direction(self) -> Self:
        if self.direction is not None:
            if self.cross_coupling or "axes" in self.model_fields_set:
                raise ValueError("direction: stands in place of axes and cross_coupling; leave these out")
            if not np.linalg.norm(self.direction) > 0:
                raise ValueError("direction: has no length; expected one such as [0, 0, 1]")
        return self

    def sentence(self) -> str:
        """For example: spring between link2 and the ground (x, y, z)."""
        at = "[" + ", ".join(f"{x:.3g}" for x in self.at_m or ()) + "] m"
        directions = "in any direction" if self.cross_coupling else f"({', '.join(self.axes)})"
        if self.direction is not None:
            directions = "along [" + ", ".join(f"{x:.2f}" for x in self._unit) + "]"
        place = self.link if self.at_m is None else f"{self.link} at {at}"
        return f"spring between {place} and the ground {directions}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """In any direction, at the centre of mass and at the far end of every moving link."""
        for link in robot.links[1:]:
            ends = [joint.origin[:3, 3] for joint in robot.joints if joint.parent == link.name]
            for at in (None, *((float(x), float(y), float(z)) for x, y, z in ends)):
                yield cls(link=link.name, at_m=at, cross_coupling=True)

    def variants(self) -> list[Self]:
        """Along the base's axes, and each of them alone."""
        if self.direction is not None:
            return []
        if not self.cross_coupling:
            return (
                [self.model_copy(update={"axes": [axis]}) for axis in self.axes] if len(self.axes) > 1 else []
            )
        return [self.model_copy(update={"cross_coupling": False})]

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """A point of the link, along axes of the base, or along a strut."""
        if self.direction is None:
            return [self.attachment(robot, "base")]
        x, y, z = (float(one) for one in self._unit)
        return [self.attachment(robot, "base", (x, y, z))]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """A stiffness and a damping per direction, J' J of the point's motion; then the couplings."""
        motion = site.base_jacobian(self.link, self.position(robot), self.where)
        rows = [motion["xyz".index(axis)] for axis in self.axes]
        names = [f"{self.link}.ground_{axis}" for axis in self.axes]
        if self.direction is not None:
            rows, names = [self._unit @ motion[:3]], [f"{self.link}.strut"]
        places = [(name, "N/m", np.outer(row, row)) for name, row in zip(names, rows, strict=True)]
        mass, keys = np.full(len(rows), self.carried(robot)), (f"{where}.stiffness", f"{where}.damping")
        terms = spring_terms(places, mass, self.stiffness, self.damping, keys, _START_HZ)
        return terms + (self._couplings(terms, rows, where) if self.cross_coupling else [])

    @property
    def settings_found(self) -> int:
        """The two angles of a strut."""
        return 0 if self.direction is None else 2

    @property
    def _unit(self) -> Array:
        """(3,) the strut's direction, of unit length."""
        direction = np.asarray(self.direction)
        return np.asarray(direction / np.linalg.norm(direction))

    def _couplings(self, terms: list[Term], rows: list[Array], where: str) -> list[Term]:
        """Stiffness and damping between directions, J1' J2 + J2' J1, no more than some multiple of their
        start values.
        """
        result = []
        for one, other in combinations(range(len(rows)), 2):
            product = np.outer(rows[one], rows[other])
            unit, name = product + product.T, f"{self.link}.ground_{self.axes[one]}{self.axes[other]}"
            both = [
                self._coupling(f"{name}.{what}", terms[number::2], f"{where}.{what}")
                for number, what in enumerate(("stiffness", "damping"))
            ]
            result += [Term(both[0], stiffness=unit), Term(both[1], damping=unit)]
        return result

    def _coupling(self, name: str, along: list[Term], where: str) -> Parameter:
        """A stiffness or damping between directions; along: those of the directions themselves."""
        own = [term.parameter for term in along]
        reach = _REACH * max(p.initial for p in own)
        values = Values(initial=0.0, bounds=(-reach, reach))
        return parameter(name, own[0].unit, 0.0, values, where, log=False)
