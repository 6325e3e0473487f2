"""All FRFs, or those of one force, are too large or too small by one factor: a wrong sensitivity of the
hammer, g taken for m/s^2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, Self

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


class FrfGain(MeasurementEffect):
    """One factor on all FRFs, or on those of one force."""

    kind: Literal["frf-gain"] = "frf-gain"
    force: str | None = Field(
        None, description="force channel such as 12:+X, whichever its sign; default: all"
    )
    gain: Values = Field(Values(initial=1.0, bounds=(1e-5, 1e5)), description="recorded over true")

    def sentence(self) -> str:
        """For example: gain of the FRFs of force 12:+X."""
        return "gain of all FRFs" if self.force is None else f"gain of the FRFs of force {self.force}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Of all FRFs."""
        yield cls()

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """The force, or all FRFs."""
        return [Column(self.force or "")]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The factor."""
        name = "frf.gain" if self.force is None else f"force.{self.force}.gain"
        return [Term(single_parameter(name, "1", self.gain, f"{where}.gain", default=1.0, log=True))]

    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """A factor of all FRFs."""
        return _Scaled(None)

    def reading_of(
        self, channels: tuple[Channel, ...], inputs: tuple[Channel, ...], points: Mapping[int, Point]
    ) -> Reading:
        """A factor of the columns of its force."""
        if self.force is None:
            return _Scaled(None)
        wanted = Channel.parse(self.force, "effects.frf-gain.force")
        own = [(c.node, abs(c.direction)) == (wanted.node, abs(wanted.direction)) for c in inputs]
        return _Scaled(np.array(own, dtype=float))


@dataclass(frozen=True, eq=False)
class _Scaled(Reading):
    """columns (inputs,): 1 where the factor acts; None: everywhere."""

    columns: Array | None

    def apply(self, h: Complex, own: Array, s: Complex) -> Complex:
        factor = own[..., None, None]
        if self.columns is None:
            return np.asarray(h * factor)
        columns = np.repeat(self.columns, h.shape[-1] // len(self.columns))  # several changes of each input
        return np.asarray(h * (1 + (factor - 1) * columns))

    def slopes(self, h: Complex, own: Array, s: Complex) -> Complex:
        moved = h if self.columns is None else h * self.columns
        return np.asarray(moved[..., None])
