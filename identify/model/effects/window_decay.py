"""The exponential window on force and response decays faster or slower than stated, or was forgotten in the
statement.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from identify.core.parameters import Values, single_parameter
from identify.measured.channel import Channel
from identify.model.effects.base import Term
from identify.model.effects.measurement import MeasurementEffect, Reading, Unread
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point


class WindowDecay(MeasurementEffect):
    """The FRFs sample H at s = sigma + delta + j omega, with sigma the stated decay; to first order it looks
    like damping everywhere.
    """

    kind: Literal["window-decay"] = "window-decay"
    error: Values = Field(
        Values(initial=0.0, bounds=(-10.0, 10.0)), description="delta: true less stated decay, 1/s"
    )

    def sentence(self) -> str:
        """Window decay other than stated."""
        return "decay of the exponential window other than stated"

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """True less stated decay."""
        return [Term(single_parameter("window.decay_error", "1/s", self.error, f"{where}.error"))]

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """The same for all channels."""
        return _Elsewhere()


class _Elsewhere(Unread):
    def decay(self) -> float:
        return 1.0
