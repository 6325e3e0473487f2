"""A response channel upside down: a sensor or a cable the wrong way round."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np

from identify.measured.channel import Channel
from identify.model.effects.measurement import (
    MeasurementEffect,
    OneChannel,
    Reading,
    constant,
    find_channels,
    rows_of,
    single_channels,
)
from identify.model.effects.place import Place
from identify.robot.description import Robot
from identify.robot.points import Point


class ChannelPolarity(MeasurementEffect):
    """The sign of one response channel, or of all of a point."""

    kind: Literal["channel-polarity"] = "channel-polarity"
    channel: OneChannel

    def sentence(self) -> str:
        """For example: reversed polarity of channel 12:+Z."""
        return f"reversed polarity of channel {self.channel}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The three translations of every point."""
        return (cls(channel=channel) for channel in single_channels(points))

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """What it reads."""
        return [rows_of(self.channel, points, "effects.channel-polarity.channel")]

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """Minus one."""
        numbers = find_channels(self.channel, channels, points, "effects.channel-polarity.channel")
        return constant(numbers, -np.eye(len(numbers)))
