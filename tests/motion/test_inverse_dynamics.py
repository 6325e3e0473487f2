"""Rigid torques and what a unit of mass, first moment or inertia adds to them, against Pinocchio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from identify.robot.description import Link
from identify.robot.dh import read_dh
from identify.robot.inverse_dynamics import RigidArm
from tests.motion.hidden_drive import PAYLOAD_AT, PAYLOAD_KG, Hidden, move, rigid_model, study


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> tuple[RigidArm, object]:
    folder: Path = tmp_path_factory.mktemp("arm")
    study(folder, 5, Hidden())
    motion = move(4, 5, PAYLOAD_KG, seconds=0.4)
    robot = read_dh(folder / "robot.yaml").with_payload(
        "link5", PAYLOAD_KG, np.array(PAYLOAD_AT), np.zeros((3, 3))
    )
    return RigidArm(robot, motion.q, motion.v, motion.a), motion


def test_torques_are_those_of_pinocchio(arm: tuple[RigidArm, object]) -> None:
    rigid, motion = arm
    np.testing.assert_allclose(rigid.torque, motion.rigid, rtol=1e-9, atol=1e-8)  # type: ignore[attr-defined]


def test_added_bodies_are_those_of_pinocchio(arm: tuple[RigidArm, object]) -> None:
    rigid, motion = arm
    model = rigid_model(5, PAYLOAD_KG + 3.0)
    data = model.createData()
    heavier = np.array(
        [pin.rnea(model, data, *row) for row in zip(motion.q, motion.v, motion.a, strict=True)]
    )  # type: ignore[attr-defined]
    body = Link("payload", 3.0, np.array(PAYLOAD_AT), np.zeros((3, 3)))
    np.testing.assert_allclose(rigid.added("link5", body), heavier - motion.rigid, rtol=1e-7, atol=1e-8)  # type: ignore[attr-defined]


def test_columns_add_up_to_a_body(arm: tuple[RigidArm, object]) -> None:
    """A point mass is its mass, first moments and inertia about the origin: linear in each."""
    rigid, _ = arm
    mass, centre = 2.0, np.array([0.3, -0.2, 0.1])
    whole = rigid.added("link2", Link("point", mass, centre, np.zeros((3, 3))))
    parts = rigid.added("link2", Link("origin", mass, np.zeros(3), np.zeros((3, 3))))
    for axis in range(3):
        parts = parts + mass * centre[axis] * rigid.first_moment("link2", axis)
    values, vectors = np.linalg.eigh(mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)))
    for value, vector in zip(values, vectors.T, strict=True):
        parts = parts + value * rigid.inertia("link2", vector)
    np.testing.assert_allclose(parts, whole, atol=1e-8)
