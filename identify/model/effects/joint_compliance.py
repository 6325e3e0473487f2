"""Compliance of joints: drive torsion (rz), bearing tilt (rx, ry), radial (tx, ty) and axial (tz) springs
with dampers in parallel.

UMONS (ICSV25 2018, section 3) uses rz; fast chirp (Eq. 3) adds rx and ry; Kobe (IJAT 15-5, 2021, Fig. 6) all
six.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal, Self

from pydantic import Field

from identify.model.effects.site import Added
from identify.model.effects.springs import Axis, AxisList, Joints, Springs, joint_coordinates
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

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
    at_m: float | None = Field(
        None,
        allow_inf_nan=False,
        description=(
            "where along the joint's axis, z of its frame, the springs of the bearing act, m; default: where"
            " another effect says so, else at the origin of the frame"
        ),
    )

    _where: ClassVar[str] = "effects.joint-compliance.joints"

    def sentence(self) -> str:
        """For example: tilt compliance of joint 2 (rx, ry), 0.100 m along its axis."""
        what = next((f"{name} " for name, axes in CLASSES.items() if set(self.axes) <= set(axes)), "")
        if self.joints == "all":
            return f"{what}compliance of all joints ({self.axes_told}){self._told}"
        joints = "joint" if len(self.joints) == 1 else "joints"
        return (
            f"{what}compliance of {joints} {', '.join(map(str, self.joints))} ({self.axes_told}){self._told}"
        )

    @property
    def _told(self) -> str:
        return f", {self.at_m:.3f} m along its axis" if self.at_m else ""

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every class of axes at every joint."""
        for number in range(1, len(robot.joints) + 1):
            for axes in CLASSES.values():
                yield cls(joints=[number], axes=list(axes))

    @property
    def settings_found(self) -> int:
        """One where it tilts about a place that was found."""
        return int(bool(self.at_m) and not {"rx", "ry"}.isdisjoint(self.axes))

    @property
    def changes_site(self) -> bool:
        """Whether its coordinates are about another point than the joint frame's origin."""
        return self.at_m is not None

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """The joint's own turns across its axis, about the place of its springs: its frame moves along, and
        rises by half the square of the angle times the distance.
        """
        if self.at_m is None:
            return []
        found, at = list[Added](), self.at_m
        for turn, slide, lever in (("rx", "ty", at), ("ry", "tx", -at)):
            for name in joint_coordinates(robot, self.joints, [turn], self._where):  # type: ignore[list-item]
                body = name.partition(".")[0]
                link = robot.links[int(body.removeprefix("joint"))].name
                found.append(Added(name, link, {f"{body}.{slide}": lever}, lifts={f"{body}.tz": at}))
        return found

    def free_coordinates(self, robot: Robot) -> list[str]:
        """joint1.rz and so on, joint by joint."""
        return joint_coordinates(robot, self.joints, self.axes, self._where)
