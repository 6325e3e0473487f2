"""Effects whose share in the motion depends on its amplitude: torques at joints that are no linear function
of what the joint does.

They change no matrix.  The model simulates the hammer impact with the torque as feedback
(`identify.model.transient`), so the FRFs depend on how hard it was: each measurement must say its `impact`,
and only force levels that differ can tell such an effect from a linear one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal, Self

from pydantic import Field

from identify.model.effects.base import Effect
from identify.model.effects.springs import Joints, joint_coordinates
from identify.robot.description import Robot
from identify.robot.points import Point


class NonlinearEffect(Effect):
    """A torque law at some joint axes that a compliance frees; a subclass brings the law and its terms."""

    needs_levels: ClassVar[bool] = True
    of_amplitude: ClassVar[bool] = True
    joints: Joints = Field("all", description="`all`, or joint numbers (from 1) or names")
    axes: list[Literal["rx", "ry", "rz"]] = Field(
        ["rz"], min_length=1, description="axes at each joint, which a compliance must free"
    )

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The drive of every joint."""
        for number in range(1, len(robot.joints) + 1):
            yield cls.model_validate({"kind": cls.model_fields["kind"].default, "joints": [number]})

    def coordinates(self, robot: Robot) -> list[str]:
        """joint1.rz and so on: where the law acts; its terms are in this order."""
        return joint_coordinates(robot, self.joints, list(self.axes), f"effects.{self.kind}.joints")

    def which(self) -> str:
        """For example: joints 2, 3 (rz)."""
        joints = (
            "all joints"
            if self.joints == "all"
            else f"joint{'s' if len(self.joints) > 1 else ''} {', '.join(map(str, self.joints))}"
        )
        return f"{joints} ({', '.join(self.axes)})"
