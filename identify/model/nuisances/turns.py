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
    """(3, 3): `cross_matrix(a) @ b` is a x b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turn_slope(turn: Array) -> tuple[Array, Array]:
    """R (3, 3) of a rotation vector (3,), rad, and Jr (3, 3) with d(R u) = -R (u x Jr d turn)."""
    angle, cross = float(np.linalg.norm(turn)), cross_matrix(turn)
    if angle < _SMALL:
        first, second = 0.5, 1 / 6
    else:
        first, second = (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    rotation = scipy.spatial.transform.Rotation.from_rotvec(turn).as_matrix()
    return rotation, np.eye(3) - first * cross + second * cross @ cross
