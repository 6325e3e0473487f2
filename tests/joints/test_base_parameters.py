"""Base parameters against Pinocchio's regressor and rnea, and against the truth of the generator's arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest
from ruamel.yaml import YAML

from identify.core.config import read_settings
from identify.core.errors import InputError, InputErrors
from identify.joints.base import parse_curve
from identify.joints.base_set import of_robot
from identify.joints.study import JointFile, JointStudy, bench_of
from identify.robot.description import Robot
from identify.robot.dh import read_dh
from tests.generator import joint_runs
from tests.joints.memory import bench, value
from tests.shared import shared

ROWS, ROOT = range(3), Path(__file__).parents[2]


def described(folder: Path, bodies: Any = joint_runs.BODIES, unknown: bool = False) -> Robot:
    """The generator's arm as a Denavit-Hartenberg table; unknown: whether bodies of zero are allowed."""
    joints = [
        {"name": f"joint{n}", "d_m": d, "a_m": a, "alpha_deg": float(np.degrees(alpha))}
        for n, (d, a, alpha) in enumerate(joint_runs.DH, 1)
    ]
    links = [
        {"name": f"link{n}", "mass_kg": m, "centre_m": list(c), "inertia_kg_m2": [*i, 0, 0, 0]}
        for n, (m, c, i) in enumerate(bodies, 1)
    ]
    path = folder / "robot.yaml"
    with path.open("w") as file:
        YAML().dump({"name": "truth", "convention": "standard", "joints": joints, "links": links}, file)
    return read_dh(path, unknown_bodies=unknown)


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return described(tmp_path)


def test_there_are_as_many_as_pinocchio_s_regressor_has_rank(robot: Robot) -> None:
    model = joint_runs.arm()
    data, rng = model.createData(), np.random.default_rng(5)
    rows = [
        pinocchio.computeJointTorqueRegressor(model, data, *rng.uniform(-2, 2, (3, 3))).copy()
        for _ in range(60)
    ]
    inertial = [n for n in of_robot(robot, ROWS, rotors=False).kept if n < 30]
    assert len(inertial) == np.linalg.matrix_rank(np.vstack(rows), tol=1e-8)


def test_intervals_hold_the_truth(robot: Robot) -> None:
    clean = joint_runs.excitation(1)
    curve = parse_curve(
        {"kind": "base-parameters", "files": ["a"], "rotor_inertia_kg_m2": joint_runs.ROTOR.tolist()}
    )
    inside, narrow = [], []
    for seed in range(8):
        read = joint_runs.sensed(clean, joint_runs.RATIO, np.random.default_rng([17, seed]))
        v = curve.identify(bench({"a": (0, read)}, robot)).values
        known = np.isfinite(v.expected)
        off = np.abs(v.value - v.expected)[known] / ((v.high_95 - v.low_95) / 2)[known]
        inside += list(off <= 1)
        narrow += list(off <= 0.3)
    assert known.sum() >= 15
    assert (
        np.mean(inside) > 0.8
    )  # values of one run hang together, so eight runs are worth some forty intervals
    assert np.mean(narrow) < 0.75


def test_a_rotor_that_is_not_known_goes_to_the_first_axis(robot: Robot) -> None:
    names = of_robot(robot, ROWS).meanings
    assert any("joint1.ia" in meaning and "link1.yy" in meaning for meaning in names)
    assert "joint3.ia" in names


def test_bodies_that_are_not_known_are_found_all_the_same(tmp_path: Path, robot: Robot) -> None:
    """A description with inertias, or masses and inertias, of zero: the same values, compared with nothing
    where nothing is stated; without leave it is refused.
    """
    read = joint_runs.sensed(joint_runs.excitation(1), joint_runs.RATIO, np.random.default_rng(3))
    curve = parse_curve({"kind": "base-parameters", "files": ["a"]})
    none = (0.0, 0.0, 0.0)
    points = tuple((mass, centre, none) for mass, centre, _ in joint_runs.BODIES)
    nothing = tuple((0.0, none, none) for _ in joint_runs.BODIES)
    expected = curve.identify(bench({"a": (0, read)}, robot)).values
    for bodies in (points, nothing):
        found = curve.identify(bench({"a": (0, read)}, described(tmp_path, bodies, unknown=True))).values
        assert found.name == expected.name
        assert found.value == pytest.approx(expected.value, rel=1e-6, abs=1e-6)
        assert np.isnan(found.expected).all()
        with pytest.raises(InputErrors, match=r"positive"):
            described(tmp_path, bodies)


