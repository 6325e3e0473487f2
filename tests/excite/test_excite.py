"""`identify excite`: motion within its limits, a criterion by hand, promises kept on records that share no
code with what promised them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError, InputErrors
from identify.excite.information import experiment_of
from identify.excite.limits import Limits, limits_of
from identify.excite.run import run_excite
from identify.excite.search import Search, best_motion, random_motions
from identify.excite.series import Series, count_of, series_of
from identify.excite.study import ExciteStudy
from identify.joints.base import parse_curve
from identify.results import file as result_file
from identify.results.excite import ExciteResult
from identify.robot.description import Robot
from tests.generator import joint_runs
from tests.joints.memory import bench
from tests.joints.test_base_parameters import described

PLAIN: dict[str, Any] = {
    "schema": "identify-excite/1",
    "robot": {"dh": "robot.yaml"},
    "target": "base-parameters",
    "angle_deg": [[-60, 60], [-90, -10], [-20, 80]],
    "speed_deg_per_s": [80, 70, 80],
    "acceleration_deg_per_s2": [200, 150, 200],
    "posture_deg": [0, -50, 50],
    "periods": 1,
    "harmonics": 4,
    "starts": 1,
    "steps": 4,
    "noise": {"torque_nm": (joint_runs.TORQUE_NOISE * joint_runs.RATIO).tolist()},
    "drives": {
        "gear_ratio": joint_runs.RATIO.tolist(),
        "rotor_inertia_kg_m2": joint_runs.ROTOR.tolist(),
        "coulomb_nm": [350, 420, 210],
        "viscous_nm_s_per_rad": [250, 300, 140],
    },
}
ABOVE = [{"frame": "link3", "z_m": [0.4, 2.6]}]


def searched(robot: Robot, **change: Any) -> Search:
    """The search of a study with these keys."""
    study = ExciteStudy.model_validate({**PLAIN, **change})
    limits = limits_of(study, robot)
    return Search(study, limits, experiment_of(study, robot, limits))


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return described(tmp_path)


def _most(series: Series, limits: Limits) -> np.ndarray:
    """Largest share of each limit that a motion takes: low, high, speed, acceleration."""
    motion = series.sampled(5000)
    middle, room = (limits.low + limits.high) / 2, (limits.high - limits.low) / 2
    return np.array(
        [
            (np.abs(motion.position - middle) / room).max(),
            (np.abs(motion.velocity) / limits.speed).max(),
            (np.abs(motion.acceleration) / limits.acceleration).max(),
        ]
    )


def test_any_numbers_give_motion_within_limits_that_begins_and_ends_at_rest(robot: Robot) -> None:
    limits, rng = searched(robot).limits, np.random.default_rng(1)
    most = np.zeros(3)
    for size in (0.1, 1.0, 30.0) * 8:
        series = series_of(size * rng.normal(size=count_of(limits, 4)), limits, 10.0, 4)
        motion = series.sampled(5000)
        np.testing.assert_allclose(motion.velocity[0], 0, atol=1e-12)
        np.testing.assert_allclose(motion.acceleration[0], 0, atol=1e-12)
        slope = np.gradient(motion.position, motion.time_s, axis=0)[1:-1]
        np.testing.assert_allclose(slope, motion.velocity[1:-1], atol=1e-4)
        most = np.maximum(most, _most(series, limits))
    assert (most <= 1).all()
    assert most.max() > 0.99  # some joint goes to a limit
    assert _most(series.towards(limits.posture, 20.0), limits).max() > 1


def test_the_score_is_the_determinant_of_what_is_wanted(robot: Robot) -> None:
    search = searched(robot, target="friction")
    motion = random_motions(search, 1)[0].sampled(search.samples)
    [information] = search.experiment.information(motion)
    block = np.linalg.inv(information)[np.ix_(search.experiment.wanted, search.experiment.wanted)]
    expected = -np.linalg.slogdet(block)[1]
    assert float(search.experiment.score(information)) == pytest.approx(expected, rel=1e-6)
    assert np.flatnonzero(search.experiment.wanted).size == 6
    blind = information.copy()
    blind[0], blind[:, 0] = 0.0, 0.0
    assert np.isinf(search.experiment.half(blind, 100.0)).all()


def test_it_tells_more_than_random_motion_and_stays_in_the_workspace(robot: Robot) -> None:
    search, free = searched(robot, workspace=ABOVE), searched(robot)
    series = best_motion(search)
    outside = search.limits.outside(series.sampled(2000).position)
    assert outside.max() <= 0
    assert search.limits.outside(best_motion(free).sampled(2000).position).max() > 0.01
    assert (_most(series, search.limits) <= 1).all()
    scores = [
        float(search.experiment.score(search.experiment.information(one.sampled(search.samples))[0]))
        for one in (series, *random_motions(search, 10))
    ]
    assert scores[0] > max(scores[1:]) + 5.0


def test_transmission_errors_count_only_waves_that_are_slow_enough(robot: Robot) -> None:
    noise = {**PLAIN["noise"], "deflection_deg": 0.001}
    search = searched(robot, target="transmission-error", noise=noise)
    motion = random_motions(search, 1)[0].sampled(2000)
    columns, used = search.experiment.columns(motion)
    assert columns.shape == (2000, 3, 18)
    rate = 2 * joint_runs.RATIO * np.abs(motion.velocity) / (2 * np.pi)
    assert rate[used].max() < 10.0
    assert rate.max() > 10.0


def _written(folder: Path, **change: Any) -> Path:
    described(folder)
    path = folder / "excite.yaml"
    path.write_text(json.dumps({**PLAIN, **change}))
    return path


def test_the_promise_comes_true_on_records_of_another_engine(tmp_path: Path) -> None:
    """Torques by Pinocchio along the written table, noise of sensors, `identify fit`: the intervals it gives
    are those that were promised, in every run; half of them would not hold the truth as often.
    """
    result, [path, table] = run_excite(_written(tmp_path), tmp_path / "run.h5", draws=20)
    kept = result_file.read(path, ExciteResult)
    assert 0.8 < kept.come_true < 1.2
    assert kept.promised.kept.mean() > 0.9
    assert kept.random_ratio > 1.2
    values = np.loadtxt(table, delimiter=",", skiprows=1)
    assert table.read_text().startswith("time_s,joint1_deg,joint2_deg")
    motion = np.radians(np.vstack([values[:, 1:], values[:1, 1:]])).reshape(-1, 3, 3)
    model = joint_runs.arm()
    data = model.createData()
    torque = np.array([pinocchio.rnea(model, data, *sample) for sample in motion])
    position, velocity, acceleration = np.moveaxis(motion, 1, 0)
    drives = PLAIN["drives"]
    rub = np.array(drives["coulomb_nm"]) * np.sign(velocity) + drives["viscous_nm_s_per_rad"] * velocity
    torque += rub + joint_runs.RATIO**2 * joint_runs.ROTOR * acceleration
    clean = {"motor_rad": position, "torque_N_m": torque / joint_runs.RATIO}
    rows = {"kind": "base-parameters", "files": ["a"], "rotor_inertia_kg_m2": joint_runs.ROTOR.tolist()}
    off, ratios = [], []
    for seed in range(4):
        read = joint_runs.sensed(clean, joint_runs.RATIO, np.random.default_rng([41, seed]))
        found = parse_curve(rows).identify(bench({"a": (0, read)}, described(tmp_path))).values
        assert found.name == result.promised.name
        off.append(np.abs(found.value - result.promised.expected) / result.promised.promised)
        ratios.append((found.high_95 - found.low_95) / 2 / result.promised.promised)
    assert 0.8 < np.median(ratios) < 1.3
    assert np.mean(np.array(off) < 1) > 0.88
    assert np.mean(np.array(off) < 0.5) < 0.8


FAULTS: list[tuple[dict[str, Any], str]] = [
    ({"speed_deg_per_s": [80, 70]}, "2 numbers; expected 3, one per joint"),
    ({"speed_deg_per_s": [80, 70, 0]}, "numbers above zero"),
    ({"posture_deg": [0, 0, 50]}, "joint 2 at 0"),
    ({"angle_deg": None}, "no limits of joint1, joint2, joint3"),
    ({"angle_deg": [[-60, 60], [-10, -90], [-20, 80]]}, "least below most"),
    ({"workspace": [{"frame": "hand", "z_m": [0, 1]}]}, "unknown link 'hand'"),
    ({"workspace": [{"frame": "link3", "z_m": [5, 9]}]}, "outside its workspace"),
    ({"workspace": [{"frame": "link3", "z_m": [9, -1]}]}, "9 to -1 m; expected least below most"),
    ({"drives": {"gear_ratio": [9, 9, 9], "coulomb_nm": [1, -1, 1]}}, "greater than or equal to 0"),
    ({"harmonics": 50, "period_s": 1.0}, "a tenth of sample_rate_hz"),
    ({"lowpass_hz": 60}, "below half of sample_rate_hz"),
    ({"target": "transmission-error"}, "noise.deflection_deg"),
    ({"target": "friction", "noise": {"deflection_deg": 1e-3}}, "noise.torque_nm"),
    ({"target": "everything"}, "target"),
    ({"noise": {"torque_nm": 0}}, "above zero"),
    ({"drives": {"rotor_inertia_kg_m2": [1, 1, 1]}}, "drives.gear_ratio"),
    ({"joints": [4]}, "unknown joint 4"),
]


@pytest.mark.parametrize(("change", "said"), FAULTS, ids=[said[:30] for _, said in FAULTS])
def test_bad_input_is_refused_in_a_sentence(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    with pytest.raises((InputError, InputErrors)) as caught:
        run_excite(_written(tmp_path, **change), tmp_path / "run.h5")
    assert said in str(caught.value)
    assert not (tmp_path / "run.h5").exists()


def test_the_command_writes_and_does_not_overwrite_its_input(tmp_path: Path) -> None:
    config, run = _written(tmp_path, joints=[2, 3], steps=1), CliRunner().invoke
    done = run(app, ["excite", str(config), "--out", str(tmp_path / "a.h5"), "--no-report", "--draws", "10"])
    assert done.exit_code == 0, done.output
    assert "base parameters and friction" in " ".join(done.output.split())
    assert f"next: run {tmp_path / 'a.csv'}, record it" in done.output
    motion = result_file.read(tmp_path / "a.h5", ExciteResult)
    assert np.ptp(motion.position[:, 0]) == 0
    assert np.ptp(motion.position[:, 1]) > 0.1
    (tmp_path / "robot.yaml").rename(tmp_path / "b.csv")
    config.write_text(json.dumps({**PLAIN, "robot": {"dh": "b.csv"}}))
    refused = run(app, ["excite", str(config), "--out", str(tmp_path / "b.h5")])
    assert isinstance(refused.exception, InputError)
    assert "an input, which would be overwritten" in str(refused.exception)
