"""Link flexibility against cantilevers in closed form and against a chain of many rigid pieces built directly
in MuJoCo.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

from identify.core.errors import InputError
from identify.model.effects.base import EFFECTS, parse_effect
from identify.model.effects.beam import slices
from identify.model.frf import frf_by_solve
from identify.model.system import System, assemble, build_site, list_parameters
from identify.robot.description import Link, Robot
from identify.robot.dh import read_dh
from identify.robot.urdf import read_urdf
from tests.arms import arm, initial
from tests.model.undamped import undamped_modes
from tests.robot.random_arm import general_arm, random_posture, write

ROOT = Path(__file__).parents[3]

LENGTH, EI, EI2, GJ, DRIVES = 1.0, 3e5, 4.5e5, 2e5, 8e5
ROD, LOAD = (30.0, 0.04), (40.0, (0.2, 0.1, 0.3), (1.5, 1.2, 0.9))
URDF = """<robot name="two">
<link name="base_link"/>
<link name="beam"><inertial><origin xyz="0 0 0.5"/><mass value="{m}"/>
<inertia ixx="{i}" iyy="{i}" izz="{t}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="load"><inertial><origin xyz="{c[0]} {c[1]} {c[2]}"/><mass value="{load}"/>
<inertia ixx="{j[0]}" iyy="{j[1]}" izz="{j[2]}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="continuous"><parent link="base_link"/><child link="beam"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/></joint>
<joint name="j2" type="continuous"><parent link="beam"/><child link="load"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint>
</robot>"""  # noqa: E501
POSTURE = np.array([0.0, 0.9])
FLEXIBLE = {
    "kind": "link-flexibility",
    "link": "beam",
    "bending": {"initial": [EI, EI2]},
    "torsion": {"initial": GJ},
}
JOINTS = {"kind": "joint-compliance", "stiffness": {"initial": DRIVES}}


def _robot(
    folder: Path, rod: float = ROD[0], load: float = LOAD[0], centre: tuple[float, ...] = LOAD[1]
) -> Robot:
    """A uniform rod that carries a block, without gravity; `rod` and `load` are their masses."""
    across = rod * ROD[1] ** 2
    text = URDF.format(
        m=rod,
        i=rod * LENGTH**2 / 12 + across,
        t=2 * across,
        load=load,
        c=centre,
        j=[load / LOAD[0] * j for j in LOAD[2]],
    )
    path = folder / "two.urdf"
    path.write_text(text)
    return replace(read_urdf(path), gravity=np.zeros(3))


def _model(
    robot: Robot, effects: list[dict[str, Any]], detached: str | None = None
) -> tuple[System, np.ndarray]:
    parsed = [parse_effect(effect) for effect in effects]
    values = initial(list_parameters(robot, build_site(robot, POSTURE, parsed), parsed))
    return assemble(robot, build_site(robot, POSTURE, parsed, detached), parsed), values


def _frequencies(robot: Robot, effects: list[dict[str, Any]]) -> np.ndarray:
    model, values = _model(robot, effects)
    mass, _, stiffness = model.matrices(values)
    return undamped_modes(mass, stiffness)[0]


def _chain(pieces: int, share: float, flexible: bool = True) -> tuple[mujoco.MjModel, np.ndarray]:
    """The same arm with the rod cut into rigid pieces; and the stiffness of its hinges (coordinates,)."""
    hinges = LENGTH * (0.5 + share * ((np.arange(pieces) + 0.5) / pieces - 0.5))
    edges = np.array([0.0, *hinges, LENGTH])
    stiffness = [DRIVES]
    text = '<body pos="0 0 0.4"><joint axis="0 1 0"/>' + _piece(0.0, edges[0], edges[1])
    for number in range(1, pieces + 1):
        text += f'<body pos="0 0 {edges[number] - edges[number - 1]:.12g}">'
        if flexible:
            text += "".join(f'<joint axis="{axis}"/>' for axis in ("0 1 0", "1 0 0", "0 0 1"))
            stiffness += [bend * pieces / (share * LENGTH) for bend in (EI, EI2, GJ)]
        text += _piece(0.0, edges[number], edges[number + 1])
    text += (
        f'<body name="load" pos="0 0 {LENGTH - edges[-2]:.12g}" quat="{np.cos(0.45)} 0 {np.sin(0.45)}'
        ' 0"><joint axis="0 1 0"/>'
    )
    text += (
        f'<inertial pos="{_words(LOAD[1])}" mass="{LOAD[0]}" diaginertia="{_words(LOAD[2])}"/></body>'
        + "</body>" * (pieces + 1)
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><worldbody>{text}</worldbody></mujoco>'
    )
    return model, np.array([*stiffness, DRIVES])


def _piece(start: float, begin: float, end: float) -> str:
    mass, length = ROD[0] * (end - begin) / LENGTH, end - begin
    across = mass * (ROD[1] ** 2 + length**2 / 12)
    inertia = f"{across:.12g} {across:.12g} {2 * mass * ROD[1] ** 2:.12g}"
    return f'<inertial pos="0 0 {start + length / 2:.12g}" mass="{mass:.12g}" diaginertia="{inertia}"/>'


def _words(values: tuple[float, ...]) -> str:
    return " ".join(map(str, values))


def _chain_frfs(model: mujoco.MjModel, stiffness: np.ndarray, s: complex) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, and receptance (6, 3) at s from forces at a point of the load to it and to a point of the
    rod at 0.6 m.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    load = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "load")
    rod = max(body for body in range(1, load) if data.xpos[body][2] <= 0.4 + 0.6)
    rows = []
    for body, place in (
        (load, data.xpos[load] + Rotation.from_rotvec([0, 0.9, 0]).apply([0.1, 0.2, 0.3])),
        (rod, [0.05, 0.0, 1.0]),
    ):
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, np.asarray(place), body)
        rows.append(jacobian)
    both = np.vstack(rows)
    z = np.diag(stiffness) + s**2 * mass
    return np.sqrt(scipy.linalg.eigh(np.diag(stiffness), mass, eigvals_only=True)) / (
        2 * np.pi
    ), both @ np.linalg.solve(z, rows[0].T)


@pytest.mark.parametrize("share", [1.0, 0.7])
def test_frequencies_and_frfs_are_those_of_a_fine_chain(share: float, tmp_path: Path) -> None:
    robot = _robot(tmp_path)
    s = 6.0 + 2j * np.pi * np.array([4.0, 11.0, 25.0])
    chain = _chain(40, share)
    expected = _chain_frfs(*chain, s[0])[0]
    model, values = _model(robot, [JOINTS, {**FLEXIBLE, "flexible_share": share}])
    mass, damping, stiffness = model.matrices(values)
    found = undamped_modes(mass, stiffness)[0]
    assert found[:6] == pytest.approx(expected[:6], rel=0.001)
    rigid = _frequencies(robot, [JOINTS])
    assert abs(rigid[0] / expected[0] - 1) > 0.05, "the flexibility matters"
    rows = np.vstack(
        [
            model.base_jacobian("load", np.array([0.1, 0.2, 0.3])),
            model.base_jacobian("beam", np.array([0.05, 0.0, 0.6])),
        ]
    )
    h = frf_by_solve(mass, 0 * damping, stiffness, s, rows, rows[:3].T, 0)
    for line, at in enumerate(s):
        other = _chain_frfs(*chain, at)[1]
        assert np.abs(h[line] - other).max() < 0.01 * np.abs(other).max()


def test_four_pieces_are_roughly_a_beam(tmp_path: Path) -> None:
    """The hidden truth elsewhere is a chain of few pieces, whose hinges are spread less than a beam's
    flexibility.
    """
    expected = _chain_frfs(*_chain(3, 1.0), 1j)[0]
    found = _frequencies(_robot(tmp_path), [JOINTS, {**FLEXIBLE, "flexible_share": 1.0}])
    assert found[:4] == pytest.approx(expected[:4], rel=0.05)


def _held(robot: Robot, rod_only: bool = False) -> np.ndarray:
    return _frequencies(robot, [{**FLEXIBLE, "flexible_share": 1.0}])[: 3 if rod_only else None]


def test_light_cantilever_with_a_heavy_end_in_closed_form(tmp_path: Path) -> None:
    """Bending sqrt(3 EI / (m L^3)) in both planes; a block with its centre at the end, almost without inertia
    of its own.
    """
    robot = _robot(tmp_path, rod=1e-3, load=100.0, centre=(0.0, 0.0, 0.0))
    small = replace(robot.links[2], inertia=1e-6 * np.eye(3))
    robot = replace(robot, links=(*robot.links[:2], small))
    found = _held(robot)[:2]
    expected = np.sqrt(3 * np.array([EI, EI2]) / (100.0 * LENGTH**3)) / (2 * np.pi)
    assert found == pytest.approx(expected, rel=1e-4)


def test_its_own_inertia_in_closed_form(tmp_path: Path) -> None:
    """A rod that carries nothing, between its ends too: two bending modes of a cantilever in each plane, less
    1 % or so for the inertia of its sections, and the first of torsion.
    """
    found = _held(_robot(tmp_path, load=1e-6))[:5] * 2 * np.pi
    bending = np.outer(np.array([1.875104, 4.694091]) ** 2, np.sqrt(np.array([EI, EI2]) / ROD[0]))
    twisting = np.pi / 2 * np.sqrt(GJ / (2 * ROD[0] * ROD[1] ** 2))
    assert found == pytest.approx(np.sort([*bending.ravel(), twisting]), rel=0.02)


def test_twisting_in_closed_form(tmp_path: Path) -> None:
    """sqrt(GJ / (L I)) of a dumb-bell across the end of a light rod."""
    robot = _robot(tmp_path, rod=1e-3, load=1.0, centre=(0.0, 0.0, 0.0))
    wide = replace(robot.links[2], inertia=np.diag([25.0, 25.0, 50.0 - 1e-9]))
    turned = Rotation.from_rotvec([0, -POSTURE[1], 0]).as_matrix()
    robot = replace(robot, links=(*robot.links[:2], replace(wide, inertia=turned @ wide.inertia @ turned.T)))
    expected = np.sqrt(GJ / (LENGTH * 50.0)) / (2 * np.pi)
    assert np.abs(_held(robot) / expected - 1).min() < 1e-4


def test_bare_cantilever_by_its_own_mass(tmp_path: Path) -> None:
    """1.8751^2 sqrt(EI / (m L^3)) / 2 pi; one element of cubic shapes is 0.5 % above."""
    robot = _robot(tmp_path, rod=30.0, load=1e-4, centre=(0.0, 0.0, 0.0))
    thin = replace(robot.links[1], inertia=np.diag([2.5, 2.5, 1e-4]))
    robot = replace(robot, links=(robot.links[0], thin, robot.links[2]))
    expected = 1.87510407**2 * np.sqrt(np.array([EI, EI2]) / (30.0 * LENGTH**3)) / (2 * np.pi)
    assert np.sort(_held(robot))[:2] == pytest.approx(expected, rel=0.006)


def test_slices_are_the_body() -> None:
    rng = np.random.default_rng(3)
    second = rng.normal(size=(3, 3))
    second = second @ second.T + 0.1 * np.eye(3)
    body = Link("any", 7.0, rng.normal(size=3), np.trace(second) * np.eye(3) - second)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    parts = list(slices(body, axis))
    assert sum(mass for mass, _, _ in parts) == pytest.approx(7.0)
    assert sum(mass * centre for mass, centre, _ in parts) == pytest.approx(7.0 * body.centre)
    total = np.zeros((3, 3))
    for mass, centre, inertia in parts:
        d = centre - body.centre
        total += inertia + mass * (d @ d * np.eye(3) - np.outer(d, d))
        assert np.linalg.eigvalsh(0.5 * np.trace(inertia) * np.eye(3) - inertia).min() > -1e-9, (
            "each is a body"
        )
    assert total == pytest.approx(body.inertia)


def test_stiff_link_is_a_rigid_link(tmp_path: Path) -> None:
    robot = _robot(tmp_path)
    stiff = {**FLEXIBLE, "bending": {"initial": 1e13}, "torsion": {"initial": 1e13}}
    assert _frequencies(robot, [JOINTS, stiff])[:2] == pytest.approx(_frequencies(robot, [JOINTS]), rel=1e-5)


NONUNIFORM = {**FLEXIBLE, "nonuniform": True}


def _nonuniform(robot: Robot, **further: float) -> tuple[System, dict[str, int], np.ndarray]:
    """A nonuniform beam, the numbers of its coordinates by name, and its values with some of them given."""
    model, values = _model(robot, [JOINTS, NONUNIFORM])
    names = [p.name for p in model.parameters]
    for name, value in further.items():
        values[names.index(f"beam.{name.replace('__', '.')}")] = value
    own = {name.removeprefix("beam."): n for n, name in enumerate(model.coordinates) if "beam." in name}
    return model, own, values


def test_a_nonuniform_link_starts_as_the_uniform_one(tmp_path: Path) -> None:
    """All further parameters at zero: the same names and values, and the same low frequencies."""
    robot = _robot(tmp_path)
    even, values = _model(robot, [JOINTS, FLEXIBLE])
    nonuniform, _, more = _nonuniform(robot)
    assert [p.name for p in nonuniform.parameters[: len(values)]] == [p.name for p in even.parameters]
    assert more[: len(values)] == pytest.approx(values, rel=0.05), "starts of damping, scaled by inertia"
    assert not more[len(values) :].any()
    low = _frequencies(robot, [JOINTS, FLEXIBLE])[:4]
    assert _frequencies(robot, [JOINTS, NONUNIFORM])[:4] == pytest.approx(low, rel=2e-3)


def test_a_nonuniform_link_gives_way_by_the_integral_of_moment_over_stiffness(tmp_path: Path) -> None:
    """Under a force and a moment at its end: int r r' / EI dx, r = (L - x, 1), part by part."""
    more = {"bending_1__near_stiffness": 2 * EI, "bending_1__far_stiffness": -0.5 * EI}
    model, own, values = _nonuniform(_robot(tmp_path), **more, torsion__far_stiffness=GJ)
    stiffness = model.matrices(values)[2]
    every = list(own.values())
    compliance = np.linalg.inv(stiffness[np.ix_(every, every)])
    ends = [list(own).index(name) for name in ("deflection_1", "slope_1", "twist")]
    edges, expected = np.linspace(0, LENGTH, 4), np.zeros((2, 2))
    for begin, end, inverse in zip(edges[:-1], edges[1:], 1 / (EI * np.array([3, 1, 0.5])), strict=True):
        powers = [((LENGTH - begin) ** n - (LENGTH - end) ** n) / n for n in (3, 2, 1)]
        expected += inverse * np.array([powers[:2], powers[1:]])
    assert compliance[np.ix_(ends[:2], ends[:2])] == pytest.approx(expected)
    assert compliance[ends[2], ends[2]] == pytest.approx(LENGTH / 3 * (1 + 1 + 0.5) / GJ)


