"""A load cell between the last link and what hangs on it: a spindle that moves against the robot on the
cell's own springs.

Fast chirp (Fig. 2 and section III.A) sees it as a discrepancy between the force that acts on the tool and the
one that the robot feels.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import DampingValues, Values, parameter, spread
from identify.model.effects.base import Effect, Term
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import spring_terms
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

_START_HZ = 60.0
"""Without a start value what hangs on the cell resonates here: above what was measured, below what would not
matter.
"""
_SHARE = (0.05, 0.5, 0.98)
"""Without values, what hangs beyond is half of the last link's mass, and this share of it at least and at
most.
"""


class LoadCell(Effect):
    """Three springs and dampers across the last link: what is beyond a plane across the last joint's axis
    slides along the link's x, y, z.

    Points beyond the plane, where forces act or sensors sit, go with it, and so does a mass that the link's
    inertia contains already. It moves without turning: cells are stiff against moments.
    """

    kind: Literal["load-cell"] = "load-cell"
    link: str = Field(description="the last link")
    at_m: float = Field(
        description="where the plane is, along the last joint's axis from the joint's origin, m"
    )
    mass: Values = Field(
        Values(),
        description=(
            "kg that hang beyond it; `fixed: true` where it was weighed; default start: half of the link"
        ),
    )
    centre_m: tuple[float, float, float] | None = Field(
        None,
        description=(
            "its centre of mass in the link's frame, which may lie anywhere; default: half way to the"
            " farthest point beyond"
        ),
    )
    stiffness: Values = Field(Values(), description="N/m along x, y, z; default start: 60 Hz with that mass")
    damping: DampingValues = Field(DampingValues(), description="N s/m along x, y, z")

    def sentence(self) -> str:
        """For example: flexible load cell on link6, 0.120 m from its joint."""
        return f"flexible load cell on {self.link}, {self.at_m:.3f} m from its joint"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Half way between neighbours among the last joint's origin and the measurement points of the last
        link, as seen along its axis.
        """
        last = robot.links[-1].name
        own = [_height(robot, point.position) for point in points.values() if point.link == last]
        heights = np.unique(np.round([0.0, *(height for height in own if height > 1e-3)], 4))
        for low, high in pairwise(heights):
            yield cls(link=last, at_m=round(float(low + high) / 2, 4))

    @property
    def _names(self) -> list[str]:
        return [f"{self.link}.cell_{axis}" for axis in "xyz"]

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """What is beyond the plane along x, y, z of the link."""
        if robot.link(self.link, "effects.load-cell.link") is not robot.links[-1]:
            raise InputError(
                "effects.load-cell.link",
                f"{self.link} carries a further joint",
                f"the last link, {robot.links[-1].name}",
            )
        return [
            Added(name, self.link, deformation=partial(self._slides, robot, axis))
            for name, axis in zip(self._names, np.eye(3), strict=True)
        ]

    def _slides(self, robot: Robot, axis: Array, point: Array) -> Array:
        """Displacement and rotation (6,) of a point (3,) by a unit along an axis (3,)."""
        return np.concatenate([axis * (_height(robot, point) > self.at_m), np.zeros(3)])

    def free_coordinates(self, robot: Robot) -> list[str]:
        """All three."""
        return self._names

    def _centre(self, robot: Robot, site: Site) -> Array:
        if self.centre_m is not None:
            return np.asarray(self.centre_m)
        origin, axis = _axis(robot)
        beyond = [_height(robot, p.position) for p in site.points.values() if p.link == self.link]
        farthest = max([height for height in beyond if height > self.at_m], default=self.at_m + 0.2)
        return np.asarray(origin + (self.at_m + farthest) / 2 * axis)

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """Per kg beyond the plane, the inertia of what slides less that of the same on the rigid link; then
        stiffness and damping along x, y, z.
        """
        whole = robot.links[-1].mass
        values = (
            self.mass
            if self.mass.bounds
            else self.mass.model_copy(update={"bounds": (_SHARE[0] * whole, _SHARE[2] * whole)})
        )
        start = spread(values, np.array([_SHARE[1] * whole]), f"{where}.mass")
        mass = parameter(f"{self.link}.cell.mass", "kg", float(start[0]), values, f"{where}.mass")
        places = [(name, "N/m", site.unit(name)) for name in self._names]
        keys = f"{where}.stiffness", f"{where}.damping"
        springs = spring_terms(places, np.repeat(start, 3), self.stiffness, self.damping, keys, _START_HZ)
        return [Term(mass, mass=self._inertia(robot, site)), *springs]

    def _inertia(self, robot: Robot, site: Site) -> Array:
        """(n, n) per kg that slides."""
        rigid = site.jacobian(self.link, self._centre(robot, site), "effects.load-cell")[:3]
        moving = rigid.copy()
        if self.link not in site.detached:
            own = [site.number(name) for name in self._names]
            rigid[:, own], moving[:, own] = 0.0, np.eye(3)
        return np.asarray(moving.T @ moving - rigid.T @ rigid)


def _axis(robot: Robot) -> tuple[Array, Array]:
    """Origin (3,) and unit axis (3,) of the last joint in the last link's frame."""
    mount = robot.joints[-1].mount
    return -mount[:3, :3].T @ mount[:3, 3], mount[:3, :3].T @ robot.joints[-1].axis


def _height(robot: Robot, point: Array) -> float:
    """How far along the last joint's axis a point (3,) of the last link is, m."""
    origin, axis = _axis(robot)
    return float((point - origin) @ axis)
