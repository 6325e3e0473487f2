"""Effects whose share in the motion depends on its amplitude: torques at joints that are no linear function
of what the joint does.

They change no matrix.  The model simulates the blow of the hammer with the torque as feedback
(`identify.model.transient`), so the FRFs depend on how hard it was: each measurement must say its `impact`,
and only force levels that differ can tell such an effect from a linear one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from identify.core.arrays import Array
from identify.core.parameters import Parameter
from identify.model.effects.base import Contribution, Effect
from identify.model.effects.site import Site
from identify.model.effects.springs import Joints, joint_coordinates
from identify.robot.description import Robot
from identify.robot.points import Point


class Law(ABC):
    """A torque T = f(p) against the motion, p being a sum of the joint's angle, rate and acceleration.

    own (k, ...) are the values of the law's k parameters, positive; `count` is k.
    """

    count: ClassVar[int]

    @abstractmethod
    def probe(self, own: Array) -> Array:
        """(3, ...): the shares of angle (rad), rate (rad/s) and acceleration (rad/s^2) in p."""

    @abstractmethod
    def torque(self, free: Array, compliance: Array, own: Array) -> Array:
        """T (...), N m, that solves T = f(free - compliance T): free (...) is p without T, compliance (...)
        what a unit of T takes off.
        """


@dataclass(frozen=True)
class PlacedLaw:
    """A law that acts on a coordinate, and the numbers of its parameters."""

    law: Law
    coordinate: str
    numbers: NDArray[np.intp]


class NonlinearEffect(Effect):
    """A law at some joint axes that a compliance releases; a subclass brings the law and its parameters."""

    needs_levels: ClassVar[bool] = True
    law: ClassVar[Law]
    joints: Joints = Field("all", description="`all`, or joint numbers (from 1) or names")
    axes: list[Literal["rx", "ry", "rz"]] = Field(
        ["rz"], min_length=1, description="axes at each joint, which a compliance must release"
    )

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The drive of every joint."""
        for number in range(1, len(robot.joints) + 1):
            yield cls.model_validate({"kind": cls.model_fields["kind"].default, "joints": [number]})

    def coordinates(self, robot: Robot) -> list[str]:
        """joint1.rz and so on: where the law acts; its parameters are in this order."""
        return joint_coordinates(robot, self.joints, list(self.axes), f"effects.{self.kind}.joints")

    def which(self) -> str:
        """For example: joints 2, 3 (rz)."""
        joints = (
            "all joints"
            if self.joints == "all"
            else f"joint{'s' if len(self.joints) > 1 else ''} {', '.join(map(str, self.joints))}"
        )
        return f"{joints} ({', '.join(self.axes)})"

    def free_coordinates(self, robot: Robot) -> list[str]:
        """None: without a spring it is no bearing."""
        return []

    @abstractmethod
    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """Those of the law, coordinate by coordinate."""

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """Nothing, once per parameter."""
        return [Contribution()] * (self.law.count * len(self.coordinates(robot)))

    def placed(self, robot: Robot, numbers: NDArray[np.intp]) -> list[PlacedLaw]:
        """The law at every coordinate; numbers are those of all parameters of the effect."""
        names = self.coordinates(robot)
        return [
            PlacedLaw(self.law, name, own)
            for name, own in zip(names, np.split(numbers, len(names)), strict=True)
        ]
