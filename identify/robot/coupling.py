"""Motors that turn with more than their own joint, as in hollow-shaft wrists: the coupling matrix of the
drives.

Motor i turns gear_ratio_i times sum_j C_ij q_j.  Power is the same on both sides, so the torques at the
motors, times their ratios, are C^-T times those at the joints.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.description import Robot

_FLAT = 1e-6
"""Determinant below which a coupling does not let every joint be moved by itself."""


def checked_coupling(rows: Sequence[Sequence[float]], robot: Robot, where: str = "drives.coupling") -> Array:
    """The matrix (drives, joints); InputError where it has another size, ones are missing on its diagonal, or
    it cannot be inverted.
    """
    count = len(robot.joints)
    if len(rows) != count or any(len(row) != count for row in rows):
        found = f"{len(rows)} rows of {', '.join(str(len(row)) for row in rows)} numbers"
        raise InputError(where, found, f"{count} rows of {count}, one per joint of {robot.name!r}")
    matrix = np.array(rows, dtype=np.float64)
    if not np.isfinite(matrix).all() or not np.allclose(np.diag(matrix), 1.0):
        fix = "what a motor turns with its own joint is its gear ratio"
        raise InputError(where, f"a diagonal of {np.diag(matrix).tolist()}", "ones on the diagonal", fix)
    if abs(float(np.linalg.det(matrix))) < _FLAT:
        raise InputError(where, "a matrix without an inverse", "motors that move every joint by itself")
    return matrix