def test_a_body_at_the_end_of_a_nonuniform_link_moves_with_the_end_alone(tmp_path: Path) -> None:
    """sqrt(3 EI / (m L^3)), and the rigid link as it was."""
    robot = _robot(tmp_path, rod=1e-3, load=1e-4, centre=(0.0, 0.0, 0.0))
    even, _ = _model(robot, [JOINTS, FLEXIBLE])
    model, own, values = _nonuniform(robot, end_mass=50.0)
    mass, _, stiffness = model.matrices(values)
    joints = [n for n in range(len(mass)) if n not in own.values()]
    assert mass[np.ix_(joints, joints)] == pytest.approx(even.mass[np.ix_([0, 1], [0, 1])])
    every = list(own.values())
    found = undamped_modes(mass[np.ix_(every, every)], stiffness[np.ix_(every, every)])[0]
    assert found[:2] == pytest.approx(
        np.sqrt(3 * np.array([EI, EI2]) / (50.0 * LENGTH**3)) / (2 * np.pi), rel=1e-3
    )


def test_a_link_whose_mass_goes_evenly_with_its_sections(tmp_path: Path) -> None:
    """Bent as under loads at its end, w = 3 x^2 - 2 x^3, a section at x takes its share of a body, with its
    centre c and inertia J, along by w + (c - x) w' and w'; the rigid link stays as it was.
    """
    robot = _robot(tmp_path)
    model, own, values = _nonuniform(robot, even_share=1.0)
    before = model.matrices(np.where(np.arange(len(values)) == len(values) - 5, 0.0, values))[0]
    mass = model.matrices(values)[0]
    shape = np.zeros(len(mass))
    for name, x in (("_at_1_of_3", 1 / 3), ("_at_2_of_3", 2 / 3), ("", 1.0)):
        shape[own[f"deflection_1{name}"]] = 3 * x**2 - 2 * x**3
        shape[own[f"slope_1{name}"]] = 6 * x - 6 * x**2
    x = (np.arange(20_000) + 0.5) / 20_000
    w, turn = 3 * x**2 - 2 * x**3, 6 * x - 6 * x**2
    inertia = ROD[0] / 12 + ROD[0] * ROD[1] ** 2
    own_way = ROD[0] * np.mean(w**2) + ROD[0] * ROD[1] ** 2 * np.mean(turn**2)
    evenly = ROD[0] * np.mean((w + (0.5 - x) * turn) ** 2) + inertia * np.mean(turn**2)
    assert shape @ (mass - before) @ shape == pytest.approx(evenly - own_way)
    joints = [n for n in range(len(mass)) if n not in own.values()]
    assert mass[np.ix_(joints, joints)] == pytest.approx(before[np.ix_(joints, joints)])


