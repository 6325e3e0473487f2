"""URDF files: what is merged, what becomes a frame, and every way in which a file is refused."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.urdf import read_urdf
from tests.robot.random_arm import general_arm, industrial_arm, random_posture, write
from tests.shared import shared

INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
BASE = f'<link name="base">{INERTIAL}</link>'
ARM = f'<link name="arm">{INERTIAL}</link>'
HINGE = (
    '<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>'
)


def fixed(parent: str, child: str, origin: str = "") -> str:
    return (
        f'<joint name="{parent}_{child}" type="fixed"><parent link="{parent}"/><child'
        f' link="{child}"/>{origin}</joint>'
    )


def robot(*parts: str) -> str:
    return "\n".join(['<robot name="test">', *parts, "</robot>"])


def test_two_links_and_a_hinge(tmp_path: Path) -> None:
    arm = read_urdf(write(tmp_path, robot(BASE, ARM, HINGE)))
    assert (arm.name, [link.name for link in arm.links], [joint.name for joint in arm.joints]) == (
        "test",
        ["base", "arm"],
        ["hinge"],
    )
    assert (arm.joints[0].lower, arm.joints[0].upper) == (-np.inf, np.inf)
    assert arm.gravity.tolist() == [0, 0, -9.81]
    assert arm.frames == {}


def test_axis_is_normalised_and_x_by_default(tmp_path: Path) -> None:
    assert read_urdf(write(tmp_path, robot(BASE, ARM, HINGE.replace("0 0 1", "0 -3 4")))).joints[
        0
    ].axis == pytest.approx([0, -0.6, 0.8])
    assert read_urdf(write(tmp_path, robot(BASE, ARM, HINGE.replace('<axis xyz="0 0 1"/>', "")))).joints[
        0
    ].axis == pytest.approx([1, 0, 0])


def test_limits_hold_for_revolute_joints_only(tmp_path: Path) -> None:
    limited = HINGE.replace("</joint>", '<limit lower="-1" upper="2"/></joint>')
    joint = read_urdf(write(tmp_path, robot(BASE, ARM, limited))).joints[0]
    assert (joint.lower, joint.upper) == (-1, 2)
    endless = read_urdf(write(tmp_path, robot(BASE, ARM, limited.replace("revolute", "continuous")))).joints[
        0
    ]
    assert (endless.lower, endless.upper) == (-np.inf, np.inf)


angles = st.floats(-np.pi, np.pi)


def turned(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll), as the format defines it."""
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(angle), np.sin(angle)) for angle in (roll, pitch, yaw))
    z, y = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]), np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return np.asarray(z @ y @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]]))


@settings(max_examples=50, deadline=None)
@given(roll=angles, pitch=angles, yaw=angles)
def test_rpy_turns_joint_origins_and_inertias(roll: float, pitch: float, yaw: float) -> None:
    origin = f'<origin xyz="0.1 0.2 0.3" rpy="{roll!r} {pitch!r} {yaw!r}"/>'
    text = robot(
        BASE,
        ARM.replace('<mass value="2"/>', f'{origin}<mass value="2"/>').replace('ixx="1"', 'ixx="1.5"'),
        HINGE.replace("<axis", f"{origin}<axis"),
    )
    with tempfile.TemporaryDirectory() as folder:
        arm = read_urdf(write(Path(folder), text))
    turn = turned(roll, pitch, yaw)
    assert arm.joints[0].origin[:3, :3] == pytest.approx(turn, abs=1e-12)
    assert arm.joints[0].origin[:3, 3] == pytest.approx([0.1, 0.2, 0.3])
    assert arm.links[1].centre == pytest.approx([0.1, 0.2, 0.3])
    assert arm.links[1].inertia == pytest.approx(turn @ np.diag([1.5, 1, 1]) @ turn.T, abs=1e-12)


