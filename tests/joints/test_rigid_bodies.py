"""Rigid bodies that can be: pseudo-inertias against Pinocchio's, the minimum, the truth of the generator's
arm, and the robot that is written back.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest

from identify.core.errors import InputError, InputErrors
from identify.joints.base import parse_curve
from identify.joints.base_set import parameters_of, pseudo_inertia_basis
from identify.joints.rigid_bodies import ConsistentFit
from identify.joints.run import run_joints
from identify.robot.description import Link, Robot
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.pseudo_inertia import body_of, consistent, pseudo_inertia
from identify.robot.read import read_robot
from identify.robot.rewrite import with_bodies
from identify.robot.settings import RobotSettings
from tests.generator import joint_runs
from tests.joints.memory import bench
from tests.joints.test_base_parameters import described
from tests.joints.test_joints_command import DATA, SIGNALS, study
from tests.robot.random_arm import general_arm, write

KNOWN = {"kind": "rigid-bodies", "files": ["a"], "rotor_inertia_kg_m2": joint_runs.ROTOR.tolist()}
OFF = tuple((0.9 * mass, tuple(1.1 * c for c in centre), i) for mass, centre, i in joint_runs.BODIES)
"""The arm as described: a tenth off in masses and centres."""


def _random_body(seed: int) -> Link:
    rng = np.random.default_rng(seed)
    points, mass = rng.normal(size=(5, 3)), rng.uniform(1, 5, 5)
    body = sum(
        (
            pinocchio.Inertia.FromSphere(m, 0.1).se3Action(pinocchio.SE3(np.eye(3), p))
            for m, p in zip(mass, points, strict=True)
        ),
        pinocchio.Inertia.Zero(),
    )
    return Link("body", body.mass, body.lever, body.inertia)


def test_pseudo_inertia_is_pinocchio_s_and_positive_only_for_bodies() -> None:
    body = _random_body(3)
    theirs = pinocchio.PseudoInertia.FromInertia(pinocchio.Inertia(body.mass, body.centre, body.inertia))
    matrix = pseudo_inertia(body)
    np.testing.assert_allclose(matrix, theirs.toMatrix(), rtol=1e-12)
    again = body_of(matrix, "body")
    np.testing.assert_allclose(again.inertia, body.inertia, rtol=1e-10)
    np.testing.assert_allclose(
        np.tensordot(list(parameters_of(body).values()), pseudo_inertia_basis(), axes=1), matrix, atol=1e-10
    )
    flat = replace(body, inertia=np.diag([1.0, 1.0, 2.1]))  # no body: the largest exceeds the others' sum
    assert np.linalg.eigvalsh(pseudo_inertia(flat))[0] < 0
    mended, changed = consistent(flat)
    assert changed
    assert np.linalg.eigvalsh(mended)[0] > 0
    assert not consistent(body)[1]


def _small_problem(seed: int) -> ConsistentFit:
    """Two bodies, a rotor and a friction, and twelve torques that know little of them."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(12, 22))
    bodies = [_random_body(seed + n) for n in range(2)]
    torque = rows @ rng.normal(size=22) * 20
    return ConsistentFit(
        rows.T @ rows,
        rows.T @ torque,
        np.arange(20).reshape(2, 10),
        pseudo_inertia_basis(),
        np.array([pseudo_inertia(body) for body in bodies]),
        np.array([20]),
        0.3,
    )


