"""Which joints of a description are the arm, and where the others are held."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.robot.chain import Choice
from identify.robot.description import Robot
from identify.robot.units import RobotUnits
from identify.robot.urdf import read_urdf

INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def described(folder: Path, links: str, *joints: str) -> Path:
    """A file with links by name, and joints as `name kind parent child`, with further elements after `|`."""
    parts = [f'<link name="{name}">{INERTIAL}</link>' for name in links.split()]
    for joint in joints:
        words, _, more = joint.partition("|")
        name, kind, parent, child = words.split()
        parts.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 1"/><axis xyz="0 0 1"/>{more}</joint>'
        )
    path = folder / "robot.urdf"
    path.write_text(f'<robot name="test">{"".join(parts)}</robot>')
    return path


def names(robot: Robot) -> list[str]:
    return [joint.name for joint in robot.joints]


def mass(robot: Robot) -> float:
    return sum(link.mass for link in robot.links)


def test_a_rail_is_held_where_it_is_told(tmp_path: Path) -> None:
    path = described(tmp_path, "base car arm", "rail prismatic base car", "hinge revolute car arm")
    arm = read_urdf(path, choice=Choice(lock={"rail": 1.5}))
    assert names(arm) == ["hinge"]
    assert arm.joints[0].origin[:3, 3] == pytest.approx([0, 0, 1 + 1.5 + 1])
    assert "held: rail at 1.5 m" in arm.notes[0]
    in_mm = read_urdf(path, choice=Choice(lock={"rail": 1.5}), units=RobotUnits(length="mm"))
    assert in_mm.joints[0].origin[2, 3] == pytest.approx(1.502)


def test_a_rail_that_is_not_told_is_at_zero_or_its_nearer_limit(tmp_path: Path) -> None:
    limit = '<limit lower="0.4" upper="2"/>'
    path = described(tmp_path, "base car arm", f"rail prismatic base car|{limit}", "hinge revolute car arm")
    assert read_urdf(path).joints[0].origin[2, 3] == pytest.approx(2.4)


def test_a_hand_is_held_with_all_its_mass(tmp_path: Path) -> None:
    """Fingers of the same number of joints, none longer than the arm: it ends there."""
    path = described(
        tmp_path,
        "base a b left right",
        "one revolute base a",
        "two revolute a b",
        "finger1 revolute b left",
        "finger2 revolute b right",
    )
    arm = read_urdf(path, choice=Choice(lock={"finger1": np.pi / 2}))
    assert names(arm) == ["one", "two", "finger2"]  # one finger told, the other is then the longest way
    arm = read_urdf(path)
    assert (names(arm), mass(arm)) == (["one", "two"], 10)
    assert set(arm.frames) == {"left", "right"}
    assert "finger1 at 0 rad and finger2 at 0 rad" in arm.notes[0]


def test_fingers_that_mimic_follow_the_one_that_is_held(tmp_path: Path) -> None:
    mimic = '<mimic joint="finger1" multiplier="-2" offset="0.1"/>'
    path = described(
        tmp_path,
        "base a left right",
        "one revolute base a",
        "finger1 revolute a left",
        f"finger2 revolute a right|{mimic}",
    )
    arm = read_urdf(path, choice=Choice(lock={"finger1": 0.3}))
    turned = arm.frames["right"][1][:3, :3]
    assert names(arm) == ["one"]
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(-0.5)


def test_a_mimic_that_carries_the_rest_of_the_arm_is_a_joint_when_its_tip_is_asked_for(
    tmp_path: Path,
) -> None:
    mimic = '<mimic joint="one" multiplier="-1"/>'
    path = described(
        tmp_path, "base a b c", "one revolute base a", f"two revolute a b|{mimic}", "three revolute b c"
    )
    arm = read_urdf(path, choice=Choice("c"))
    assert names(arm) == ["one", "two", "three"]
    assert "two mimics another joint" in arm.notes[0]


def test_several_arms_are_to_be_chosen_from(tmp_path: Path) -> None:
    joints = ["l1 revolute base la", "l2 revolute la lb", "r1 revolute base ra", "r2 revolute ra rb"]
    path = described(tmp_path, "base la lb ra rb", *joints)
    with pytest.raises(
        InputError, match=r"2 chains of 2 moving joints leave link 'base'.*such as 'lb' or 'rb'"
    ):
        read_urdf(path)
    left = read_urdf(path, choice=Choice("lb"))
    assert (names(left), mass(left)) == (["l1", "l2"], 10)
    assert [link.name for link in left.links] == ["base", "la", "lb"]


def test_the_longest_chain_is_the_arm(tmp_path: Path) -> None:
    joints = ["pan revolute base head", "one revolute base a", "two revolute a b"]
    arm = read_urdf(described(tmp_path, "base head a b", *joints))
    assert names(arm) == ["one", "two"]
    assert arm.frames["head"][0] == "base"


def test_a_closed_parallelogram_is_cut(tmp_path: Path) -> None:
    joints = ["one revolute base a", "two revolute a b", "rod revolute base c", "closing revolute c b"]
    arm = read_urdf(described(tmp_path, "base a b c", *joints))
    assert names(arm) == ["one", "two"]
    assert arm.notes[0].startswith("joint 'closing' closes a loop: it was cut")
    assert arm.frames["c"][0] == "base"


def test_what_nothing_joins_to_the_arm_is_left_out(tmp_path: Path) -> None:
    arm = read_urdf(described(tmp_path, "base arm lost", "one revolute base arm"))
    assert (names(arm), mass(arm)) == (["one"], 4)
    assert arm.notes == ("nothing joins lost to the arm: left out",)
    path = described(tmp_path, "base a other b", "one revolute base a", "two revolute other b")
    with pytest.raises(InputError, match="2 links have no parent"):
        read_urdf(path)
    assert names(read_urdf(path, choice=Choice("b"))) == ["two"]


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_what_floats_is_held(tmp_path: Path, kind: str) -> None:
    path = described(tmp_path, "world base arm", f"free {kind} world base", "one revolute base arm")
    arm = read_urdf(path)
    assert (names(arm), arm.links[0].mass) == (["one"], 4)


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        (Choice("nobody"), "unknown link 'nobody'; expected one of base, arm"),
        (Choice(lock={"knee": 0.0}), "unknown joint 'knee'; expected one of one"),
        (Choice("base"), "no joint moves link 'base'"),
        (Choice(lock={"one": 0.0}), "no moving joint"),
    ],
)
def test_a_choice_that_cannot_be_is_refused(tmp_path: Path, choice: Choice, sentence: str) -> None:
    path = described(tmp_path, "base arm", "one revolute base arm")
    with pytest.raises(InputError, match=sentence):
        read_urdf(path, choice=choice)


def test_a_base_may_have_any_inertia(tmp_path: Path) -> None:
    path = described(tmp_path, "base arm", "one revolute base arm")
    path.write_text(path.read_text().replace('ixx="1"', 'ixx="-1"', 1))
    arm = read_urdf(path)
    assert arm.links[0].mass == 0
    assert arm.notes[0].startswith("the inertia of the base 'base' is not used: principal moments")


def test_bodies_that_cannot_be_are_kept_apart_where_asked(tmp_path: Path) -> None:
    path = described(tmp_path, "base a b", "one revolute base a", "two revolute a b")
    text = path.read_text()
    before, link, after = text.partition('<link name="a">')
    path.write_text(before + link + after.replace('ixx="1"', 'ixx="3"', 1))
    with pytest.raises(InputError, match="the largest exceeds the sum"):
        read_urdf(path)
    arm = read_urdf(path, any_bodies=True)
    assert [link.mass for link in arm.links] == [2, 2, 2]
    assert not np.any(arm.links[1].inertia) and np.any(arm.links[2].inertia)