def test_what_a_fixed_joint_holds_is_merged_and_stays_a_frame(tmp_path: Path) -> None:
    tool = f'<link name="tool">{INERTIAL}</link><link name="tip"/>'
    joints = fixed("arm", "tool", '<origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>') + fixed(
        "tool", "tip", '<origin xyz="1 0 0"/>'
    )
    arm = read_urdf(write(tmp_path, robot(BASE, ARM, tool, HINGE, joints)))
    link = arm.links[1]
    assert (link.name, link.mass) == ("arm", 4)
    assert link.centre == pytest.approx([0.5, 0, 0])
    assert link.inertia == pytest.approx(np.diag([2, 2 + 4 * 0.25, 2 + 4 * 0.25]))
    assert arm.frames["tip"][0] == "arm"
    assert arm.frames["tip"][1][:3, 3] == pytest.approx([1, 1, 0])


def test_a_joint_may_leave_a_merged_link(tmp_path: Path) -> None:
    text = robot(
        BASE,
        ARM,
        '<link name="flange"/>',
        fixed("base", "flange", '<origin xyz="0 0 1"/>'),
        HINGE.replace('parent link="base"', 'parent link="flange"').replace(
            "<axis", '<origin xyz="0 2 0"/><axis'
        ),
    )
    arm = read_urdf(write(tmp_path, text))
    assert (arm.joints[0].parent, arm.links[0].name) == ("base", "base")
    assert arm.joints[0].origin[:3, 3] == pytest.approx([0, 2, 1])


@pytest.mark.parametrize(
    "rpy, gravity", [("3.141592653589793 0 0", [0, 0, 9.81]), ("0 1.5707963267948966 0", [9.81, 0, 0])]
)
def test_world_above_the_base_becomes_a_frame_and_turns_gravity(
    tmp_path: Path, rpy: str, gravity: list[float]
) -> None:
    stand = fixed("world", "base", f'<origin xyz="0 0 2" rpy="{rpy}"/>')
    arm = read_urdf(write(tmp_path, robot('<link name="world"/>', BASE, ARM, stand, HINGE)))
    assert arm.links[0].name == "base"
    assert arm.gravity == pytest.approx(gravity)
    carrier, world = arm.frames["world"]
    assert carrier == "base"
    assert (world @ [0, 0, 2, 1])[:3] == pytest.approx(np.zeros(3), abs=1e-12)


def test_the_base_is_the_first_link_with_inertia(tmp_path: Path) -> None:
    """As in the files of a well-known arm: world, base_link without inertia, and its inertia in a link of its
    own.
    """
    hinge = HINGE.replace('"base"', '"base_inertia"')
    parts = [
        '<link name="world"/><link name="base_link"/><link name="side"/>',
        BASE.replace('"base"', '"base_inertia"'),
        ARM,
        hinge,
        fixed("world", "base_link"),
        fixed("base_link", "base_inertia"),
        fixed("base_link", "side"),
    ]
    arm = read_urdf(write(tmp_path, robot(*parts)))
    assert arm.links[0].name == "base_inertia"
    assert set(arm.frames) == {"world", "base_link", "side"}


def test_a_base_without_inertia_has_mass_zero(tmp_path: Path) -> None:
    arm = read_urdf(
        write(tmp_path, robot('<link name="world"/><link name="base"/>', ARM, HINGE, fixed("world", "base")))
    )
    assert (arm.links[0].name, arm.links[0].mass) == ("base", 0)
    assert Engine(at_posture(arm, np.zeros(1))).mass_matrix().shape == (6, 6)


def test_a_base_of_zero_inertia_is_one_that_is_not_known(tmp_path: Path) -> None:
    """Public robots write it so: the base does not move, and an effect that moves it is refused."""
    arm = read_urdf(write(tmp_path, robot(BASE.replace('="1"', '="0"'), ARM, HINGE)))
    assert (arm.links[0].mass, arm.links[1].mass) == (0, 2)
    assert Engine(at_posture(arm, np.zeros(1))).mass_matrix().shape == (6, 6)


def test_a_fixed_joint_needs_no_axis(tmp_path: Path) -> None:
    """Exporters write 0 0 0 there, which the format does not forbid."""
    held = fixed("arm", "tip", '<axis xyz="0 0 0"/>')
    arm = read_urdf(write(tmp_path, robot(BASE, ARM, '<link name="tip"/>', HINGE, held)))
    assert set(arm.frames) == {"tip"}


