"""Angles as a controller counts them, and robot files in other units."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.robot.joint_angles import JointAngles, from_ground
from identify.robot.units import RobotUnits
from identify.robot.urdf import read_urdf
from tests.robot.random_arm import industrial_arm, write


def test_order_sign_coupling_and_offset() -> None:
    told = JointAngles(order=[2, 1, 3], sign=[1, -1, 1], offset_deg=[0, 0, 90], coupling={3: {2: -1}})
    np.testing.assert_allclose(np.rad2deg(told.posture([10.0, 20.0, 30.0])), [20, -10, 30 - 20 + 90])
    np.testing.assert_allclose(np.rad2deg(told.rates([10.0, 20.0, 30.0])), [20, -10, 10])


def test_a_change_of_the_robots_angles_is_found_back() -> None:
    told = JointAngles(order=[3, 1, 2], sign=[1, -1, 1], offset_deg=[5, 6, 7], coupling={1: {2: 0.5}})
    stated = [10.0, 20.0, 30.0]
    change = np.radians([1.0, -2.0, 3.0])
    moved = (np.array(stated) + told.stated(change)).tolist()
    np.testing.assert_allclose(told.posture(moved), told.posture(stated) + change)


@pytest.mark.parametrize(("axis", "times"), [("0 1 0", -1.0), ("0 -1 0", 1.0), ("1 0 0", None)])
def test_a_forearm_that_is_counted_from_the_ground_stays_level(
    tmp_path: Path, axis: str, times: float | None
) -> None:
    """Joint 2 leans the upper arm by any angle; the controller's angle of joint 3 is the forearm's own."""
    body = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = "".join(f'<link name="l{n}">{body}</link>' for n in range(4))
    joints = "".join(
        f'<joint name="j{n}" type="revolute"><parent link="l{n - 1}"/><child link="l{n}"/>'
        f'<origin rpy="{turn} 0 0" xyz="0 0 1"/><axis xyz="{along}"/></joint>'
        for n, turn, along in ((1, 0, "0 0 1"), (2, 0, "0 1 0"), (3, 0, axis))
    )
    arm = read_urdf(write(tmp_path, f'<robot name="a">{links}{joints}</robot>'))
    assert from_ground(arm) == times
    if times is not None:
        told = JointAngles(coupling={3: {2: times}})
        turned = [told.posture([0.0, lean, 25.0]) for lean in (0.0, 40.0)]
        sense = -times
        absolute = [q[1] * sense + q[2] for q in turned]
        np.testing.assert_allclose(np.rad2deg(absolute), 25.0)


def test_radians() -> None:
    np.testing.assert_allclose(JointAngles(unit="rad").posture([1.0, -2.0]), [1.0, -2.0])


@pytest.mark.parametrize(
    ("told", "said"),
    [
        (JointAngles(sign=[1, 1]), "joint_angles.sign: 2 values; expected 3"),
        (JointAngles(order=[1, 1, 2]), "each number from 1 to 3 once"),
        (JointAngles(coupling={4: {1: 1.0}}), "joints from 1 to 3"),
    ],
)
def test_other_numbers_of_joints_are_refused(told: JointAngles, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        told.posture([0.0, 0.0, 0.0])


def test_a_robot_in_pounds_mm_and_kg_mm2_is_the_same(tmp_path: Path) -> None:
    right = read_urdf(write(tmp_path, industrial_arm(3)))

    def times(text: str, names: str, factor: float) -> str:
        def scaled(found: re.Match[str]) -> str:
            return f'{found[1]}="{" ".join(f"{factor * float(n):.15g}" for n in found[2].split())}"'

        return re.sub(rf'\b({names})="([^"]*)"', scaled, text)

    text = times(industrial_arm(3), "value", 1 / 0.45359237)
    text = times(text, "ixx|ixy|ixz|iyy|iyz|izz", 1e6)
    text = re.sub(r'(<origin xyz=")([^"]*)', lambda m: m[1] + _scaled(m[2]), text)
    units = RobotUnits(mass="lb", length="mm", inertia="kg mm2")
    found = read_urdf(write(tmp_path, text), units=units)
    for one, other in zip(found.links, right.links, strict=True):
        assert one.mass == pytest.approx(other.mass)
        np.testing.assert_allclose(one.centre, other.centre, atol=1e-12)
        np.testing.assert_allclose(one.inertia, other.inertia, rtol=1e-9, atol=1e-12)
    for one, other in zip(found.joints, right.joints, strict=True):
        np.testing.assert_allclose(one.origin, other.origin, atol=1e-12)


def _scaled(text: str) -> str:
    return " ".join(f"{1000 * float(n):.15g}" for n in text.split())
