"""A sensor that reads any combination of its axes: wrong or exchanged sensitivities, polarity, a turned
cube, cross-axis sensitivity, all at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Complex, Index
from identify.core.parameters import Values, single_parameter
from identify.measured.channel import Channel
from identify.model.effects.base import Term
from identify.model.effects.measurement import (
    MeasurementEffect,
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

_WHERE = "effects.sensor-matrix.points"


class SensorMatrix(MeasurementEffect):
    """What is recorded is (I + E) v, with v the motion in the sensor's nominal axes and E (3, 3) free.

    E = 0 is a sensor as stated, E = I one that reads twice as much; that of a turned or exchanged one is
    its rotation or permutation less I.
    """

    kind: Literal["sensor-matrix"] = "sensor-matrix"
    points: list[str | int] = Field(min_length=1, description="node numbers or names")
    error: Values = Field(
        Values(initial=0.0, bounds=(-20.0, 20.0)), description="each of the nine entries of E"
    )

    def sentence(self) -> str:
        """For example: sensitivity matrix of the sensor at point 12."""
        many = "sensor at point" if len(self.points) == 1 else "sensors at points"
        return f"sensitivity matrix of the {many} {', '.join(map(str, self.points))}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every point."""
        return (cls(points=[node]) for node in points)

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """The axes of its point."""
        return [rows_of(point, points, _WHERE) for point in self.points]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The entries of E, row by row: xx, xy, xz, yx and so on."""
        return [
            Term(single_parameter(f"{point}.matrix_{a}{b}", "1", self.error, f"{where}.error"))
            for point in self.points
            for a in "xyz"
            for b in "xyz"
        ]

    def needed(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> tuple[Channel, ...]:
        """The sensors' axes that were not recorded."""
        nodes = [find_point(point, points, _WHERE).node for point in self.points]
        return tuple(more for node in nodes for more in missing_axes(node, channels, (0, 1, 2)))

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """Linear in E."""
        units, own = np.eye(9).reshape(9, 3, 3), []
        for point in self.points:
            numbers = find_channels(point, channels, points, _WHERE)
            own.append((numbers, np.stack([turned(channels, numbers, unit) for unit in units], axis=-1)))
        return _Mixed(tuple(own))


@dataclass(frozen=True, eq=False)
class _Mixed(Reading):
    """sensors: for each the numbers (r,) of its channels, and what its entries change in them (r, r, 9)."""

    sensors: tuple[tuple[Index, Array], ...]

    def apply(self, h: Complex, own: Array, s: Complex) -> Complex:
        mixed = h.copy()
        for (numbers, slopes), entries in zip(
            self.sensors, np.split(own, len(self.sensors), axis=-1), strict=True
        ):
            error = np.tensordot(entries, slopes, axes=([-1], [2]))
            mixed[..., numbers, :] += error[..., None, :, :] @ h[..., numbers, :]
        return mixed

    def slopes(self, h: Complex, own: Array, s: Complex) -> Complex:
        found = np.zeros((*h.shape, own.size), dtype=complex)
        for sensor, (numbers, slopes) in enumerate(self.sensors):
            moved = np.einsum("abk,lbi->laik", slopes, h[:, numbers], optimize=True)
            found[:, numbers, :, 9 * sensor : 9 * sensor + 9] = moved
        return found
