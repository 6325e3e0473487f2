"""Columns of inertial parameters against Pinocchio's regressor, and against torques of the engine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio
import pytest

from identify.robot.description import Link
from identify.robot.inverse_dynamics import NAMES, RigidArm, link_columns
from identify.robot.urdf import read_urdf
from tests.generator import joint_runs
from tests.joints.test_base_parameters import described
from tests.robot.random_arm import general_arm, write


def test_they_are_pinocchio_s(tmp_path: Path) -> None:
    """Of an arm whose joints turn about z: its frames are where the links' are, but for the constant rest."""
    robot, model = described(tmp_path), joint_runs.arm()
    standing = tuple(replace(joint, mount=np.eye(4)) for joint in robot.joints)
    origins = [robot.joints[0].origin]
    origins += [
        before.mount @ joint.origin for before, joint in zip(robot.joints, robot.joints[1:], strict=False)
    ]
    joints = tuple(replace(joint, origin=at) for joint, at in zip(standing, origins, strict=True))
    motion = np.random.default_rng(4).uniform(-2, 2, (3, 5, 3))
    ours = link_columns(replace(robot, joints=joints), *motion)
    order = [NAMES.index(name) for name in ("m", "mx", "my", "mz", "xx", "xy", "yy", "xz", "yz", "zz")]
    for sample, columns in enumerate(ours):
        theirs = pinocchio.computeJointTorqueRegressor(model, model.createData(), *motion[:, sample])
        np.testing.assert_allclose(columns[..., order].reshape(3, -1), theirs, atol=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_with_a_body_s_parameters_they_are_the_engine_s_torques(tmp_path: Path, seed: int) -> None:
    """Any axes, frames, gravity; of a Denavit-Hartenberg table too."""
    for robot in (read_urdf(write(tmp_path, general_arm(seed))), described(tmp_path)):
        count = len(robot.joints)
        motion = np.random.default_rng(seed).uniform(-2, 2, (3, 6, count))
        arm, total = RigidArm(robot, *motion), np.zeros((6, count))
        for columns, link in zip(
            np.moveaxis(link_columns(robot, *motion), 2, 0), robot.links[1:], strict=True
        ):
            total += columns @ _parameters(link)
        np.testing.assert_allclose(total, arm.torque, rtol=1e-9, atol=1e-8 * np.abs(arm.torque).max())
        wrong = RigidArm(replace(robot, gravity=-robot.gravity), *motion).torque
        assert np.abs(total - wrong).max() > 1.0


def _parameters(link: Link) -> np.ndarray:
    about = link.inertia + link.mass * (
        link.centre @ link.centre * np.eye(3) - np.outer(link.centre, link.centre)
    )
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = about
    return np.array([xx, xy, xz, yy, yz, zz, *(link.mass * link.centre), link.mass])
