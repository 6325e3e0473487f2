"""The records behind the FRFs begin some time before the impact, as analysers with a pre-trigger have it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.parameters import Values, single_parameter
from identify.measured.channel import Channel
from identify.model.effects.base import Term
from identify.model.effects.measurement import MeasurementEffect, Reading, Unread
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point

PRE_TRIGGER = "records.pre_trigger"
"""Its parameter."""
_LATEST_S, _TIMES = 0.1, 26


def valleys(earliest: float = 0.0, latest: float = _LATEST_S) -> Array:
    """Times (26,), s, at which it is tried: what rings on beyond the records looks much the same a period
    earlier, so that each is a valley of its own.
    """
    return np.linspace(earliest, latest, _TIMES)


class PreTrigger(MeasurementEffect):
    """So much later the impact is, and so much less of the response is in the record, of which the lines
    know only the whole length.

    It shows where the response has not died out at the end of the record (`identify.model.truncation`), and
    only there.  The time is that of the middle of the impact.
    """

    kind: Literal["pre-trigger"] = "pre-trigger"
    time: Values = Field(
        Values(initial=0.005, bounds=(0.0, _LATEST_S)),
        description="from the beginning of the records to the middle of the impacts, s",
    )

    def sentence(self) -> str:
        """Records that begin before the impact."""
        return "records that begin before the impact"

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The time."""
        return [Term(single_parameter(PRE_TRIGGER, "s", self.time, f"{where}.time"))]

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """The same for all channels."""
        return _Early()


class _Early(Unread):
    def shortening(self) -> float:
        return 1.0
