"""A response channel reads too much or too little: a wrong sensitivity, a loose sensor."""

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
    OneChannel,
    Reading,
    find_channels,
    rows_of,
    single_channels,
)
from identify.model.effects.place import Place
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point


class ChannelGain(MeasurementEffect):
    """One factor on one response channel, or on all of a point."""

    kind: Literal["channel-gain"] = "channel-gain"
    channel: OneChannel
    gain: Values = Field(Values(initial=1.0, bounds=(0.1, 10.0)), description="recorded over true")

    def sentence(self) -> str:
        """For example: gain of channel 12:+Z."""
        return f"gain of channel {self.channel}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The three translations of every point."""
        return (cls(channel=channel) for channel in single_channels(points))

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """What it reads."""
        return [rows_of(self.channel, points, "effects.channel-gain.channel")]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The factor."""
        return [
            Term(
                single_parameter(
                    f"{self.channel}.gain", "1", self.gain, f"{where}.gain", default=1.0, log=True
                )
            )
        ]

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """A diagonal matrix."""
        numbers = find_channels(self.channel, channels, points, "effects.channel-gain.channel")
        unit = np.eye(len(numbers))

        def scaled(own: Array) -> Array:
            return own[..., None] * unit

        return Mixing(numbers, scaled, lambda own: unit[..., None])
