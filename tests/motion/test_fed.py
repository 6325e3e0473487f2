"""Recorded motion that is fed into a model: torques and currents by inverse dynamics, as in Kawasaki's Table
3, of records by `tests.generator`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.motion.evaluate import evaluate_simulation
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.motion.trajectory import TrajectoryObjective
from identify.reports.motion.tables import rms_tables
from tests.generator import hidden_motion
from tests.motion.test_missing import one_joint


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arm with a balancer: its study and records."""
    folder = tmp_path_factory.mktemp("fed")
    hidden_motion.write(one_joint(balancer=np.array([[8.0], [-6.0]])), folder, np.random.default_rng(5))
    return folder


def study(folder: Path, *, fed: tuple[str, ...] = ("one", "two", "three"), **keys: Any) -> MotionProblem:
    """A study of the arm that knows its balancer, some of its records fed in."""
    data = json.loads((folder / "motion.yaml").read_text())
    data["balancer"] = {"sine": 8.0, "cosine": -6.0}
    data["noise"] = {"motor_position": hidden_motion.NOISE_RAD, "motor_torque": 1.0}
    for record in data["records"]:
        if record["name"] in fed:
            record["recorded_motion_hz"] = 30.0
    path = folder / "fed.yaml"
    path.write_text(json.dumps({**data, **keys}))
    return load_motion(read_motion_study(path))


def torque_rms(problem: MotionProblem, name: str) -> float:
    return float(evaluate_simulation(problem).records[name].comparisons["motor_torque"].rms[0, 0])


def test_torques_are_what_the_recorded_motion_takes(case: Path) -> None:
    problem = study(case)
    measured = problem.records[0].measured
    assert measured is not None
    size = float(np.std(measured.signals["motor_torque"]))
    right = torque_rms(problem, "one")
    assert right < 0.1 * size  # noise and what acceleration there is above 30 Hz
    for keys in ({"friction": {}}, {"balancer": {}}, {"bodies": {"mass": 0.3}}):
        assert torque_rms(study(case, **keys), "one") > 2 * right


def test_gaps_are_those_of_each_kind_of_record_alone(case: Path) -> None:
    """Whatever else moves beside them."""
    problem = study(case, fed=())
    found = evaluate_simulation(problem)
    for use, gap in (("fit", found.gap), ("validate", found.gap_validation)):
        records = [record for record in problem.records if record.settings.use == use]
        alone = TrajectoryObjective(problem, records, problem.file.study.noise)
        assert gap == pytest.approx(alone.costs(problem.initial[None])[0], rel=1e-9)


def test_only_torques_are_compared_and_records_stand_in_their_order(case: Path) -> None:
    problem = study(case, fed=("two",))
    result = evaluate_simulation(problem)
    assert [set(one.comparisons) for one in result.records.values()] == [
        {"motor_position", "motor_torque"},
        {"motor_torque"},
        {"motor_position", "motor_torque"},
    ]
    alone = evaluate_simulation(study(case, fed=()))
    for name in ("one", "three"):
        now, before = (one.records[name].signals["motor_position"].values for one in (result, alone))
        np.testing.assert_allclose(now, before, atol=1e-12)
    recorded = problem.records[1].measured
    assert recorded is not None
    turned = result.records["two"].signals["motor_position"].values[::4, 0]
    np.testing.assert_allclose(turned, recorded.signals["motor_position"][:, 0], atol=1e-9)


def test_candidates_side_by_side(case: Path) -> None:
    free = {"mass": {"initial": 0.0, "bounds": [-0.5, 1.0]}}
    problem = study(case, fed=("two",), bodies=free)
    both = problem.run(np.array([[0.0], [0.3]]), problem.records).torque
    for row, value in enumerate((0.0, 0.3)):
        alone = problem.run(np.array([[value]]), problem.records).torque
        np.testing.assert_allclose(both[3 * row : 3 * row + 3], alone, atol=1e-9)


def test_what_the_recorded_motion_takes_is_reported_beside_what_the_controller_does(case: Path) -> None:
    """The same torques as of records that are fed in; the comparison with the controller is as without."""
    both = evaluate_simulation(study(case, fed=(), inverse_dynamics_hz=30.0))
    plain, fed = evaluate_simulation(study(case, fed=())), evaluate_simulation(study(case))
    for name, record in both.records.items():
        assert record.fed is not None
        assert set(record.fed) == {"motor_torque"}
        alone = fed.records[name].comparisons["motor_torque"].rms[0, 0]
        assert record.fed["motor_torque"].rms[0, 0] == pytest.approx(alone, rel=1e-9)
        ours, theirs = (one.records[name].comparisons["motor_torque"].rms for one in (both, plain))
        np.testing.assert_array_equal(ours, theirs)
    titles = [table.title for table in rms_tables(both)]
    assert "RMS difference of motor torque, with the recorded motion fed in" in titles
    springs = [{"kind": "joint-compliance", "axes": ["rz"]}]
    with pytest.raises(InputError, match=r"inverse_dynamics_hz: joint1.rz is elastic"):
        study(case, fed=(), effects=springs, inverse_dynamics_hz=30.0)


def test_what_cannot_be_fed_in_is_refused(case: Path) -> None:
    springs = [{"kind": "joint-compliance", "axes": ["rz"]}]
    with pytest.raises(InputError, match=r"joint1.rz is elastic; expected a rigid arm"):
        study(case, effects=springs)
    with pytest.raises(
        InputError, match=r"recorded_motion_hz: 900 Hz at 250 samples a second; expected .* 125"
    ):
        data = json.loads((case / "fed.yaml").read_text())
        data["records"][0]["recorded_motion_hz"] = 900.0
        study(case, effects=[], records=data["records"], fed=())
