"""Denavit-Hartenberg tables: against textbook transforms, a URDF of the same arm, a published robot; and
every fault a file can have.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError, InputErrors
from identify.robot.dh import __doc__ as described
from identify.robot.dh import read_dh
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.urdf import read_urdf
from tests.robot.dh_arms import as_urdf, link_transform, other_convention, random_table, write_table
from tests.robot.random_arm import random_posture, write


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6), convention=st.sampled_from(["standard", "modified"]), joints=st.integers(1, 7)
)
def test_frames_are_where_textbook_transforms_put_them(seed: int, convention: str, joints: int) -> None:
    table, posture = random_table(seed, convention, joints), random_posture(seed, joints)
    with tempfile.TemporaryDirectory() as folder:
        engine = Engine(at_posture(read_dh(write_table(Path(folder), table)), posture))
    frame, point = np.eye(4), np.array([0.1, -0.2, 0.3])
    for row, link, angle in zip(table["joints"], table["links"], posture, strict=True):
        frame = frame @ link_transform(row, convention, angle)
        assert engine.position(link["name"], point) == pytest.approx(
            frame[:3, :3] @ point + frame[:3, 3], abs=1e-12
        )
        drive = engine.mechanism.coordinate(f"{row['name']}.rz", "test")
        at_joint = engine.jacobian(link["name"], np.zeros(3))[:, drive]
        axis = (
            frame[:3, 2]
            if convention == "modified"
            else (frame @ np.linalg.inv(link_transform(row, convention, angle)))[:3, 2]
        )
        assert frame[:3, :3] @ at_joint[3:] == pytest.approx(axis, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_a_table_and_a_urdf_of_the_same_arm_move_alike(tmp_path: Path, convention: str, seed: int) -> None:
    table, posture = random_table(seed, convention), random_posture(seed)
    table["base_pose"], table["gravity_m_s2"] = {}, [0, 0, -9.81]
    one = Engine(at_posture(read_dh(write_table(tmp_path, table)), posture))
    other = Engine(at_posture(read_urdf(write(tmp_path, as_urdf(table))), posture))
    assert one.mass_matrix() == pytest.approx(other.mass_matrix(), rel=1e-8, abs=1e-9)
    assert one.gravity_stiffness() == pytest.approx(other.gravity_stiffness(), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_the_two_conventions_of_one_arm_move_alike(tmp_path: Path, seed: int) -> None:
    table, posture = random_table(seed, "standard"), random_posture(seed)
    one = Engine(at_posture(read_dh(write_table(tmp_path, table)), posture))
    other = Engine(at_posture(read_dh(write_table(tmp_path, other_convention(table))), posture))
    assert one.mass_matrix() == pytest.approx(other.mass_matrix(), rel=1e-8, abs=1e-9)
    assert one.gravity_stiffness() == pytest.approx(other.gravity_stiffness(), rel=1e-6, abs=1e-6)


PUMA = """
name: Puma 560
convention: standard
joints:
  - {name: waist, d_m: 0, a_m: 0, alpha_deg: 90}
  - {name: shoulder, d_m: 0, a_m: 0.4318, alpha_deg: 0}
  - {name: elbow, d_m: 0.15005, a_m: 0.0203, alpha_deg: -90}
  - {name: roll, d_m: 0.4318, a_m: 0, alpha_deg: 90}
  - {name: pitch, d_m: 0, a_m: 0, alpha_deg: -90}
  - {name: yaw, d_m: 0, a_m: 0, alpha_deg: 0}
# The published inertia of link 3, [0.066, 0.086, 0.0125], breaks the triangle inequality: the test puts it in behind the reader's back.
links:  # The publication gives link 1 no mass and only its inertia about axis 1, which is all that counts
  - {name: link1, mass_kg: 1, centre_m: [0, 0, 0], inertia_kg_m2: [0.35, 0.35, 0.35, 0, 0, 0]}
  - {name: link2, mass_kg: 17.4, centre_m: [-0.3638, 0.006, 0.2275], inertia_kg_m2: [0.13, 0.524, 0.539, 0, 0, 0]}
  - {name: link3, mass_kg: 4.8, centre_m: [-0.0203, -0.0141, 0.070], inertia_kg_m2: [0.066, 0.076, 0.0125, 0, 0, 0]}
  - {name: link4, mass_kg: 0.82, centre_m: [0, 0.019, 0], inertia_kg_m2: [1.8e-3, 1.3e-3, 1.8e-3, 0, 0, 0]}
  - {name: link5, mass_kg: 0.34, centre_m: [0, 0, 0], inertia_kg_m2: [0.3e-3, 0.4e-3, 0.3e-3, 0, 0, 0]}
  - {name: link6, mass_kg: 0.09, centre_m: [0, 0, 0.032], inertia_kg_m2: [0.15e-3, 0.15e-3, 0.04e-3, 0, 0, 0]}
