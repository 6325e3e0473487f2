"""A mass that the robot description lacks or states wrongly: a gripper, a cable package, a payload."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations_with_replacement
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.effects.attached import Attached
from identify.effects.base import Contribution, Parameter, Values
from identify.effects.site import Array, Site
from identify.effects.springs import parameter, spread
from identify.robot.description import Robot
from identify.robot.points import Point

_PAIRS = tuple(combinations_with_replacement(range(3), 2))
_REACH = {"moment": 0.05, "second_moment": 0.01}
"""Default bounds per mass of the whole arm, m and m^2: a twentieth of it on a lever of 1 m, a quarter of it on one of 0.2 m."""


class AddedMass(Attached):
    """A point mass at a place that is known, or a rigid body whose centre and inertia are identified too; both with their weight.

    A body adds, about `at_m`, its first moments int r dm (its centre is `at_m` + moment / mass) and its second moments int r r' dm,
    in which its inertia matrix is linear.  Bounds below zero let it correct what is stated too large; nothing else keeps it physical.
    """

    kind: Literal["added-mass"] = "added-mass"
    extent: Literal["point", "body"] = Field("point", description="`body`: ten parameters, with centre and inertia, in place of one")
    mass: Values = Field(Values(initial=1.0, bounds=(0.0, 100.0)), description="kg")
    moment: Values = Field(Values(initial=0.0), description="first moments x, y, z, kg m; default bounds from the arm's mass")
    second_moment: Values = Field(Values(initial=0.0), description="second moments xx, xy, xz, yy, yz, zz, kg m^2; default bounds likewise")

    def sentence(self) -> str:
        """For example: added mass on link6."""
        return f"added {'mass' if self.extent == 'point' else 'body (mass, centre, inertia)'} on {self.link}"

    @classmethod
    def places(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """A body on every moving link, because where a mass sits is not known beforehand."""
        for link in robot.links[1:]:
            yield cls(link=link.name, extent="body")

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """The mass; of a body then the moments."""
        initial = float(spread(self.mass, np.ones(1), f"{where}.mass")[0])
        result = [parameter(f"{self.link}.mass", "kg", initial, self.mass, f"{where}.mass", log=False)]
        if self.extent == "point":
            return result
        arm = sum(link.mass for link in robot.links)
        seconds = ["xyz"[i] + "xyz"[j] for i, j in _PAIRS]
        for what, axes, unit in (("moment", ["x", "y", "z"], "kg m"), ("second_moment", seconds, "kg m^2")):
            values: Values = getattr(self, what)
            values = values if values.bounds else values.model_copy(update={"bounds": (-_REACH[what] * arm, _REACH[what] * arm)})
            starts = spread(values, np.zeros(len(axes)), f"{where}.{what}")
            names = [f"{self.link}.{what}_{axis}" for axis in axes]
            result += [parameter(n, unit, start, values, f"{where}.{what}", log=False) for n, start in zip(names, starts, strict=True)]
        return result

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """Inertia and gravity stiffness per unit of each parameter; the inertia is int (v + w x r)^2 dm, sorted by powers of r."""
        point = self.position(robot)
        jacobian = site.jacobian(self.link, point, self.where)
        here = site.weight_stiffness(self.link, point, self.where)
        v = jacobian[:3]
        result = [Contribution(mass=v.T @ v, stiffness=here)]
        if self.extent == "point":
            return result
        turning = [np.cross(jacobian[3:].T, axis).T for axis in np.eye(3)]  # w x r for r along each axis
        for axis, moved in zip(np.eye(3), turning, strict=True):
            there = site.weight_stiffness(self.link, point + axis, self.where)
            result.append(Contribution(mass=_twice(v, moved), stiffness=there - here))
        return result + [Contribution(mass=_twice(turning[i], turning[j]) / (2 if i == j else 1)) for i, j in _PAIRS]


def _twice(a: Array, b: Array) -> Array:
    """a' b + b' a, (n, n)."""
    product = a.T @ b
    return product + product.T
