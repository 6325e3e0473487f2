"""Masses, resonators and springs that sit at a point of a link, against textbook formulas and against bodies
of the engine.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.model.effects.base import parse_effect
from identify.model.system import assemble, build_site, list_parameters
from identify.robot.engine import Engine
from identify.robot.points import Point
from identify.robot.pose import pose
from identify.robot.posture import Body, at_posture
from tests.arms import arm, initial, system
from tests.model.effects.pendulum import DRIVE, frequency
from tests.robot.random_arm import random_posture


def test_added_mass_brings_inertia_and_weight(tmp_path: Path) -> None:
    mass = {"kind": "added-mass", "link": "rod", "at_m": [0, 0, -1.2], "mass": {"initial": 2.0}}
    inertia = 0.2 + 3 * 0.5**2 + 2 * 1.2**2
    expected = np.sqrt((400.0 + 9.81 * (3 * 0.5 + 2 * 1.2)) / inertia) / (2 * np.pi)
    assert frequency(tmp_path, [DRIVE, mass]) == pytest.approx([expected], rel=1e-6)


def test_a_body_of_a_point_s_moments_is_that_point(tmp_path: Path) -> None:
    robot, drives = arm(tmp_path), {"kind": "joint-compliance", "axes": ["rz", "rx", "ty"]}
    place, m = np.array([0.1, -0.2, 0.3]), 4.0
    point = {"kind": "added-mass", "link": "link5", "at_m": place.tolist(), "mass": {"initial": m}}
    seconds = [m * place[i] * place[j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
    body = {
        "kind": "added-mass",
        "link": "link5",
        "extent": "body",
        "at_m": [0, 0, 0],
        "mass": {"initial": m},
    }
    body |= {"moment": {"initial": (m * place).tolist()}, "second_moment": {"initial": seconds}}
    one, other = (
        (model, initial(parameters))
        for model, parameters, _ in (system(robot, [drives, effect]) for effect in (point, body))
    )
    for a, b in zip(one[0].matrices(one[1]), other[0].matrices(other[1]), strict=True):
        assert a == pytest.approx(b, abs=1e-7 * max(1.0, np.abs(a).max()))


def test_a_body_is_what_the_robot_with_that_payload_is(tmp_path: Path) -> None:
    robot, drives = arm(tmp_path), {"kind": "joint-compliance", "axes": ["rz", "rx", "ty"]}
    m, centre, inertia = (
        6.0,
        np.array([0.05, 0.1, 0.2]),
        np.array([[0.3, 0.02, -0.01], [0.02, 0.25, 0.03], [-0.01, 0.03, 0.2]]),
    )
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia + m * np.outer(centre, centre)
    body = {
        "kind": "added-mass",
        "link": "link6",
        "extent": "body",
        "at_m": [0, 0, 0],
        "mass": {"initial": m},
    }
    body |= {
        "moment": {"initial": (m * centre).tolist()},
        "second_moment": {"initial": second[np.triu_indices(3)].tolist()},
    }
    added, parameters, _ = system(robot, [drives, body])
    loaded, of_drives, _ = system(robot.with_payload("link6", m, centre, inertia), [drives])
    bare, _, _ = system(robot, [drives])
    drive_values = initial(parameters)[: len(of_drives)]
    for with_effect, with_payload in zip(
        added.matrices(initial(parameters)), loaded.matrices(drive_values), strict=True
    ):
        assert with_effect == pytest.approx(with_payload, abs=1e-7 * max(1.0, np.abs(with_payload).max()))
    assert np.abs(bare.mass - loaded.mass).max() > 0.01 * np.abs(bare.mass).max()


def test_resonator_on_a_rigid_body_is_the_textbook_absorber(tmp_path: Path) -> None:
    resonator = {
        "kind": "appended-resonator",
        "link": "ground",
        "axis": "z",
        "mass": {"initial": 4.0},
        "stiffness": {"initial": 5e4},
    }
    found = frequency(
        tmp_path, [{"kind": "base-compliance", "axes": ["tz"], "stiffness": {"initial": 1e6}}, resonator]
    )
    total, ka, kb, m = 57.0, 1e6, 5e4, 4.0
    # det(K - w^2 M) = 0 with M = [[total, m], [m, m]], K = diag(ka, kb).
    squares = np.roots([total * m - m**2, -(total * kb + m * ka), ka * kb])
    assert found == pytest.approx(np.sqrt(np.sort(squares)) / (2 * np.pi), rel=1e-6)
    across = frequency(
        tmp_path,
        [
            {"kind": "base-compliance", "axes": ["tz"], "stiffness": {"initial": 1e6}},
            {**resonator, "axis": "x"},
        ],
    )
    assert across == pytest.approx(np.sort(np.sqrt([1e6 / 57, 5e4 / 4])) / (2 * np.pi), rel=1e-6)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_resonator_is_a_sliding_body_of_the_engine(axis: str, tmp_path: Path) -> None:
    """Mass matrix and gravity stiffness, with their coupling to all coordinates of the arm, from the engine's
    own body.
    """
    robot, posture, place, m = arm(tmp_path), random_posture(1), [0.1, 0.2, -0.1], 7.0
    axes = ["tx", "ty", "tz", "rx", "ry", "rz"]
    parsed = [
        parse_effect(effect)
        for effect in (
            {"kind": "joint-compliance", "axes": axes},
            {"kind": "base-compliance", "axes": axes},
            {
                "kind": "appended-resonator",
                "link": "link3",
                "axis": axis,
                "at_m": place,
                "mass": {"initial": m},
            },
        )
    ]
    site = build_site(robot, posture, parsed)
    model, parameters = assemble(robot, site, parsed), list_parameters(robot, site, parsed)
    mass, _, stiffness = model.matrices(initial(parameters))
    springs = {parameter.name: parameter.initial for parameter in parameters}
    own = np.diag([springs[f"{name}.stiffness"] for name in model.coordinates])
    bare = at_posture(robot, posture)
    parent, frame = bare.frame("link3", "here")
    hose = Body("hose", parent, frame @ pose(place), m, np.zeros(3), 1e-9 * np.eye(3))
    engine = Engine(replace(bare, bodies=(*bare.bodies, hose)))
    chosen = [engine.mechanism.coordinates.index(name) for name in (*model.coordinates[:-1], f"hose.t{axis}")]
    assert mass == pytest.approx(engine.mass_matrix()[np.ix_(chosen, chosen)], abs=1e-8 * np.abs(mass).max())
    gravity = engine.gravity_stiffness()[np.ix_(chosen, chosen)]
    assert stiffness - own == pytest.approx(gravity, abs=1e-5 * np.abs(gravity).max())
    assert np.abs(gravity[-1]).max() > 0.1 * m * 9.81, "the weight does couple the resonator with the arm"


def test_spring_to_ground_holds_the_pendulum(tmp_path: Path) -> None:
    def held(*axes: str) -> np.ndarray:
        spring = {
            "kind": "spring-to-ground",
            "link": "rod",
            "at_m": [0, 0, -0.9],
            "axes": axes,
            "stiffness": {"initial": 500.0},
        }
        return frequency(tmp_path, [DRIVE, spring])

    stiffness, inertia = 400.0 + 3 * 9.81 * 0.5, 0.2 + 3 * 0.5**2
    assert held("x") == pytest.approx([np.sqrt((stiffness + 500 * 0.9**2) / inertia) / (2 * np.pi)], rel=1e-6)
    assert held("y", "z") == pytest.approx([np.sqrt(stiffness / inertia) / (2 * np.pi)], rel=1e-6)


def test_directions_of_a_ground_spring_stay_with_the_base(tmp_path: Path) -> None:
    spring = {
        "kind": "spring-to-ground",
        "link": "link2",
        "at_m": [0.1, 0.0, 0.4],
        "axes": ["z"],
        "stiffness": {"initial": 1e5},
    }
    model, parameters, _ = system(arm(tmp_path), [{"kind": "joint-compliance"}, spring])
    row = model.base_jacobian("link2", np.array([0.1, 0.0, 0.4]))[2]
    assert model.terms["stiffness"][-2] == pytest.approx(np.outer(row, row))
    assert parameters[-2].name == "link2.ground_z.stiffness"


def test_motion_in_the_axes_of_the_base_is_the_derivative_of_the_place_there(tmp_path: Path) -> None:
    robot, at, step = arm(tmp_path), np.array([0.1, -0.2, 0.4]), 1e-6
    posture, turning = random_posture(1), [{"kind": "joint-compliance"}]
    model, _, _ = system(robot, turning)
    effects = [parse_effect(effect) for effect in turning]

    def place(angles: np.ndarray) -> np.ndarray:
        return build_site(robot, angles, effects).engine.position("link4", at)

    moved = [(place(posture + d) - place(posture - d)) / (2 * step) for d in step * np.eye(6)]
    found = model.base_jacobian("link4", at)
    assert found == pytest.approx(np.transpose(moved), abs=1e-8)
    own = model.jacobian("link4", at)[:3]
    assert np.abs(own - found).max() > 0.1, "the link is turned, so its own axes see it differently"


def test_a_cross_coupled_spring_is_a_spring_along_its_own_direction(tmp_path: Path) -> None:
    at, n, k = [0.1, 0.0, 0.4], np.array([0.6, -0.48, 0.64]), 3e5
    spring = {"kind": "spring-to-ground", "link": "link2", "at_m": at, "cross_coupling": True}
    model, parameters, values = system(arm(tmp_path), [{"kind": "joint-compliance"}, spring])
    values, names = initial(parameters), [p.name for p in parameters]
    rigid = [
        0.0 if name.startswith("link2.ground") else value for name, value in zip(names, values, strict=True)
    ]
    along = list(rigid)
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        along[names.index(f"link2.ground_{'xyz'[i]}{'xyz'[j] if i != j else ''}.stiffness")] = k * n[i] * n[j]
    row = n @ model.base_jacobian("link2", np.array(at))[:3]
    added = model.matrices(np.array(along))[2] - model.matrices(np.array(rigid))[2]
    assert added == pytest.approx(k * np.outer(row, row), abs=1e-6 * k)
    strut = {"kind": "spring-to-ground", "link": "link2", "at_m": at, "direction": (2.5 * n).tolist()}
    single, parameters, _ = system(arm(tmp_path), [{"kind": "joint-compliance"}, strut])
    names = [p.name for p in parameters]
    assert names[-2:] == ["link2.strut.stiffness", "link2.strut.damping"]
    [*drives, _, _] = initial(parameters)
    both = [single.matrices(np.array([*drives, k * on, 0.0]))[2] for on in (1.0, 0.0)]
    assert both[0] - both[1] == pytest.approx(added, abs=1e-6 * k)


@pytest.mark.parametrize(
    "wrong",
    [{"direction": [0, 0, 0]}, {"cross_coupling": True}, {"axes": ["x"]}],
    ids=["no length", "cross", "axes"],
)
def test_a_strut_has_one_direction_and_nothing_else(wrong: dict[str, object]) -> None:
    strut = {"kind": "spring-to-ground", "link": "link2", "direction": [0, 0, 1]}
    assert "along [0.00, 0.00, 1.00]" in parse_effect(strut).sentence()
    with pytest.raises(ValueError, match="direction"):
        parse_effect(strut | wrong)


def test_sensor_mass_is_an_added_mass_at_every_point(tmp_path: Path) -> None:
    places = {1: [0.0, 0.0, -0.4], 2: [0.1, 0.0, -0.9]}
    points = {
        node: Point(node, "", "rod", np.array(at), np.eye(3), "points.csv") for node, at in places.items()
    }
    masses = [{"kind": "added-mass", "link": "rod", "at_m": [0.0, 0.0, -0.4], "mass": {"initial": 0.3}}]
    sensors = frequency(tmp_path, [DRIVE, {"kind": "sensor-mass", "mass": {"initial": 0.3}}], points)
    moment = 3 * 0.5 + 0.3 * (0.4 + 0.9)
    inertia = 0.2 + 3 * 0.5**2 + 0.3 * (0.4**2 + 0.1**2 + 0.9**2)
    assert sensors == pytest.approx([np.sqrt((400.0 + 9.81 * moment) / inertia) / (2 * np.pi)], rel=1e-6)
    assert sensors < frequency(tmp_path, [DRIVE, *masses])
    with pytest.raises(InputError, match="no measurement points"):
        frequency(tmp_path, [DRIVE, {"kind": "sensor-mass"}])
