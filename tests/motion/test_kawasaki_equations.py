"""The terms of Kawasaki's Eq. 4 by Lagrange's equations of its thin rods, against the engine; as printed,
three of them are not those of these rods.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.robot.engine_motion import MovingArm
from identify.robot.read import read_robot
from identify.robot.settings import RobotSettings

ROOT = Path(__file__).parents[2]
L2, L3, M2, M3, J2, J3, G = 0.77, 1.005, 54.7, 62.1, 2.5, 3.0, 9.81
"""Lengths, m, masses, kg, and moments about the middle, kg m^2, of upper arm and forearm, from the paper."""


@pytest.fixture(scope="module")
def arm() -> MovingArm:
    return MovingArm(read_robot(RobotSettings(dh=Path("data/kawasaki_rs010l/robot.yaml")), ROOT))


def weights(q2: float, q3: float) -> tuple[float, float]:
    """Torques of gravity, N m, of angles from the horizontal; printed: without g, and m_3 for m_2 in the
    second term of the first.
    """
    fore = 0.5 * M3 * L3 * np.cos(q2 + q3)
    return G * ((M3 + 0.5 * M2) * L2 * np.cos(q2) + fore), G * fore


def centrifugal(q2: float, q3: float) -> tuple[float, float]:
    """c_211 and c_311: what turning of the column takes of the arm's joints, N m s^2."""
    own = (J3 + 0.25 * M3 * L3**2) * np.sin(q2 + q3) * np.cos(q2 + q3)
    c211 = 0.5 * M3 * L2 * L3 * np.sin(2 * q2 + q3) + own
    c211 += (M3 * L2**2 + J2 + 0.25 * M2 * L2**2) * np.sin(q2) * np.cos(q2)
    return c211, 0.5 * M3 * L2 * L3 * np.cos(q2) * np.sin(q2 + q3) + own


@pytest.mark.parametrize("angles", [(0.3, 0.4), (-1.2, 0.9), (0.8, -1.7)])
def test_gravity_and_centrifugal_terms(arm: MovingArm, angles: tuple[float, float]) -> None:
    position, still = _robot(angles), np.zeros(3)
    weight = arm.inverse_dynamics(position, still, still)
    np.testing.assert_allclose(np.abs(weight[1:]), np.abs(weights(*angles)), rtol=1e-6)
    turning = arm.inverse_dynamics(position, np.array([1.0, 0.0, 0.0]), still) - weight
    np.testing.assert_allclose(np.abs(turning[1:]), np.abs(centrifugal(*angles)), rtol=2e-3)
    printed = 0.5 * M3 * L2 * L3 * np.sin(angles[1])  # c_311, which is c_322
    assert abs(turning[2]) != pytest.approx(abs(printed), rel=0.05)
    folding = arm.inverse_dynamics(position, np.array([0.0, 1.0, 0.0]), still) - weight
    assert abs(folding[2]) == pytest.approx(abs(printed), rel=1e-6)


@pytest.mark.parametrize("angles", [(0.3, 0.4), (-1.2, 0.9), (0.8, -1.7)])
def test_coriolis_terms_as_printed(arm: MovingArm, angles: tuple[float, float]) -> None:
    """c_112 and c_113 of the column, c_233 and c_223 of the upper arm; but for signs, which follow the sense
    in which angles count.
    """
    q2, q3 = angles
    fore = M3 * L2 * L3 * np.cos(q2) * np.sin(q2 + q3)
    fore += (2 * J3 + 0.5 * M3 * L3**2) * np.cos(q2 + q3) * np.sin(q2 + q3)
    both = fore + M3 * L2 * L3 * np.sin(q2) * np.cos(q2 + q3)
    both += (2 * M3 * L2**2 + 0.5 * M2 * L2**2 + 2 * J2) * np.sin(q2) * np.cos(q2)
    bent = M3 * L2 * L3 * np.sin(q3)
    position, still = _robot(angles), np.zeros(3)

    def takes(*velocity: float) -> np.ndarray:
        weight = arm.inverse_dynamics(position, still, still)
        return arm.inverse_dynamics(position, np.array(velocity), still) - weight

    found = [
        (takes(1, 1, 0) - takes(1, 0, 0) - takes(0, 1, 0))[0],
        (takes(1, 0, 1) - takes(1, 0, 0) - takes(0, 0, 1))[0],
        takes(0, 0, 1)[1],
        (takes(0, 1, 1) - takes(0, 1, 0) - takes(0, 0, 1))[1],
    ]
    np.testing.assert_allclose(np.abs(found), np.abs([both, fore, 0.5 * bent, bent]), rtol=2e-3)


def _robot(angles: tuple[float, float]) -> np.ndarray:
    """Joint angles of the robot file."""
    return np.array([0.4, -angles[0], -angles[1]])
