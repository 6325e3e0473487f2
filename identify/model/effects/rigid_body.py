"""A mass fixed to a link: a point, or a rigid body in whose moments its inertia is linear."""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import Literal

import numpy as np
from pydantic import BaseModel, Field

from identify.core.arrays import Array, cross
from identify.core.parameters import Parameter, Values, parameter, spread
from identify.model.effects.base import Term
from identify.model.effects.site import Site
from identify.robot.description import Robot

_PAIRS = tuple(combinations_with_replacement(range(3), 2))
MOMENTS = (
    "mass",
    *(f"moment_{x}" for x in "xyz"),
    *(f"second_moment_{'xyz'[i]}{'xyz'[j]}" for i, j in _PAIRS),
)
"""What the inertia of a rigid body is linear in."""
REACH = {"moment": 0.05, "second_moment": 0.01}
"""Default bounds per mass of the whole arm, m and m^2: a twentieth of it on a lever of 1 m, a quarter of it
on one of 0.2 m.
"""


class RigidBody(BaseModel):
    """A point mass at a place that is known, or a rigid body whose centre and inertia are identified too;
    both with their weight.

    A body adds, about `at_m`, its first moments int r dm (its centre is `at_m` + moment / mass) and its
    second moments int r r' dm, in which its inertia matrix is linear.  Bounds below zero let it correct what
    is stated too large; nothing else keeps it physical.
    """

    extent: Literal["point", "body"] = Field(
        "point", description="`body`: nine more parameters, for centre and inertia"
    )
    mass: Values = Field(Values(), description="kg")
    moment: Values = Field(
        Values(initial=0.0), description="first moments x, y, z, kg m; default bounds from the arm's mass"
    )
    second_moment: Values = Field(
        Values(initial=0.0),
        description="second moments xx, xy, xz, yy, yz, zz, kg m^2; default bounds likewise",
    )

    def masses(
        self, robot: Robot, site: Site, frame: str, point: Array, own: Array, mass: Parameter, where: str
    ) -> list[Term]:
        """The mass, and of a body its moments, at a point (3,) of a frame: inertia and gravity stiffness.

        own (3, n): motion of the mass against the link, in the link's axes.  The inertia is int (v + w x r)^2
        dm, sorted by powers of r. The weight's potential -g . (point + own q) couples own motion and rotation
        w: its mixed derivative is -w . (own x g).
        """
        key = f"{where}.link"
        jacobian, here = site.jacobian(frame, point, key), site.weight_stiffness(frame, point, key)
        v, coupling = jacobian[:3] + own, _twice(jacobian[3:], cross(own.T, site.gravity(frame)).T)
        first = Term(mass, mass=v.T @ v, stiffness=here - coupling)
        if self.extent == "point":
            return [first]
        there = [site.weight_stiffness(frame, point + axis, key) - here for axis in np.eye(3)]
        weights = [*there, *(None for _ in _PAIRS)]
        moments = self._moments(robot, mass.name.removesuffix(".mass"), where)
        inertias = rigid_body(v, jacobian[3:])[1:]
        return [
            first,
            *(Term(p, mass=m, stiffness=k) for p, m, k in zip(moments, inertias, weights, strict=True)),
        ]

    def _moments(self, robot: Robot, name: str, where: str) -> list[Parameter]:
        """First and second moments."""
        result, arm = [], sum(link.mass for link in robot.links)
        seconds = ["xyz"[i] + "xyz"[j] for i, j in _PAIRS]
        for what, axes, unit in (("moment", ["x", "y", "z"], "kg m"), ("second_moment", seconds, "kg m^2")):
            values: Values = getattr(self, what)
            values = (
                values
                if values.bounds
                else values.model_copy(update={"bounds": (-REACH[what] * arm, REACH[what] * arm)})
            )
            starts = spread(values, np.zeros(len(axes)), f"{where}.{what}")
            names = [f"{name}.{what}_{axis}" for axis in axes]
            result += [
                parameter(n, unit, start, values, f"{where}.{what}", log=False)
                for n, start in zip(names, starts, strict=True)
            ]
        return result


def rigid_body(v: Array, w: Array) -> list[Array]:
    """Inertia (n, n) per unit of a body's mass, first moments x, y, z and second moments xx, xy, xz, yy, yz,
    zz about a point.

    v, w (3, n): velocity and angular velocity of the body at that point for unit speeds.
    """
    turning = [cross(w.T, axis).T for axis in np.eye(3)]  # w x r for r along each axis
    seconds = [_twice(turning[i], turning[j]) / (2 if i == j else 1) for i, j in _PAIRS]
    return [v.T @ v, *(_twice(v, moved) for moved in turning), *seconds]


def _twice(a: Array, b: Array) -> Array:
    """a' b + b' a, (n, n)."""
    product = a.T @ b
    return product + product.T