def _objective(fit: ConsistentFit, values: np.ndarray) -> float:
    """Written again from the formula."""
    total = values @ fit.information @ values / 2 - fit.score @ values - 0.01 * np.log(values[20])
    for link in range(2):
        p, p0 = fit.pseudo_inertias(values)[link], fit.described[link]
        ratio = np.linalg.solve(p0, p)
        total += (np.trace(ratio) - np.log(np.linalg.det(ratio)) - 4) / 0.3**2
    return float(total)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_minimum_is_one_and_inside(seed: int) -> None:
    fit, rng = _small_problem(seed), np.random.default_rng(seed)
    start = np.concatenate(
        [*(list(parameters_of(_random_body(seed + n)).values()) for n in range(2)), [1.0, 0.0]]
    )
    found = fit.solve(start)
    assert fit.inside(found)
    least = _objective(fit, found)
    for _ in range(200):
        near = found * (1 + 1e-3 * rng.normal(size=22))
        if fit.inside(near):
            assert _objective(fit, near) > least
    far = np.concatenate(
        [*(list(parameters_of(_random_body(90 + n)).values()) for n in range(2)), [9.0, 5.0]]
    )
    np.testing.assert_allclose(fit.solve(far), found, rtol=1e-5, atol=1e-6)
    free = np.linalg.lstsq(fit.information, fit.score, rcond=None)[0]
    assert not fit.inside(free)  # least squares alone finds no bodies here


def _sensed(seed: int, noise: float = 1.0) -> dict[str, Any]:
    clean, rng = joint_runs.excitation(1), np.random.default_rng([31, seed])
    read = joint_runs.sensed(clean, joint_runs.RATIO, rng)
    read["torque_N_m"] = clean["torque_N_m"] + noise * (read["torque_N_m"] - clean["torque_N_m"])
    return read


def test_values_are_nearer_the_truth_and_intervals_hold_it(tmp_path: Path) -> None:
    robot, curve = described(tmp_path, OFF), parse_curve(KNOWN)
    truth = np.concatenate([[m, *c, i[0], 0, 0, i[1], 0, i[2]] for m, c, i in joint_runs.BODIES])
    inside = []
    for seed in range(4):
        found = curve.identify(bench({"a": (0, _sensed(seed))}, robot)).values
        inside.append(np.abs(truth - found.value) <= (found.high_95 - found.low_95) / 2)
    told = np.array(found.status) == "determined"
    assert np.mean(inside) > 0.9
    assert np.mean(np.array(inside)[:, told]) > 0.85
    by_name = dict(
        zip(found.name, np.abs(found.value - truth) < 0.5 * np.abs(found.expected - truth), strict=True)
    )
    assert by_name["link3.mass"]
    assert by_name["link3.centre_x"]
    row = found.name.index("link1.mass")  # the first axis is upright: no torque knows its mass
    assert found.status[row] == "as described"
    assert found.value[row] == pytest.approx(found.expected[row], rel=0.05)


def test_torques_that_say_nothing_leave_the_description(tmp_path: Path) -> None:
    robot, curve = described(tmp_path, OFF), parse_curve(KNOWN)
    found = curve.identify(bench({"a": (0, _sensed(1, noise=3e5))}, robot)).values
    assert set(found.status) == {"as described"}
    stated = np.concatenate([[m, *c, i[0], 0, 0, i[1], 0, i[2]] for m, c, i in OFF])
    half = (found.high_95 - found.low_95) / 2
    assert (np.abs(found.value - stated) < 0.3 * half).all()


def test_a_urdf_gets_its_bodies_and_nothing_else_changes(tmp_path: Path) -> None:
    path = write(tmp_path, general_arm(4))
    settings = RobotSettings(urdf=path)
    robot = read_robot(settings, tmp_path)
    bodies = [_random_body(50 + n) for n in range(len(robot.joints))]
    bodies = [replace(body, name=link.name) for body, link in zip(bodies, robot.links[1:], strict=True)]
    new = tmp_path / "new.urdf"
    new.write_text(with_bodies(settings, tmp_path, robot, bodies))
    again = read_robot(RobotSettings(urdf=new), tmp_path)
    assert again.links[0].mass == pytest.approx(robot.links[0].mass)
    for body, link in zip(bodies, again.links[1:], strict=True):
        assert link.mass == pytest.approx(body.mass, rel=1e-8)
        np.testing.assert_allclose(link.centre, body.centre, rtol=1e-7, atol=1e-8)
        np.testing.assert_allclose(link.inertia, body.inertia, rtol=1e-7, atol=1e-7)
    assert again.frames.keys() == robot.frames.keys()
    for one, other in zip(again.joints, robot.joints, strict=True):
        np.testing.assert_array_equal(one.origin, other.origin)


