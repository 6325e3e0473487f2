"""Units of a robot file that is not in SI: what its masses, lengths, inertias and angles are really in."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.robot.description import Joint, Link, Robot

POUND_KG, INCH_M = 0.45359237, 0.0254
MASSES = {"kg": 1.0, "g": 1e-3, "t": 1e3, "lb": POUND_KG}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": INCH_M}
INERTIAS = {
    "kg m2": 1.0,
    "kg cm2": 1e-4,
    "kg mm2": 1e-6,
    "g mm2": 1e-9,
    "g cm2": 1e-7,
    "g m2": 1e-3,
    "lb m2": POUND_KG,
    "lb in2": POUND_KG * INCH_M**2,
}
ANGLES = {"rad": 1.0, "deg": float(np.radians(1.0))}
"""kg, m, kg m^2 and rad per unit."""


class RobotUnits(Settings):
    """Units of a robot file, each the SI one unless it says otherwise."""

    mass: Literal["kg", "g", "t", "lb"] = Field("kg", description="kg, g, t or lb")
    length: Literal["m", "cm", "mm", "in"] = Field("m", description="m, cm, mm or in; of meshes it is theirs")
    inertia: Literal["kg m2", "kg cm2", "kg mm2", "g mm2", "g cm2", "g m2", "lb m2", "lb in2"] = Field(
        "kg m2", description="such as kg mm2, g mm2 or lb in2"
    )
    angle: Literal["rad", "deg"] = Field("rad", description="of `rpy` in a URDF: rad or deg")

    @property
    def si(self) -> bool:
        """Whether all are as they should be."""
        return self == SI

    def link(self, link: Link) -> Link:
        """A body in SI."""
        length = LENGTHS[self.length]
        inertia = INERTIAS[self.inertia] * link.inertia
        return Link(link.name, MASSES[self.mass] * link.mass, length * link.centre, inertia)

    def pose(self, pose: Array) -> Array:
        """A pose (4, 4) in SI."""
        found = pose.copy()
        found[:3, 3] *= LENGTHS[self.length]
        return found

    def joint(self, joint: Joint) -> Joint:
        """A joint in SI."""
        return replace(joint, origin=self.pose(joint.origin), mount=self.pose(joint.mount))

    def robot(self, robot: Robot) -> Robot:
        """A robot in SI, of whose links none was merged out of several."""
        if self.si:
            return robot
        frames = {name: (link, self.pose(pose)) for name, (link, pose) in robot.frames.items()}
        links, joints = tuple(map(self.link, robot.links)), tuple(map(self.joint, robot.joints))
        return replace(robot, links=links, joints=joints, frames=frames)


SI = RobotUnits()
