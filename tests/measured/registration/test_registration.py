"""Nodes of a simulated geometry come back on their links, whatever the frame, the unit and the angles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.api import commands as api
from identify.cli import app
from identify.core.errors import InputError
from identify.measured.registration.place import Placing, doubts_of
from identify.measured.registration.register import Node, Registration
from identify.robot.points import read_points
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.benchmarks.registration import rotation
from tests.measured.registration.arm import COUNT, Test, simulated, widest
from tests.setup.studies import DATA


def _errors(test: Test, out: Path) -> tuple[float, np.ndarray]:
    """Share of right links, and distances of those, m."""
    found = read_points(out)
    right = [
        row
        for row, link in enumerate(test.nodes.link)
        if row + 1 in found and found[row + 1].link == test.arm.names[link]
    ]
    away = [np.linalg.norm(found[row + 1].position - test.nodes.local[row]) for row in right]
    return len(right) / COUNT, np.array(away)


def _placed(test: Test, folder: Path, **options: Any) -> Placing:
    return api.points(test.arm.file, [test.uff], posture=test.posture, out=folder / "points.csv", **options)


def test_three_rough_pairs_and_angles_three_degrees_off(tmp_path: Path) -> None:
    test = simulated(tmp_path, 1)
    found = _placed(test, tmp_path, pairs=test.pairs(tmp_path, widest(test.nodes)))
    right, away = _errors(test, tmp_path / "points.csv")
    assert right >= 0.95
    assert np.median(away) < 0.005
    assert any("other angles than stated" in note for note in found.notes)


def test_angles_that_may_not_move_leave_centimetres(tmp_path: Path) -> None:
    """Negative control: it is the free angles that bring millimetres."""
    test = simulated(tmp_path, 1)
    _placed(test, tmp_path, pairs=test.pairs(tmp_path, widest(test.nodes)), angle_error=0.01)
    _, away = _errors(test, tmp_path / "points.csv")
    assert np.median(away) > 0.01


def test_the_shape_alone_suffices(tmp_path: Path) -> None:
    test = simulated(tmp_path, 2, off_deg=2.0)
    _placed(test, tmp_path)
    right, away = _errors(test, tmp_path / "points.csv")
    assert right >= 0.95
    assert np.median(away) < 0.005


@pytest.mark.parametrize(
    ("unit", "said"), [("mm", "m"), pytest.param("in", "m", marks=pytest.mark.exam), ("m", "mm")]
)
def test_a_wrong_unit_is_found_and_said(tmp_path: Path, unit: str, said: str) -> None:
    test = simulated(tmp_path, 3, unit, said)
    found = _placed(test, tmp_path, pairs=test.pairs(tmp_path, widest(test.nodes)))
    right, away = _errors(test, tmp_path / "points.csv")
    assert right >= 0.95
    assert np.median(away) < 0.006
    assert any("times what its unit says" in note for note in found.notes)


def test_nodes_of_something_else_are_doubted_or_refused(tmp_path: Path) -> None:
    test = simulated(tmp_path, 4)
    chance = np.random.default_rng(0)
    lines = test.uff.read_text().splitlines()
    start = lines.index("    15") + 1
    for number in range(start, start + COUNT):
        lines[number] = lines[number][:40] + "".join(f"{x:13.5E}" for x in chance.uniform(-1, 1, 3))
    test.uff.write_text("\n".join(lines) + "\n")
    found = _placed(test, tmp_path, pairs=test.pairs(tmp_path, widest(test.nodes)), pair_error=1.0)
    assert len(found.doubts or ()) > COUNT / 3


def test_a_cloud_of_no_robot_size_is_refused(tmp_path: Path) -> None:
    test = simulated(tmp_path, 4)
    lines = test.uff.read_text().splitlines()
    start = lines.index("    15") + 1
    for number in range(start, start + COUNT):
        lines[number] = lines[number][:40] + "".join(f"{1e-9 * number:13.5E}" for _ in range(3))
    test.uff.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match="in whatever unit"):
        _placed(test, tmp_path)


def test_axes_are_those_of_the_analyser_in_the_frame_of_the_link(tmp_path: Path) -> None:
    test = simulated(tmp_path, 5, off_deg=0.0)
    _placed(test, tmp_path, pairs=test.pairs(tmp_path, widest(test.nodes)))
    poses = test.arm.poses(np.radians(test.stated))
    frame = rotation(np.array([0.2, -0.3, 1.0]), 2.0)
    for node, point in read_points(tmp_path / "points.csv").items():
        number = test.arm.names.index(point.link)
        expected = frame @ poses[number][:3, :3]
        angle = np.degrees(np.arccos((np.trace(point.axes @ expected.T) - 1) / 2))
        assert angle < 4.0, node


def test_an_existing_file_is_kept(tmp_path: Path) -> None:
    test = simulated(tmp_path, 1)
    (tmp_path / "points.csv").write_text("mine")
    with pytest.raises(InputError, match="the file exists"):
        _placed(test, tmp_path)
    assert (tmp_path / "points.csv").read_text() == "mine"


def test_the_command_says_what_is_to_be_looked_at(tmp_path: Path) -> None:
    test = simulated(tmp_path, 6)
    pairs, out = test.pairs(tmp_path, widest(test.nodes)), tmp_path / "points.csv"
    words = ["points", str(test.arm.file), str(test.uff), "--posture", test.posture]
    shown = CliRunner().invoke(app, [*words, "--pairs", str(pairs), "--out", str(out)])
    assert shown.exit_code == 0, shown.output
    assert "from its surface" in shown.output
    assert out.exists() and out.with_suffix(".html").exists()


def test_a_geometry_without_a_posture_is_refused(tmp_path: Path) -> None:
    test = simulated(tmp_path, 1)
    with pytest.raises(InputError, match="no posture"):
        api.points(test.arm.file, [test.uff], out=tmp_path / "points.csv")


def test_the_link_of_a_pair_is_known(tmp_path: Path) -> None:
    """A node at the seam of two links is on that which somebody says, wherever the surface is nearer."""
    test = simulated(tmp_path, 1)
    rows = widest(test.nodes)
    pairs = test.pairs(tmp_path, rows)
    plain = _placed(test, tmp_path, pairs=pairs)
    assert plain.registration is not None
    node = min((one for one in plain.registration.nodes if one.other), key=lambda one: one.probability)
    poses = test.arm.poses(plain.registration.angles)
    here, there = (test.arm.names.index(name) for name in (node.link, node.other))
    place = poses[there][:3, :3].T @ (
        poses[here][:3, :3] @ node.position + poses[here][:3, 3] - poses[there][:3, 3]
    )
    row = f"{node.node},,{node.other}," + ",".join(f"{x:.3f}" for x in place)
    pairs.write_text(pairs.read_text() + row + "\n")
    (tmp_path / "points.csv").unlink()
    found = _placed(test, tmp_path, pairs=pairs)
    assert (found.points or {})[node.node].link == node.other
    assert node.node not in found.doubts


def test_sensors_that_all_stand_above_the_surface_are_not_doubted() -> None:
    """What is to be looked at is a height that others do not have."""
    one = Node(1, "arm", np.zeros(3), np.eye(3), np.eye(3)[2], 0.02, 0.003, 1.0, "")
    own = Registration((one,), np.eye(4), np.zeros(1), np.zeros(1), 1.0, 0.018, 0.003, {}, 0)
    assert not list(doubts_of(one, own, ()))
    assert list(doubts_of(one, replace(own, height_m=0.0), ())) == ["20 mm above the surface"]


def test_pairs_of_other_nodes_are_refused(tmp_path: Path) -> None:
    test = simulated(tmp_path, 1)
    pairs = test.pairs(tmp_path, [0, 1, 2])
    pairs.write_text(pairs.read_text().replace("\n2,", "\n200,"))
    with pytest.raises(InputError, match="nodes 200"):
        _placed(test, tmp_path, pairs=pairs)


def test_two_nodes_do_not_tell_how_they_lie(tmp_path: Path) -> None:
    test = simulated(tmp_path, 1)
    lines = test.uff.read_text().splitlines()
    start = lines.index("    15") + 1
    test.uff.write_text("\n".join([*lines[: start + 2], "    -1"]) + "\n")
    with pytest.raises(InputError, match="three or more"):
        _placed(test, tmp_path)


def test_what_is_to_be_looked_at_of_a_node() -> None:
    one = Node(5, "arm", np.zeros(3), np.eye(3), np.array([0, 0, 1.0]), 0.05, 0.004, 0.7, "foot")
    found = Registration((one,), np.eye(4), np.zeros(1), np.zeros(1), 1.0, 0.0, 0.004, {}, 0)
    said = list(doubts_of(one, found, {1}))
    assert said[0] == "on arm (70 %) or on foot"
    assert said[1] == "50 mm above the surface"
    assert said[2] == "its only axis, X, is 90° from the normal of the surface"
    sure = replace(one, probability=1.0, height_m=0.005)
    assert list(doubts_of(sure, found, {3})) == list(doubts_of(sure, found, {1, 2, 3})) == []
    assert list(doubts_of(replace(one, link=""), found, {1})) == ["on no link: it is left out"]


def test_another_number_of_angles_is_refused(tmp_path: Path) -> None:
    test = simulated(tmp_path, 1)
    with pytest.raises(InputError, match="one per joint"):
        api.points(test.arm.file, [test.uff], posture="0,0", out=tmp_path / "points.csv")


def test_init_leaves_points_to_the_geometry_beside_the_frfs(tmp_path: Path) -> None:
    test = simulated(tmp_path, 7, off_deg=1.0)
    both = tmp_path / "both.uff"
    both.write_bytes(test.uff.read_bytes() + (DATA / "posture1.uff").read_bytes())
    config = tmp_path / "config.yaml"
    words = ["init", str(test.arm.file), str(both), "--out", str(config)]
    shown = CliRunner().invoke(app, [*words, "--posture", test.posture])
    assert shown.exit_code == 0, shown.output
    text = config.read_text()
    assert f"posture_deg: [{test.stated[0]:.3f}" in text
    assert "\npoints:" not in text and "the geometry of both.uff is laid on the robot" in text
    assert "identify points" in shown.output and "which does not exist" not in shown.output
    pairs = test.pairs(tmp_path, widest(test.nodes))  # without, it takes many starts
    filled = text.replace("averages: null", "averages: 4")
    config.write_text(f"{filled}\nregistration: {{pairs: {pairs.name}}}\n")
    laid = load_problem(read_study(config)).points
    _placed(replace(test, uff=both), tmp_path, pairs=pairs)
    written = read_points(tmp_path / "points.csv")
    assert laid.keys() == written.keys()
    for node, point in written.items():
        assert laid[node].link == point.link
        np.testing.assert_array_equal(laid[node].position, point.position)
        np.testing.assert_array_equal(laid[node].axes, point.axes)


def test_init_asks_for_points_where_the_robot_has_no_surface(tmp_path: Path) -> None:
    test = simulated(tmp_path, 7)
    both = tmp_path / "both.uff"
    both.write_bytes(test.uff.read_bytes() + (DATA / "posture1.uff").read_bytes())
    (tmp_path / "robot.urdf").write_text((DATA / "robot.urdf").read_text())
    words = ["init", str(tmp_path / "robot.urdf"), str(both), "--out", str(tmp_path / "config.yaml")]
    shown = CliRunner().invoke(app, words)
    assert shown.exit_code == 0, shown.output
    assert "which does not exist" in shown.output
    assert "points: points.csv" in (tmp_path / "config.yaml").read_text()


_RAIL = """<robot name="rail" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="kg" default="1"/>
<link name="floor"/><link name="foot"/><link name="arm"><inertial><mass value="$(arg kg)"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="hand"/>
<joint name="lift" type="revolute"><parent link="floor"/><child link="foot"/><axis xyz="0 0 1"/></joint>
<joint name="turn" type="revolute"><parent link="foot"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="grip" type="revolute"><parent link="arm"/><child link="hand"/><axis xyz="0 0 1"/></joint></robot>
"""


def test_points_are_on_the_arm_that_is_told(tmp_path: Path) -> None:
    (tmp_path / "rail.xacro").write_text(_RAIL)
    words = ["points", str(tmp_path / "rail.xacro"), "--out", str(tmp_path / "points.csv"), "--posture", "30"]
    told = ["--tip", "arm", "--lock", "lift=0.3", "--argument", "kg=3"]
    assert CliRunner().invoke(app, [*words, *told]).exit_code == 0
    refused = CliRunner().invoke(app, words)
    assert isinstance(refused.exception, InputError)
    assert "one per joint (lift, turn, grip)" in str(refused.exception)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"page": "robot.urdf"}, "an input, which would be overwritten"),
        ({"page": "points.csv"}, "which is the file of points"),
        ({"pairs": "pairs.csv"}, "no geometry in the data"),
        ({"length_unit": "mm"}, "no geometry in the data"),
        ({"posture": "nan,0,0,0,0,0"}, "expected angles in degrees"),
        ({"lock": ["a=1", "a=2"]}, "'a' twice"),
    ],
)
def test_options_of_points_that_change_nothing_or_harm(
    tmp_path: Path, options: dict[str, Any], said: str
) -> None:
    text = (DATA / "robot.urdf").read_text()
    (tmp_path / "robot.urdf").write_text(text)
    files = {name: tmp_path / value for name, value in options.items() if name in ("page", "pairs")}
    with pytest.raises(InputError, match=said):
        api.points(tmp_path / "robot.urdf", out=tmp_path / "points.csv", **{**options, **files})
    assert (tmp_path / "robot.urdf").read_text() == text
