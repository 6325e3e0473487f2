"""Small rotations by rotation vectors, and their exact derivatives (right Jacobian of SO(3); Chirikjian
2012).
"""

from __future__ import annotations

import numpy as np
import scipy

from identify.core.arrays import Array

_SMALL = 1e-4
"""Angle, rad, below which series replace quotients of vanishing numbers."""


def cross_matrix(vector: Array) -> Array:
    """(..., 3, 3) of vectors (..., 3): `cross_matrix(a) @ b` is a x b."""
    return np.asarray(np.cross(vector[..., None, :], np.eye(3), axisb=-1).swapaxes(-1, -2))


def turn_slope(turn: Array) -> tuple[Array, Array]:
    """R (n, 3, 3) of rotation vectors (n, 3), rad, and Jr (n, 3, 3) with d(R u) = -R (u x Jr d turn)."""
    angle, cross = np.linalg.norm(turn, axis=-1)[:, None, None], cross_matrix(turn)
    small = angle < _SMALL
    far = np.where(small, 1.0, angle)
    first = np.where(small, 0.5, (1 - np.cos(far)) / far**2)
    second = np.where(small, 1 / 6, (far - np.sin(far)) / far**3)
    rotation = scipy.spatial.transform.Rotation.from_rotvec(turn).as_matrix()
    return rotation, np.eye(3) - first * cross + second * cross @ cross
