"""Angles as a controller counts them, turned into those of the robot file.

    q = A p + b,   A_ij = sign_i (i is angle j of the list) + c_ij

with the angles p as they stand in `posture_deg`, the coupling c of joints that are counted from the ground
(joint 3 of many arms with a parallelogram: q_3 = p_3 - p_2) and the offsets b.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.robot.description import Robot

_PARALLEL = 1e-3


class JointAngles(Settings):
    """How stated joint angles are counted, where not as the robot file does."""

    unit: Literal["deg", "rad"] = Field("deg", description="unit of the stated angles: deg or rad")
    order: list[int] | None = Field(
        None, description="for each joint, which of the stated angles is its own, from 1; default: 1, 2, ..."
    )
    sign: list[Literal[-1, 1]] | None = Field(None, description="for each joint 1 or -1; default: all 1")
    offset_deg: list[float] | None = Field(
        None, description="for each joint its angle in the robot file where the controller shows 0"
    )
    coupling: dict[int, dict[int, float]] = Field(
        {},
        description="times which stated angles of other joints are added to a joint's own: {3: {2: -1}} where"
        " joint 3 is counted from the ground",
    )

    def matrix(self, count: int) -> Array:
        """A (count, count), without the unit; InputError where the keys are of another number of joints."""
        order = self.order or list(range(1, count + 1))
        sign = self.sign or [1] * count
        for key, values in (("order", order), ("sign", sign), ("offset_deg", self.offset_deg or order)):
            if len(values) != count:
                where = f"joint_angles.{key}"
                raise InputError(where, f"{len(values)} values", f"{count}, one per joint")
        if sorted(order) != list(range(1, count + 1)):
            raise InputError("joint_angles.order", f"{order}", f"each number from 1 to {count} once")
        found = np.zeros((count, count))
        found[np.arange(count), np.array(order) - 1] = sign
        for joint, others in self.coupling.items():
            for other, times in others.items():
                if not (1 <= joint <= count and 1 <= other <= count):
                    found_text = f"joint {max(joint, other)}"
                    raise InputError("joint_angles.coupling", found_text, f"joints from 1 to {count}")
                found[joint - 1, other - 1] += times
        return found

    def posture(self, stated: list[float]) -> Array:
        """Joint angles of the robot file (joints,), rad."""
        offset = np.deg2rad(self.offset_deg or [0.0] * len(stated))
        return np.asarray(self.rates(stated) + offset)

    def rates(self, stated: list[float]) -> Array:
        """The same of speeds (joints,), rad/s, which no offset changes."""
        angles = np.asarray(stated, dtype=float)
        return np.asarray(self.matrix(len(stated)) @ (np.deg2rad(angles) if self.unit == "deg" else angles))

    def stated(self, change: Array) -> Array:
        """By how much stated angles differ, in their unit, where those of the robot file do by `change`
        (joints,), rad.
        """
        own = np.linalg.solve(self.matrix(len(change)), change)
        return np.asarray(np.rad2deg(own) if self.unit == "deg" else own)


def from_ground(robot: Robot) -> float | None:
    """How many times the angle of joint 2 is added to that of joint 3, where a controller counts this from
    the ground: -1 where both axes point alike, 1 where they are opposite; None where they are not parallel.
    """
    if len(robot.joints) < 3:
        return None
    second, third = robot.joints[1:3]
    alike = float(second.mount[:3, :3].T @ second.axis @ (third.origin[:3, :3] @ third.axis))
    return None if abs(abs(alike) - 1) > _PARALLEL else -round(alike)


AS_THE_ROBOT = JointAngles()
