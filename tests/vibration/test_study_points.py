"""Points in the frame of the base at a posture are those in the frames of the links."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.core.yaml_input import yaml_text
from identify.robot.points import Point, new_points_text, read_points
from identify.setup.apply import write_corrected
from identify.setup.edits import OnLink
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.benchmarks.registration import read_arm
from tests.setup import studies

POSTURE = [20.0, -35.0, 50.0, 10.0, -40.0, 70.0]


def _in_base(folder: Path) -> dict[int, Point]:
    """The points of the hammer test with places and axes in the base's frame, by kinematics of the tests'
    own; written into a file.
    """
    arm = read_arm(studies.DATA / "robot.urdf")
    poses = arm.poses(np.radians(POSTURE))
    told = read_points(studies.DATA / "points.csv")
    found = {}
    for node, point in told.items():
        number = next(n for n, fixed in enumerate(arm.fixed) if point.link in fixed)
        pose = poses[number] @ arm.fixed[number][point.link]
        place = pose[:3, :3] @ point.position + pose[:3, 3]
        found[node] = Point(node, point.name, point.link, place, point.axes @ pose[:3, :3].T, "")
    (folder / "base.csv").write_text(new_points_text(found))
    return told


def _study(folder: Path, **keys: Any) -> Path:
    told = {"points": "base.csv", "points_frame": "base", "points_posture_deg": POSTURE, **keys}
    path = folder / "study.yaml"
    path.write_text(yaml_text(studies.config(**told)))
    return path


def test_a_study_reads_points_in_the_frame_of_the_base(tmp_path: Path) -> None:
    told = _in_base(tmp_path)
    found = load_problem(read_study(_study(tmp_path))).points
    for node, point in told.items():
        assert found[node].link == point.link
        np.testing.assert_allclose(found[node].position, point.position, atol=2e-5)
        np.testing.assert_allclose(found[node].axes, point.axes, atol=1e-4)


def test_the_controllers_angles_count_there_too(tmp_path: Path) -> None:
    told = _in_base(tmp_path)
    sign = {"sign": [1, -1, 1, 1, 1, 1]}
    posture = [a * s for a, s in zip(POSTURE, sign["sign"], strict=True)]
    found = load_problem(read_study(_study(tmp_path, joint_angles=sign, points_posture_deg=posture))).points
    np.testing.assert_allclose(found[9].position, told[9].position, atol=2e-5)


@pytest.mark.parametrize("keys", [{"points_posture_deg": None}, {"points_frame": "link"}])
def test_a_frame_without_its_posture_is_refused(tmp_path: Path, keys: dict[str, Any]) -> None:
    with pytest.raises(InputErrors, match="or neither"):
        read_study(_study(tmp_path, **keys))


def test_a_posture_of_another_robot_is_refused(tmp_path: Path) -> None:
    _in_base(tmp_path)
    with pytest.raises(InputError, match="one per joint"):
        load_problem(read_study(_study(tmp_path, points_posture_deg=POSTURE[:3])))


def test_a_corrected_link_leaves_the_place_in_the_frame_of_the_base(tmp_path: Path) -> None:
    _in_base(tmp_path)
    written = write_corrected(read_study(_study(tmp_path)), [OnLink(9, "link2")], [])
    before, after = read_points(tmp_path / "base.csv"), read_points(written[1])
    assert after[9].link == "link2" != before[9].link
    np.testing.assert_allclose(after[9].position, before[9].position)
