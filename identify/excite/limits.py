"""Within which limits a robot may move, checked: per joint in rad, and points in the workspace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.excite.study import ExciteStudy, WorkspaceRegion
from identify.robot.description import Robot
from identify.robot.engine_motion import MovingArm


@dataclass(frozen=True)
class Limits:
    """low, high, speed, acceleration (joints,), rad, s; posture (joints,): inside all of them; moving: joints
    (from 0) that move; regions: of points, by `arm`.
    """

    low: Array
    high: Array
    speed: Array
    acceleration: Array
    posture: Array
    moving: Index
    regions: Sequence[WorkspaceRegion]
    arm: MovingArm

    def outside(self, position: Array, *, inwards: bool = False) -> Array:
        """(samples,), m: how far points are outside their regions at joint angles (samples, joints), the
        farthest of all; inwards: negative where all are inside, by as much.
        """
        far = np.full(len(position), -np.inf if inwards else 0.0)
        for region in self.regions:
            low, high = np.array(region.ranges).T
            place = self.arm.frame_position(position, region.frame, np.array(region.point_m))
            far = np.maximum(far, np.maximum(low - place, place - high).max(axis=1))
        return far


def limits_of(study: ExciteStudy, robot: Robot) -> Limits:
    """The limits of a study; InputError for numbers that do not fit the robot, for a joint whose angles end
    nowhere, and for a posture that is outside.
    """
    count = len(robot.joints)
    low, high = _angles(study, robot)
    speed = np.radians(per_joint(study.speed_deg_per_s, count, "speed_deg_per_s"))
    acceleration = np.radians(per_joint(study.acceleration_deg_per_s2, count, "acceleration_deg_per_s2"))
    for key, values in (("speed_deg_per_s", speed), ("acceleration_deg_per_s2", acceleration)):
        if not (values > 0).all():
            raise InputError(key, f"{np.degrees(values.min()):g}", "numbers above zero")
    posture = (low + high) / 2
    if study.posture_deg is not None:
        posture = np.radians(per_joint(study.posture_deg, count, "posture_deg"))
    moving = np.array([robot.joint_number(n, "joints") - 1 for n in study.joints or range(1, count + 1)])
    arm = MovingArm(robot)
    for number, region in enumerate(study.workspace):
        arm.mechanism.frame(region.frame, f"workspace.{number}.frame")
    found = Limits(low, high, speed, acceleration, posture, np.unique(moving), study.workspace, arm)
    _check_posture(found)
    return found


def per_joint(values: Sequence[float], count: int, key: str) -> Array:
    """(joints,); InputError for another number of them, or one that is not finite."""
    if len(values) != count:
        raise InputError(key, f"{len(values)} numbers", f"{count}, one per joint")
    if not np.isfinite(values).all():
        raise InputError(key, "a number that is not finite", "finite numbers")
    return np.array(values, dtype=np.float64)


def _angles(study: ExciteStudy, robot: Robot) -> tuple[Array, Array]:
    if study.angle_deg is None:
        low, high = (
            np.array([getattr(joint, side) for joint in robot.joints]) for side in ("lower", "upper")
        )
        endless = [
            joint.name for joint, room in zip(robot.joints, high - low, strict=True) if not room < np.inf
        ]
        if endless:
            found = f"no limits of {', '.join(endless)} in the robot's file"
            raise InputError("angle_deg", found, "least and most angle of each joint", "add `angle_deg:`")
    else:
        low, high = (
            np.radians(per_joint([pair[side] for pair in study.angle_deg], len(robot.joints), "angle_deg"))
            for side in (0, 1)
        )
    if not (low < high).all():
        joint = robot.joints[int(np.argmin(high - low))].name
        raise InputError("angle_deg", f"limits of {joint} without room", "least below most")
    return low, high


def _check_posture(limits: Limits) -> None:
    """InputError for a posture at or beyond a limit, from which nothing can move."""
    for n in np.flatnonzero((limits.posture <= limits.low) | (limits.posture >= limits.high)):
        angle, low, high = np.degrees([limits.posture[n], limits.low[n], limits.high[n]])
        raise InputError("posture_deg", f"joint {n + 1} at {angle:g}", f"between {low:g} and {high:g}")
    far = float(limits.outside(limits.posture[None])[0])
    if far > 0:
        fix = "give a posture inside as `posture_deg`, or a larger workspace"
        raise InputError("posture_deg", f"a point {1e3 * far:.3g} mm outside its workspace", "inside", fix)