@pytest.mark.parametrize("moving", [[1], [1, 2], [0]])
def test_what_stands_still_tells_nothing(robot: Robot, moving: list[int]) -> None:
    """As many values as Pinocchio's regressor has rank where the other joints stand; all hold the truth."""
    clean = joint_runs.excitation(1, moving=moving)
    read = joint_runs.sensed(clean, joint_runs.RATIO, np.random.default_rng(3))
    settings = {"kind": "base-parameters", "files": ["a"], "joints": [joint + 1 for joint in moving]}
    known = {**settings, "rotor_inertia_kg_m2": joint_runs.ROTOR.tolist()}
    v = parse_curve(known).identify(bench({"a": (0, read)}, robot)).values
    model, rng = joint_runs.arm(), np.random.default_rng(5)
    data, states = model.createData(), rng.uniform(-2, 2, (60, 3, 3))
    still = [joint for joint in range(3) if joint not in moving]
    states[:, :, still] = 0.0
    states[:, 0, still] = clean["motor_rad"][0, still]
    rows = [pinocchio.computeJointTorqueRegressor(model, data, *one)[moving].copy() for one in states]
    inertial = np.array([name.startswith("link") for name in v.name])
    assert inertial.sum() == np.linalg.matrix_rank(np.vstack(rows), tol=1e-8)
    off = np.abs(v.value - v.expected)[inertial] / ((v.high_95 - v.low_95) / 2)[inertial]
    assert np.all(off < 2.5)


def test_one_run_under_two_names_is_refused(robot: Robot) -> None:
    read = joint_runs.sensed(joint_runs.excitation(1), joint_runs.RATIO, np.random.default_rng(3))
    fewer = {name: np.round(values, 5) for name, values in read.items()}
    curve = parse_curve({"kind": "base-parameters", "files": ["a"], "judge": ["b"]})
    with pytest.raises(InputError, match=r"b: what was measured is that of a; .* judge itself"):
        curve.identify(bench({"a": (0, read), "b": (0, fewer)}, robot))


def test_the_reported_run_of_one_joint_gives_three_combinations_and_its_friction(tmp_path: Path) -> None:
    config = shared("reported", "one_joint.yaml")
    file = JointFile.of(config, *read_settings(config, JointStudy, "identify-joints/1"))
    v = file.study.curves[0].identify(bench_of(file)).values
    assert sum(name.startswith("l") for name in v.name) == 3
    for name, true in (("joint2.fv", 8.0), ("joint2.fc", 12.0)):
        row = v.name.index(name)
        assert v.low_95[row] < true < v.high_95[row]
        assert v.status[row] == "determined"


def test_a_wrong_drawing_is_seen_and_an_unseen_run_foretold(tmp_path: Path) -> None:
    heavy = tuple((0.9 * mass, centre, inertia) for mass, centre, inertia in joint_runs.BODIES)
    motions = {name: joint_runs.excitation(n) for n, name in ((1, "a"), (2, "b"))}
    rng = np.random.default_rng(23)
    runs = {name: (0, joint_runs.sensed(motion, joint_runs.RATIO, rng)) for name, motion in motions.items()}
    settings = {
        "kind": "base-parameters",
        "files": ["a"],
        "judge": ["b"],
        "rotor_inertia_kg_m2": joint_runs.ROTOR.tolist(),
    }
    found = parse_curve(settings).identify(bench(runs, described(tmp_path, heavy)))
    row = found.values.name.index("link3.mx")
    assert not found.values.low_95[row] < found.values.expected[row] < found.values.high_95[row]
    judged = found.panels["b, joint 2, not fitted"].series
    left = judged["measured"].y - judged["identified"].y
    noise = joint_runs.TORQUE_NOISE * joint_runs.RATIO[1]
    assert np.nanstd(left) < 1.5 * noise


def test_ten_seconds_of_the_recorded_robot_give_its_friction_and_little_else() -> None:
    """Measured: values of friction are those of `identify explain` (docs/kuka_kr300.md) times the gear ratio;
    inertias are not told.
    """
    folder = shared("data", "kuka_kr300_weigand")
    ratio = [256.857142857, 267.428571429, 252.333333333, 221.0, 239.619047619, 154.323134328]
    study = JointStudy.model_validate(
        {
            "schema": "identify-joints/1",
            "robot": {
                "dh": str(ROOT / "data/kuka_kr300/robot.yaml"),
                "payload": [{"link": "link6", "mass_kg": 175, "centre_m": [0, 0, 0.1]}],
            },
            "gear_ratio": ratio,
            "torque_at": "motor",
            "time": {"at": "rec.time_cont"},
            "signals": {
                "motor_position": {"at": "rec.act_pos_mot_deg", "unit": "deg"},
                "motor_velocity": {"at": "rec.act_vel_mot_deg_per_s", "unit": "deg/s"},
                "motor_torque": {"at": "rec.act_torque_abs_nm", "unit": "N m"},
            },
            "joint_zero_deg": [0, -90, 90, 0, 0, 0],
            "curves": [
                {"kind": "base-parameters", "files": [str(folder / "data_FF_A.mat")], "joints": [1, 2, 3]}
            ],
        }
    )
    found = study.curves[0].identify(bench_of(JointFile.of(ROOT / "kuka.yaml", study, "")))
    for joint, (viscous, coulomb) in enumerate(((7.7, 1.38), (6.9, 1.99), (6.2, 1.69)), 1):
        for what, motor in (("fv", viscous), ("fc", coulomb)):
            _, low, high, status = value(found, f"joint{joint}.{what}")
            assert low < motor * ratio[joint - 1] < high
            assert status == "determined"
    inertial = [
        status
        for name, status in zip(found.values.name, found.values.status, strict=True)
        if name.startswith("link")
    ]
    assert inertial.count("determined") <= 2
