"""Poses: 4 x 4 homogeneous transforms, and rigid bodies seen from another frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from identify.core.arrays import Array
from identify.robot.description import Link


def pose(xyz: ArrayLike, rpy: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """(4, 4) from a shift xyz (3,), m, and roll, pitch, yaw (3,), rad, about the fixed x, y, z axes in that
    order (the URDF convention).
    """
    result = np.eye(4)
    result[:3, :3] = Rotation.from_euler("xyz", np.asarray(rpy, dtype=float)).as_matrix()
    result[:3, 3] = xyz
    return result


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