"""  # noqa: E501
PUMA_ROTORS = (
    np.array([62.6111, 107.815, 53.7063, 76.0364, 71.923, 76.686]) ** 2
    * np.array([200, 200, 200, 33, 33, 33])
    * 1e-6
)
PUMA_MASS = [
    [3.6594, -0.4044, 0.1006, -0.0025, 0, 0],
    [-0.4044, 4.4137, 0.3509, 0, 0.0024, 0],
    [0.1006, 0.3509, 0.9378, 0, 0.0015, 0],
    [-0.0025, 0, 0, 0.1925, 0, 0],
    [0, 0.0024, 0.0015, 0, 0.1713, 0],
    [0, 0, 0, 0, 0, 0.1941],
]


def test_puma_560_has_its_published_pose_and_inertia(tmp_path: Path) -> None:
    """Corke, Robotics, Vision and Control (2011), sections 7.2 and 9.2: fkine(qn) and inertia(qn), rotors
    behind their gears included.
    """
    path = tmp_path / "puma.yaml"
    path.write_text(PUMA, encoding="utf-8")
    robot = read_dh(path)
    published = replace(robot.links[3], inertia=np.diag([0.066, 0.086, 0.0125]))
    robot = replace(robot, links=(*robot.links[:3], published, *robot.links[4:]))
    engine = Engine(at_posture(robot, np.array([0, np.pi / 4, np.pi, 0, np.pi / 4, 0])))
    assert engine.position("link6", np.zeros(3)) == pytest.approx([0.5963, -0.1501, -0.01435], abs=6e-5)
    drives = [6 * number + 5 for number in range(6)]
    mass = engine.mass_matrix()[np.ix_(drives, drives)] + np.diag(PUMA_ROTORS)
    assert mass == pytest.approx(np.array(PUMA_MASS), abs=6e-5)


def example() -> str:
    """The table in the module's own description."""
    lines = (described or "").splitlines()
    return "\n".join(line[4:] for line in lines if line.startswith("    "))


def test_the_described_example_is_read_as_described(tmp_path: Path) -> None:
    path = tmp_path / "example.yaml"
    path.write_text(example(), encoding="utf-8")
    robot = read_dh(path)
    assert [link.name for link in robot.links] == ["base", "shoulder", "arm"]
    assert [joint.name for joint in robot.joints] == ["joint1", "joint2"]
    assert (robot.joints[0].lower, robot.joints[0].upper) == pytest.approx(
        (-np.radians(170), np.radians(170))
    )
    assert robot.joints[1].upper == np.inf
    assert robot.links[2].inertia == pytest.approx(np.diag([0.4, 1.9, 1.9]))
    assert robot.frames["flange"][0] == "arm"
    engine = Engine(at_posture(robot, np.zeros(2)))
    assert engine.position("ground", np.zeros(3)) == pytest.approx([0, 0, -0.6])


def test_base_pose_turns_gravity_into_the_base(tmp_path: Path) -> None:
    table = random_table(1, "standard")
    table["gravity_m_s2"], table["base_pose"] = [0, 0, -9.81], {"rpy_deg": [180, 0, 0]}
    assert read_dh(write_table(tmp_path, table)).gravity == pytest.approx([0, 0, 9.81])
    table["base_pose"] = {"rpy_deg": [0, 90, 0]}  # the base's x axis points down
    assert read_dh(write_table(tmp_path, table)).gravity == pytest.approx([9.81, 0, 0])


def test_a_base_without_inertia_is_allowed(tmp_path: Path) -> None:
    table = random_table(2, "modified")
    table["base"] = {"name": "foot"}
    robot = read_dh(write_table(tmp_path, table))
    assert (robot.links[0].name, robot.links[0].mass) == ("foot", 0.0)
    del table["base"]
    assert read_dh(write_table(tmp_path, table)).links[0].name == "base"


def test_a_base_of_zero_inertia_is_one_that_is_not_known(tmp_path: Path) -> None:
    table = random_table(2, "modified")
    table["base"] = {"name": "foot", "mass_kg": 90, "centre_m": [0, 0, 0.1], "inertia_kg_m2": [0] * 6}
    assert read_dh(write_table(tmp_path, table)).links[0].mass == 0.0
    table["base"]["mass_kg"] = -1
    with pytest.raises(InputErrors):
        read_dh(write_table(tmp_path, table))