@pytest.mark.parametrize(
    "name",
    [
        "fixed_axis_000.urdf",
        "robots/fixed_joint_with_zero_axis.urdf",
        "robots/base_with_zero_inertia.urdf",
        "robots/good.urdf",
    ],
)
def test_reported_robots_are_read(name: str) -> None:
    assert len(read_urdf(shared("reported", *name.split("/"))).joints) >= 2


def test_massless_frames_with_a_zero_inertial_are_frames(tmp_path: Path) -> None:
    tip = (
        '<link name="tip"><inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0"'
        ' iyz="0"/></inertial></link>'
    )
    arm = read_urdf(write(tmp_path, robot(BASE, ARM, tip, HINGE, fixed("arm", "tip"))))
    assert arm.links[1].mass == 2


def test_order_in_the_file_does_not_matter(tmp_path: Path) -> None:
    lines = industrial_arm(4).splitlines()
    posture = random_posture(4)
    masses = []
    for text in ("\n".join(lines), "\n".join([lines[0], *reversed(lines[1:-1]), lines[-1]])):
        masses.append(Engine(at_posture(read_urdf(write(tmp_path, text)), posture)).mass_matrix())
    assert np.array_equal(*masses)


def test_a_file_made_elsewhere_is_read() -> None:
    arm = read_urdf(shared("hidden", "none_101", "robot.urdf"))
    assert [link.name for link in arm.links] == ["base_link", *(f"link{number}" for number in range(1, 7))]
    assert arm.links[3].mass == 60.250907