def test_the_command_writes_a_robot_that_the_vibration_half_takes(tmp_path: Path) -> None:
    """With a payload, which the study states and the description must not get."""
    curve = {**KNOWN, "files": [str(DATA / "excited.csv")]}
    described(tmp_path, OFF)
    payload = {"link": "link3", "mass_kg": 30.0, "centre_m": [-0.2, 0.0, 0.1]}
    plain, loaded = (
        run_joints(
            study(tmp_path, curve, robot={"dh": "robot.yaml", "payload": bodies}, signals=SIGNALS),
            tmp_path / f"{len(bodies)}.h5",
        )
        for bodies in ([], [payload])
    )
    [path, robot] = plain[1]
    assert [path.suffix, robot.name] == [".h5", "0_rigid-bodies.yaml"]
    robots = {
        "truth": RobotSettings(dh=_truth(tmp_path)),
        "described": RobotSettings(dh=tmp_path / "robot.yaml"),
        "identified": RobotSettings(dh=robot),
        "loaded": RobotSettings.model_validate({"dh": loaded[1][1], "payload": [payload]}),
    }
    mass = {name: _drive_masses(read_robot(settings, tmp_path)) for name, settings in robots.items()}
    error = {name: np.linalg.norm(one - mass["truth"]) for name, one in mass.items()}
    assert error["identified"] < 0.3 * error["described"]
    assert error["loaded"] < 0.3 * error["described"]
    bodies = [read_robot(robots[name], tmp_path).links[3].mass for name in ("identified", "loaded")]
    assert bodies[0] == pytest.approx(bodies[1], rel=0.05)  # the latter of 30 kg stated and the rest written


def _drive_masses(robot: Robot) -> np.ndarray:
    """Mass matrices of the drives at five postures, as the vibration half makes them."""
    found = []
    for posture in np.random.default_rng(2).uniform(-1, 1, (5, 3)):
        mechanism = at_posture(robot, posture)
        drives = [
            n
            for n, name in enumerate(mechanism.coordinates)
            if name.startswith("joint") and name.endswith("rz")
        ]
        found.append(Engine(mechanism).mass_matrix()[np.ix_(drives, drives)])
    assert found[0].shape == (3, 3)
    return np.array(found)


def _truth(folder: Path) -> Path:
    inner = folder / "truth"
    inner.mkdir()
    described(inner)
    return inner / "robot.yaml"


@pytest.mark.parametrize(
    ("change", "keys", "said"),
    [
        ({"uncertainty_percent": 0}, {}, "uncertainty_percent"),
        ({}, {"robot": None}, "no `robot` in the study"),
        ({"files": [str(DATA / "no.csv")]}, {}, "cannot be read"),
    ],
)
def test_bad_input_is_refused(
    tmp_path: Path, change: dict[str, Any], keys: dict[str, Any], said: str
) -> None:
    described(tmp_path)
    curve = {**KNOWN, "files": [str(DATA / "excited.csv")], **change}
    with pytest.raises((InputError, InputErrors)) as caught:
        run_joints(study(tmp_path, curve, **{"robot": {"dh": "robot.yaml"}, **keys}), tmp_path / "run.h5")
    assert said in str(caught.value)


def test_bodies_that_are_not_known_and_inputs_are_refused(tmp_path: Path) -> None:
    curve = {**KNOWN, "files": [str(DATA / "excited.csv")]}
    config = study(tmp_path, curve, robot={"dh": "run_rigid-bodies.yaml"})
    described(tmp_path)
    (tmp_path / "robot.yaml").rename(tmp_path / "run_rigid-bodies.yaml")
    with pytest.raises(InputError, match="an input, which would be overwritten"):
        run_joints(config, tmp_path / "run.h5")
    none = tuple((0.0, (0.0,) * 3, (0.0,) * 3) for _ in joint_runs.BODIES)
    described(tmp_path, none, unknown=True)
    with pytest.raises(InputErrors, match="not positive"):
        run_joints(study(tmp_path, curve, robot={"dh": "robot.yaml"}), tmp_path / "other.h5")
