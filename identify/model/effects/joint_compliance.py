"""Compliance of joints: drive torsion (rz), bearing tilt (rx, ry), radial (tx, ty) and axial (tz) springs
with dampers in parallel.

UMONS (ICSV25 2018, section 3) uses rz; fast chirp (Eq. 3) adds rx and ry; Kobe (IJAT 15-5, 2021, Fig. 6) all
six.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

from pydantic import Field

from identify.model.effects.springs import Axis, AxisList, Joints, Springs, joint_coordinates
from identify.robot.description import Robot
from identify.robot.points import Point

CLASSES: dict[str, tuple[Axis, ...]] = {
    "drive": ("rz",),
    "tilt": ("rx", "ry"),
    "radial": ("tx", "ty"),
    "axial": ("tz",),
}
"""Axes of a joint by what carries them: the gear, or the bearing in bending, across and along."""


class JointCompliance(Springs):
    """Springs and dampers between the two links of joints, on some of six axes; z is the joint's own axis."""

    kind: Literal["joint-compliance"] = "joint-compliance"
    joints: Joints = Field("all", description="`all`, or joint numbers (from 1) or names")
    axes: AxisList = Field(["rz"], min_length=1, description="axes released at each joint")

    def sentence(self) -> str:
        """For example: tilt compliance of joint 2 (rx, ry)."""
        what = next((f"{name} " for name, axes in CLASSES.items() if set(self.axes) <= set(axes)), "")
        if self.joints == "all":
            return f"{what}compliance of all joints ({self.axes_told})"
        joints = "joint" if len(self.joints) == 1 else "joints"
        return f"{what}compliance of {joints} {', '.join(map(str, self.joints))} ({self.axes_told})"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every class of axes at every joint."""
        for number in range(1, len(robot.joints) + 1):
            for axes in CLASSES.values():
                yield cls(joints=[number], axes=list(axes))

    def free_coordinates(self, robot: Robot) -> list[str]:
        """joint1.rz and so on, joint by joint."""
        return joint_coordinates(robot, self.joints, self.axes, "effects.joint-compliance.joints")