def test_what_lies_beyond_may_be_taken_off(tmp_path: Path) -> None:
    model, values = _model(_robot(tmp_path), [JOINTS, FLEXIBLE], detached="load")
    bare, bare_values = _model(_robot(tmp_path, load=1e-8), [JOINTS, FLEXIBLE])
    mass, _, stiffness = model.matrices(values)
    assert model.coordinates[0] == "joint1.rz"
    assert len(model.coordinates) == 9
    found, expected = (
        undamped_modes(mass, stiffness)[0],
        undamped_modes(*[bare.matrices(values)[part] for part in (0, 2)])[0],
    )
    assert found[:3] == pytest.approx(expected[:3], rel=1e-4)
    assert len(values) == len(bare_values)


def test_default_start_is_twenty_hertz_with_all_else_held(tmp_path: Path) -> None:
    stiff = {"kind": "link-flexibility", "link": "beam", "bending": {"initial": 1e13, "bounds": [1, 1e14]}}
    found = _frequencies(_robot(tmp_path), [stiff])
    assert found[0] == pytest.approx(20.0, rel=1e-3)


def test_the_first_plane_is_that_of_the_joint(tmp_path: Path) -> None:
    """The joint turns about y: a soft first plane lets the load swing along x."""
    soft = {**FLEXIBLE, "bending": {"initial": [EI, 1e12]}, "torsion": {"initial": 1e12}}
    model, values = _model(_robot(tmp_path), [soft])
    mass, _, stiffness = model.matrices(values)
    end = model.base_jacobian("beam", np.array([0.0, 0.0, LENGTH])) @ undamped_modes(mass, stiffness)[1][0]
    assert abs(end[0]) > 100 * np.linalg.norm(end[1:])