def test_six_numbers_are_the_same_inertia_as_the_matrix(tmp_path: Path) -> None:
    table = random_table(3, "standard")
    matrix = np.array(table["links"][0]["inertia_kg_m2"])
    table["links"][0]["inertia_kg_m2"] = [
        matrix[0, 0],
        matrix[1, 1],
        matrix[2, 2],
        matrix[0, 1],
        matrix[0, 2],
        matrix[1, 2],
    ]
    table["links"][0]["inertia_kg_m2"] = [float(entry) for entry in table["links"][0]["inertia_kg_m2"]]
    assert read_dh(write_table(tmp_path, table)).links[1].inertia == pytest.approx(matrix)


FAULTS: list[tuple[dict[tuple[Any, ...], Any], str]] = [
    (
        {("convention",): "classic"},
        r"robot.yaml line \d+, convention: 'classic'; expected 'standard' or 'modified'",
    ),
    ({("joints", 1, "d_m"): "0.3"}, r"line \d+, joints.1.d_m: '0.3'; expected a valid number"),
    ({("joints", 1, "d_m"): float("nan")}, r"joints.1.d_m: nan; expected a finite number"),
    ({("joints", 1, "alpha_rad"): 1.0}, r"line \d+, joints.1.alpha_rad: unknown key; remove it"),
    ({("joints", 0): {"name": "j"}}, r"joints.0.d_m: this key is missing; add it"),
    ({("joints", 2, "name"): "joint1"}, "joints.2.name: a second joint named 'joint1'"),
    (
        {("joints", 2, "limits_deg"): [10, -10]},
        "joints.2.limits_deg: limits 10, -10; expected lower <= upper",
    ),
    ({("joints",): []}, "joints: "),
    ({("links", 1, "mass_kg"): 0.0}, "links.1: link 'link2': mass 0 kg is not positive"),
    (
        {("links", 1, "inertia_kg_m2"): [1.0, 1.0, 3.0, 0, 0, 0]},
        "links.1: link 'link2': principal moments .* the largest exceeds the sum",
    ),
    ({("links", 1, "inertia_kg_m2"): [1.0, 1.0]}, r"links.1.inertia_kg_m2"),
    (
        {("links", 1, "inertia_kg_m2"): [[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]]},
        "link 'link2': inertia tensor is not symmetric",
    ),
    ({("links", 5): None}, r"links.5"),
    ({("links", 0, "name"): "base"}, "links.0.name: a second link or frame named 'base'"),
    ({("links", 0, "name"): "ground"}, "links.0.name: a second link or frame named 'ground'"),
    ({("frames", 0, "link"): "link9"}, "frames.0.link: unknown link 'link9'; expected one of base, link1"),
    ({("base",): {"mass_kg": 3.0}}, "base: only a part of the inertia is given"),
    ({("base", "mass_kg"): -3.0}, "base: mass -3 kg is not positive"),
]


@pytest.mark.parametrize(
    ("changes", "sentence"), FAULTS, ids=lambda value: value if isinstance(value, str) else ""
)
def test_faults_are_named(tmp_path: Path, changes: dict[tuple[Any, ...], Any], sentence: str) -> None:
    table: Any = random_table(4, "standard")
    for key, value in changes.items():
        part = table
        for step in key[:-1]:
            part = part[step]
        part[key[-1]] = value
    with pytest.raises(InputErrors, match=sentence):
        read_dh(write_table(tmp_path, table))


def test_all_faults_come_at_once_with_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(
        example().replace("d_m: 0.5", "d_m: far").replace("mass_kg: 40", "mass: 40"), encoding="utf-8"
    )
    with pytest.raises(InputErrors) as caught:
        read_dh(path)
    lines = example().splitlines()
    row, link = (
        next(i for i, line in enumerate(lines, start=1) if f"name: {name}," in line)
        for name in ("joint1", "arm")
    )
    assert [error.where for error in caught.value.errors] == [
        f"robot.yaml line {row}, joints.0.d_m",
        f"robot.yaml line {link}, links.1.mass_kg",
        f"robot.yaml line {link}, links.1.mass",
    ]


def test_a_link_too_many_is_refused(tmp_path: Path) -> None:
    table = random_table(5, "standard")
    table["links"].append({**table["links"][0], "name": "gripper"})
    with pytest.raises(InputErrors, match="7 links for 6 joints; expected one link per joint"):
        read_dh(write_table(tmp_path, table))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("name: [a\nconvention: standard\n", r"robot.yaml line \d: broken YAML"),
        ("name: a\nname: b\n", r"robot.yaml line \d: broken YAML"),
        ("name: \x00\n", r"robot.yaml line 1: the control character U\+0000"),
    ],
)
def test_broken_yaml_is_refused(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_dh(path)


@pytest.mark.parametrize("text", ["", "3", "[1, 2]"])
def test_a_file_that_is_no_table_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"robot\.yaml: not a mapping of keys; expected `convention`"):
        read_dh(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nothing\.yaml: the file cannot be read"):
        read_dh(tmp_path / "nothing.yaml")
