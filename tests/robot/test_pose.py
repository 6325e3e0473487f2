"""Rotations against those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from identify.robot.pose import pose, turned


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 1.0, np.pi, 5.0])
def test_rotations_are_those_of_scipy(size: float) -> None:
    vector = size * np.array([0.6, -0.48, 0.64])
    np.testing.assert_allclose(turned(vector)[:3, :3], Rotation.from_rotvec(vector).as_matrix(), atol=1e-15)
    angles = Rotation.from_euler("xyz", vector).as_matrix()
    np.testing.assert_allclose(pose([1.0, 2.0, 3.0], vector)[:3, :3], angles, atol=1e-15)
    np.testing.assert_array_equal(pose([1.0, 2.0, 3.0], vector)[:, 3], [1.0, 2.0, 3.0, 1.0])


def test_the_order_of_the_angles_matters() -> None:
    fixed = pose(np.zeros(3), [0.3, 0.4, 0.5])[:3, :3]
    assert np.abs(fixed - Rotation.from_euler("XYZ", [0.3, 0.4, 0.5]).as_matrix()).max() > 0.1
