"""Poses: 4 x 4 homogeneous transforms, and rigid bodies seen from another frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from identify.core.arrays import Array
from identify.robot.description import Link


def pose(xyz: ArrayLike, rpy: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """(4, 4) from a shift xyz (3,), m, and roll, pitch, yaw (3,), rad, about the fixed x, y, z axes in that
    order (the URDF convention).
    """
    result = np.eye(4)
    for axis, angle in zip(np.eye(3), np.asarray(rpy, dtype=float), strict=True):
        result = turned(angle * axis) @ result
    result[:3, 3] = xyz
    return result


def roll_pitch_yaw(of: Array) -> Array:
    """(3,), rad, of a pose (4, 4); of two angles about one axis all is roll."""
    turn, level = of[:3, :3], float(np.hypot(of[0, 0], of[1, 0]))
    pitch = np.arctan2(-turn[2, 0], level)
    if level > 1e-9:
        return np.array([np.arctan2(turn[2, 1], turn[2, 2]), pitch, np.arctan2(turn[1, 0], turn[0, 0])])
    return np.array([np.arctan2(-turn[1, 2], turn[1, 1]), pitch, 0.0])


def turned(vector: ArrayLike) -> Array:
    """(4, 4) that turns about the direction of `vector` (3,) by its length, rad (Rodrigues' formula)."""
    x, y, z = np.asarray(vector, dtype=float).tolist()
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    # sin(a) / a and (1 - cos(a)) / a^2, which is 2 sin(a / 2)^2 / a^2: that loses no digits.
    along, across = (np.sin(angle) / angle, 2 * np.sin(angle / 2) ** 2 / square) if square else (1.0, 0.5)
    u, v, w = along * x, along * y, along * z
    xy, yz, zx = across * x * y, across * y * z, across * z * x
    return np.array(
        [
            [1 - across * (y * y + z * z), xy - w, zx + v, 0.0],
            [xy + w, 1 - across * (x * x + z * z), yz - u, 0.0],
            [zx - v, yz + u, 1 - across * (x * x + y * y), 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def inverse(of: Array) -> Array:
    """Inverse (4, 4) of a pose (4, 4)."""
    result = np.eye(4)
    result[:3, :3] = of[:3, :3].T
    result[:3, 3] = -of[:3, :3].T @ of[:3, 3]
    return result


def seen_from(link: Link, frame: Array) -> Link:
    """The same body with its centre and inertia in another frame, where the link's own frame has the pose
    `frame` (4, 4).
    """
    turn = frame[:3, :3]
    return replace(link, centre=turn @ link.centre + frame[:3, 3], inertia=turn @ link.inertia @ turn.T)