SECOND = HINGE.replace("hinge", "second")
REFUSED = {
    "unknown type": (robot(BASE, ARM, HINGE.replace("revolute", "rotary")), 'unknown joint type "rotary"'),
    "unknown parent": (
        robot(BASE, ARM, HINGE.replace('"base"', '"bass"')),
        "unknown parent link 'bass'; expected one of base, arm",
    ),
    "unknown child": (robot(BASE, ARM, HINGE.replace('"arm"', '"harm"')), "unknown child link 'harm'"),
    "loop": (
        robot(
            BASE,
            ARM,
            HINGE,
            SECOND.replace('"base"', '"x"').replace('"arm"', '"base"').replace('"x"', '"arm"'),
        ),
        "link 'base' is part of a loop",
    ),
    "loop aside": (
        robot(BASE, ARM, HINGE, '<link name="a"/><link name="b"/>', fixed("a", "b"), fixed("b", "a")),
        "link 'a' is part of a loop",
    ),
    "no link": (robot(), "no link"),
    "no moving joint": (robot(BASE, ARM, HINGE.replace("revolute", "fixed")), "no moving joint"),
    "no inertial": (
        robot(BASE, '<link name="arm"/>', HINGE),
        "line 3, <link name=\"arm\">: link 'arm' is moved by joint 'hinge' but has no mass or inertia",
    ),
    "tool frame that moves": (
        robot(
            BASE,
            ARM,
            '<link name="tool"/>',
            HINGE,
            SECOND.replace('"arm"', '"tool"').replace('"base"', '"arm"'),
        ),
        "link 'tool' is moved by joint 'second' but has no mass",
    ),
    "no mass": (
        robot(BASE, ARM.replace('<mass value="2"/>', ""), HINGE),
        "element <mass> is missing; add <mass .../> to link 'arm'",
    ),
    "no inertia": (
        robot(BASE, ARM.replace("<inertia ", "<inertias "), HINGE),
        "element <inertia> is missing",
    ),
    "no ixy": (
        robot(BASE, ARM.replace('ixy="0"', ""), HINGE),
        "<inertia> of link 'arm': attribute \"ixy\" is missing",
    ),
    "negative mass": (
        robot(BASE, ARM.replace('"2"', '"-2"'), HINGE),
        'line 3, <link name="arm">: mass -2 kg is not positive',
    ),
    "zero mass": (robot(BASE, ARM.replace('"2"', '"0"'), HINGE), "mass 0 kg is not positive"),
    "inertia too long": (
        robot(BASE, ARM.replace('ixx="1"', 'ixx="3"'), HINGE),
        r"\[1.0, 1.0, 3.0\] kg m\^2: the largest exceeds the sum",
    ),
    "inertia of a bracket": (
        robot(BASE, ARM, ARM.replace('"arm"', '"b"').replace('ixx="1"', 'ixx="3"'), HINGE, fixed("arm", "b")),
        'line 4, <link name="b">: principal moments',
    ),
    "point mass that moves": (robot(BASE, ARM.replace('="1"', '="0"'), HINGE), "are not all positive"),
    "mass of NaN": (robot(BASE, ARM.replace('"2"', '"nan"'), HINGE), 'value="nan"; expected 1 finite number'),
    "mass of two": (
        robot(BASE, ARM.replace('"2"', '"2 kg"'), HINGE),
        'value="2 kg"; expected 1 finite number',
    ),
    "xacro value": (robot(BASE, ARM.replace('"2"', '"${m}"'), HINGE), "xacro says: name 'm' is not defined"),
    "sdf": ("<sdf/>", "this is an SDF file; expected a URDF, xacro or MJCF file"),
    "another kind of XML": ("<world/>", "line 1, <world>: the root element is <world>; expected <robot>"),
    "zero axis": (
        robot(BASE, ARM, HINGE.replace("0 0 1", "0 0 0")),
        "<axis> of joint 'hinge': the axis has no direction",
    ),
    "axis of two": (robot(BASE, ARM, HINGE.replace("0 0 1", "0 1")), 'xyz="0 1"; expected 3 finite numbers'),
    "axis without xyz": (
        robot(BASE, ARM, HINGE.replace('xyz="0 0 1"', "")),
        "<axis> of joint 'hinge': attribute \"xyz\" is missing",
    ),
    "joint without type": (
        robot(BASE, ARM, HINGE.replace('type="revolute"', "")),
        '<joint name="hinge">: attribute "type" is missing',
    ),
    "joint without parent": (
        robot(BASE, ARM, HINGE.replace('<parent link="base"/>', "")),
        "element <parent> is missing",
    ),
    "parent without link": (
        robot(BASE, ARM, HINGE.replace('parent link="base"', "parent")),
        "<parent> of joint 'hinge': attribute",
    ),
    "link without name": (robot("<link/>", ARM, HINGE), 'line 2, <link>: attribute "name" is missing'),
    "limits crossed": (
        robot(BASE, ARM, HINGE.replace("</joint>", '<limit lower="1" upper="-1"/></joint>')),
        "lower limit 1 rad above",
    ),
    "link twice": (robot(BASE, ARM, ARM, HINGE), "line 4, <link name=\"arm\">: a second link named 'arm'"),
    "joint twice": (
        robot(BASE, ARM, HINGE, HINGE),
        "line 5, <joint name=\"hinge\">: a second joint named 'hinge'",
    ),
    "broken": ("<robot>\n<link>\n</robot>", r"robot.urdf line 3: broken XML \(mismatched tag\)"),
    "empty": ("", "robot.urdf line 1: broken XML"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_with_file_and_element(tmp_path: Path, case: str) -> None:
    text, sentence = REFUSED[case]
    with pytest.raises(InputError, match=sentence) as caught:
        read_urdf(write(tmp_path, text))
    assert caught.value.where.startswith("robot.urdf")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_urdf(tmp_path / "nothing.urdf")


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_file_cut_anywhere_is_refused(data: st.DataObject) -> None:
    text = general_arm(1, joints=2)
    cut = text[: data.draw(st.integers(0, len(text) - 1))]
    with tempfile.TemporaryDirectory() as folder, pytest.raises(InputError):
        read_urdf(write(Path(folder), cut))


@settings(max_examples=60, deadline=None)
@given(data=st.data(), junk=st.sampled_from(["", "x", "nan", "inf", "1,5", "1e999"]))
def test_junk_in_place_of_any_number_is_refused(data: st.DataObject, junk: str) -> None:
    words = industrial_arm(2).split('"')
    numbers = [
        place
        for place, word in enumerate(words)
        if place % 2
        and word[:1] in "-0123456789."
        and "effort" not in words[place - 1]
        and "velocity" not in words[place - 1]
    ]
    words[data.draw(st.sampled_from(numbers))] = junk
    with tempfile.TemporaryDirectory() as folder, pytest.raises(InputError, match=r"robot\.urdf line"):
        read_urdf(write(Path(folder), '"'.join(words)))
