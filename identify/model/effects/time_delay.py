"""All responses come late by the same time: a filter or an amplifier in the response channels that the force
channel lacks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Complex
from identify.core.parameters import Values, single_parameter
from identify.measured.channel import Channel
from identify.model.effects.base import Term
from identify.model.effects.measurement import MeasurementEffect, Reading
from identify.model.effects.place import Column, Place
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point


class TimeDelay(MeasurementEffect):
    """H is read as H e^(-s tau), where s has the true decay of the window; tau is negative where the force
    comes late.
    """

    kind: Literal["time-delay"] = "time-delay"
    delay: Values = Field(Values(initial=0.0, bounds=(-5e-3, 5e-3)), description="s")

    def sentence(self) -> str:
        """Time delay of all responses."""
        return "time delay of all responses"

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """All FRFs."""
        return [Column()]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The delay."""
        return [Term(single_parameter("responses.delay", "s", self.delay, f"{where}.delay"))]

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """The same for all channels."""
        return _Late()


@dataclass(frozen=True)
class _Late(Reading):
    def apply(self, h: Complex, own: Array, s: Complex) -> Complex:
        return np.asarray(h * np.exp(-s * own)[..., None, None])

    def slopes(self, h: Complex, own: Array, s: Complex) -> Complex:
        return np.asarray(-s[:, None, None, None] * self.apply(h, own, s)[..., None])

    def along_s(self, h: Complex, own: Array, s: Complex) -> Complex:
        return np.asarray(-own * self.apply(h, own, s))
