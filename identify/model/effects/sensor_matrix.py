"""A sensor that reads any combination of its axes: wrong or exchanged sensitivities, polarity, a turned cube, cross-axis
sensitivity, all at once.
"""

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


class SensorMatrix(MeasurementEffect):
    """What is recorded is (I + E) v, with v the motion in the sensor's nominal axes and E (3, 3) free.

    E = 0 is a sensor as stated, E = I one that reads twice as much; that of a turned or exchanged one is its rotation or
    permutation less I.
    """

    kind: Literal["sensor-matrix"] = "sensor-matrix"
    point: str | int = Field(description="node number or name")
    error: Values = Field(Values(initial=0.0, bounds=(-20.0, 20.0)), description="each of the nine entries of E")

    def sentence(self) -> str:
        """For example: sensitivity matrix of the sensor at point 12."""
        return f"sensitivity matrix of the sensor at point {self.point}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every point."""
        return (cls(point=node) for node in points)

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """The axes of its point."""
        return [rows_of(self.point, points, "effects.sensor-matrix.point")]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The entries of E, row by row: xx, xy, xz, yx and so on."""
        return [
            Term(single_parameter(f"{self.point}.matrix_{a}{b}", "1", self.error, f"{where}.error"))
            for a in "xyz"
            for b in "xyz"
        ]

    def needed(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> tuple[Channel, ...]:
        """The sensor's axes that were not recorded."""
        return missing_axes(find_point(self.point, points, "effects.sensor-matrix.point").node, channels, (0, 1, 2))

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """Linear in E."""
        numbers = find_channels(self.point, channels, points, "effects.sensor-matrix.point")
        units = np.eye(9).reshape(9, 3, 3)
        slopes = np.stack([turned(channels, numbers, unit) for unit in units], axis=-1)

        def matrix(own: Array) -> Array:
            return np.asarray(np.eye(len(numbers)) + np.tensordot(own, slopes, axes=([-1], [2])))

        return Mixing(numbers, matrix, lambda own: slopes)
