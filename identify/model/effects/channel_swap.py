"""Two cables of one sensor exchanged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field, field_validator

from identify.measured.channel import Channel
from identify.model.effects.measurement import (
    MeasurementEffect,
    Reading,
    constant,
    find_channels,
    find_point,
    missing_axes,
    rows_of,
    turned,
)
from identify.model.effects.place import Place
from identify.robot.description import Robot
from identify.robot.points import Point

_PAIRS: tuple[tuple[Literal["x", "y", "z"], Literal["x", "y", "z"]], ...] = (
    ("x", "y"),
    ("y", "z"),
    ("x", "z"),
)


class ChannelSwap(MeasurementEffect):
    """Each of two axes of a point's sensor is recorded under the other's name."""

    kind: Literal["channel-swap"] = "channel-swap"
    point: str | int = Field(description="node number or name")
    axes: tuple[Literal["x", "y", "z"], Literal["x", "y", "z"]] = Field(
        description="the two axes, such as [x, y]"
    )

    @field_validator("axes")
    @classmethod
    def _different(cls, axes: tuple[str, str]) -> tuple[str, str]:
        if axes[0] == axes[1]:
            raise ValueError("expected two different axes")
        return axes

    def sentence(self) -> str:
        """For example: axes x and y of point 12 exchanged."""
        return f"axes {self.axes[0]} and {self.axes[1]} of point {self.point} exchanged"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The three pairs of every point."""
        for node in points:
            for axes in _PAIRS:
                yield cls(point=node, axes=axes)

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """The axes of its point."""
        return [rows_of(self.point, points, "effects.channel-swap.point")]

    def _numbers(self) -> tuple[int, int]:
        return "xyz".index(self.axes[0]), "xyz".index(self.axes[1])

    def needed(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> tuple[Channel, ...]:
        """The other axis, where only one was recorded."""
        return missing_axes(
            find_point(self.point, points, "effects.channel-swap.point").node, channels, self._numbers()
        )

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """A permutation of axes."""
        first, second = self._numbers()
        order = np.arange(3)
        order[[first, second]] = second, first
        numbers = find_channels(self.point, channels, points, "effects.channel-swap.point")
        return constant(numbers, turned(channels, numbers, np.eye(3)[order]))
