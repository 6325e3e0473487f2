"""A sensor mounted askew: turned about one of its axes against what the points file says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.parameters import Values, single_parameter
from identify.measured.channel import Channel
from identify.model.effects.base import Term
from identify.model.effects.measurement import (
    MeasurementEffect,
    Mixing,
    Reading,
    find_channels,
    find_point,
    missing_axes,
    rows_of,
    turned,
)
from identify.model.effects.place import Place
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point

_AXES: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")


class SensorRotation(MeasurementEffect):
    """All axes of a point's sensor are turned by one angle, right-handed, about one of them."""

    kind: Literal["sensor-rotation"] = "sensor-rotation"
    point: str | int = Field(description="node number or name")
    axis: Literal["x", "y", "z"] = Field(description="axis of the sensor that it is turned about")
    angle: Values = Field(Values(initial=0.0, bounds=(-np.pi, np.pi)), description="rad")

    def sentence(self) -> str:
        """For example: sensor at point 12 turned about its z axis."""
        return f"sensor at point {self.point} turned about its {self.axis} axis"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Each axis of every point."""
        for node in points:
            for axis in _AXES:
                yield cls(point=node, axis=axis)

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """The axes of its point."""
        return [rows_of(self.point, points, "effects.sensor-rotation.point")]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The angle."""
        return [
            Term(single_parameter(f"{self.point}.r{self.axis}.angle", "rad", self.angle, f"{where}.angle"))
        ]

    def needed(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> tuple[Channel, ...]:
        """The sensor's axes that were not recorded."""
        return missing_axes(
            find_point(self.point, points, "effects.sensor-rotation.point").node, channels, (0, 1, 2)
        )

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """A turned axis a reads (R e_a) . v, R the rotation: the transpose of R on the old readings."""
        numbers = find_channels(self.point, channels, points, "effects.sensor-rotation.point")
        axis = np.eye(3)["xyz".index(self.axis)]
        across = np.cross(
            axis, np.eye(3)
        )  # rows axis x e_b: the transpose of the matrix of the cross product
        along = np.outer(axis, axis)
        constant, cosine, sine = (
            turned(channels, numbers, part) for part in (along, np.eye(3) - along, across)
        )

        def matrix(own: Array) -> Array:
            angle = own[..., None]
            return np.asarray(constant + np.cos(angle) * cosine + np.sin(angle) * sine)

        def slope(own: Array) -> Array:
            return np.asarray((np.cos(own) * sine - np.sin(own) * cosine)[..., None])

        return Mixing(numbers, matrix, slope)
