"""What is fixed to a point of a link: the common part of added masses, resonators and springs to the
ground.
"""

from __future__ import annotations

from abc import ABC
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.model.effects.base import Effect
from identify.model.effects.place import Attachment, Place
from identify.robot.description import Robot


class Attached(Effect, ABC):
    """An effect at one point of a link."""

    link: str = Field(description="link or frame that carries it")
    at_m: tuple[float, float, float] | None = Field(
        None, description="position in the link's frame; default: the link's centre of mass"
    )

    @property
    def where(self) -> str:
        """Place in the config, for errors about the link."""
        return f"effects.{self.kind}.link"

    def position(self, robot: Robot) -> Array:
        """(3,) in the link's frame; default: its centre of mass, or the origin of a further frame."""
        if self.at_m is not None:
            return np.asarray(self.at_m)
        return np.zeros(3) if self.link in robot.frames else robot.link(self.link, self.where).centre

    def attachment(
        self, robot: Robot, frame: Literal["link", "base"], along: tuple[float, float, float] | None = None
    ) -> Place:
        """Forces at its point; along: of one, its direction."""
        x, y, z = (float(value) for value in self.position(robot))
        return Attachment(self.link, (x, y, z), ("x", "y", "z"), frame, along=along)

    def body_places(self, robot: Robot, extent: str) -> list[Place]:
        """Forces at its point, and of a body forces and moments."""
        x, y, z = (float(value) for value in self.position(robot))
        every = Attachment(self.link, (x, y, z), ("x", "y", "z", "rx", "ry", "rz"))
        return [self.attachment(robot, "link"), *([every] if extent == "body" else [])]

    def carried(self, robot: Robot) -> float:
        """Mass of the link and of all links beyond it, kg, which scales defaults."""
        link = robot.frames[self.link][0] if self.link in robot.frames else self.link
        first = robot.links.index(robot.link(link, self.where))
        return sum(other.mass for other in robot.links[first:])