def test_links_without_length_are_refused_and_no_place(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    assert [place.link for place in parse_effect(FLEXIBLE).instances(robot, {})] == [
        f"link{number}" for number in range(1, 6)
    ]  # type: ignore[attr-defined]
    met = replace(robot.joints[3], origin=np.eye(4))
    wrist = replace(robot, joints=(*robot.joints[:3], met, *robot.joints[4:]))
    assert "link3" not in [place.link for place in parse_effect(FLEXIBLE).instances(wrist, {})]  # type: ignore[attr-defined]
    effects = [parse_effect({"kind": "link-flexibility", "link": "link3"})]
    with pytest.raises(InputError, match="link3 has no length"):
        build_site(wrist, np.zeros(6), effects)


@pytest.mark.parametrize("make", ["urdf", "dh"])
def test_both_sides_of_the_far_joint_move_alike(make: str, tmp_path: Path) -> None:
    """At the next joint's origin the deformed link and the link beyond are one: nothing aligned, and frames
    at the far ends.
    """
    robot = (
        read_urdf(write(tmp_path, general_arm(2)))
        if make == "urdf"
        else read_dh(ROOT / "data" / "umons_tx200" / "robot.yaml")
    )
    places = list(EFFECTS.get("link-flexibility").instances(robot, {}))
    assert len(places) >= 3
    for place in places:
        site = build_site(robot, random_posture(4), [place])
        mechanism = site.engine.mechanism
        number = [link.name for link in robot.links].index(place.link)
        body, pose = mechanism.frames[place.link]
        here = pose[:3, :3].T @ (mechanism.bodies[body + 1].pose[:3, 3] - pose[:3, 3])
        beyond = mechanism.frames[robot.links[number + 1].name][1]
        there = -beyond[:3, :3].T @ beyond[:3, 3]
        sides = []
        for link, point in ((place.link, here), (robot.links[number + 1].name, there)):
            turn, motion = site.engine.axes(link), site.jacobian(link, point, "points")[:, -5:]
            sides.append(np.vstack([turn @ motion[:3], turn @ motion[3:]]))
        assert sides[0] == pytest.approx(sides[1], abs=1e-9)
        assert np.linalg.matrix_rank(sides[0]) == 5
        near = -pose[:3, :3].T @ pose[:3, 3]
        assert not site.jacobian(place.link, near, "points")[:, -5:].any(), "the near end is held"


def test_a_turned_frame_on_a_flexible_link_sees_the_same_motion_turned(tmp_path: Path) -> None:
    """The same material point, once by the link's own frame and once by that of a bracket screwed to it
    askew.
    """
    robot = read_urdf(write(tmp_path, general_arm(3)))
    effects = [parse_effect(JOINTS), parse_effect({"kind": "link-flexibility", "link": "link3"})]
    end = robot.joints[3].origin[:3, 3]
    site = build_site(robot, random_posture(3), effects)
    poses = site.engine.mechanism.frames
    assert poses["bracket3"][0] == poses["link3"][0]
    between = np.linalg.inv(poses["link3"][1]) @ poses["bracket3"][1]
    assert np.abs(between[:3, :3] - np.eye(3)).max() > 0.3, "the bracket is turned"
    at = end + np.array([0.1, -0.2, 0.15])
    own = site.jacobian("link3", at, "points")
    seen = site.jacobian("bracket3", between[:3, :3].T @ (at - between[:3, 3]), "points")
    deflecting = [site.number(f"link3.{name}") for name in ("deflection_1", "twist")]
    assert np.abs(own[:, deflecting]).max(axis=0).min() > 0.1
    for rows in (slice(0, 3), slice(3, 6)):
        assert seen[rows] == pytest.approx(between[:3, :3].T @ own[rows], abs=1e-9)
