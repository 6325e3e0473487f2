"""Compliance between the floor and the base link: rocking (rx, ry), turning (rz), sliding (tx, ty), lifting
(tz).

Kobe (IJAT 15-5, 2021, section 4.2) suspects it behind amplitudes that come out too small.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

from pydantic import Field

from identify.model.effects.springs import Axis, AxisList, Springs
from identify.robot.description import Robot
from identify.robot.points import Point


class BaseCompliance(Springs):
    """Springs and dampers under the base link, on some of six axes of its frame."""

    kind: Literal["base-compliance"] = "base-compliance"
    axes: AxisList = Field(["rx", "ry"], min_length=1, description="axes released, in the base link's frame")

    def sentence(self) -> str:
        """For example: compliance of the base (rx, ry)."""
        return f"compliance of the base ({self.axes_told})"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Rocking, turning, sliding and lifting; nothing for a base whose inertia is not known, which cannot
        move.
        """
        if robot.links[0].mass == 0:
            return
        groups: tuple[tuple[Axis, ...], ...] = (("rx", "ry"), ("rz",), ("tx", "ty"), ("tz",))
        for axes in groups:
            yield cls(axes=list(axes))

    def free_coordinates(self, robot: Robot) -> list[str]:
        """base.rx and so on."""
        return [f"base.{axis}" for axis in self.axes]
