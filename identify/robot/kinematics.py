"""Where the links of a robot are at joint angles, and how places on them move with these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Index, cross
from identify.robot.description import Robot
from identify.robot.pose import turned


@dataclass(frozen=True)
class Chain:
    """Links at a posture: poses (links, 4, 4) of their frames in the base's; of each joint its axis (joints,
    3) and a place on it (joints, 3).
    """

    poses: Array
    axes: Array
    places: Array

    def moved(self, links: Index, places: Array) -> Array:
        """(n, 3, joints): what a joint angle does to places (n, 3), in the base's frame, of links (n)."""
        away = places[:, None] - self.places[None]
        motion = cross(self.axes[None], away)
        carried = links[:, None] > np.arange(len(self.axes))
        return np.asarray((motion * carried[..., None]).transpose(0, 2, 1))


def chain(robot: Robot, angles: Array) -> Chain:
    """The links at angles (joints,), rad."""
    poses, axes, places = [np.eye(4)], [], []
    for joint, angle in zip(robot.joints, angles, strict=True):
        at = poses[-1] @ joint.origin
        axes.append(at[:3, :3] @ joint.axis)
        places.append(at[:3, 3])
        poses.append(at @ turned(angle * joint.axis) @ joint.mount)
    return Chain(np.array(poses), np.array(axes), np.array(places))
