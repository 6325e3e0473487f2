"""What hangs on links beside gears, and what comes late: bodies, balancers, torque gains, latencies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputErrors
from identify.motion.problem import MotionProblem
from identify.motion.simulate import SimulatedMotion
from tests.motion import arms

RECORD = {"name": "a", "start_deg": [0.0, 20.0, 10.0], "duration_s": 0.5}
MOVES = [arms.move(2, 8, 60), arms.move(3, -8, 60)]
SERVO = {**arms.CASCADE, "velocity_gain": [3000.0, 3000.0, 800.0], "position_gain": 20.0}


def heavier(robot: dict[str, Any], joint: int, by: float) -> dict[str, Any]:
    """The robot with a body that has more mass and moments."""
    link = robot["links"][joint - 1]
    link["mass_kg"] *= 1 + by
    link["inertia_kg_m2"] = [(1 + by) * moment for moment in link["inertia_kg_m2"]]
    return robot


def moved(folder: Path, robot: dict[str, Any], **keys: Any) -> tuple[MotionProblem, SimulatedMotion]:
    problem = arms.study(folder, robot, servo=SERVO, records=[{**RECORD, "moves": MOVES}], **keys)
    return problem, problem.run(problem.initial[None], problem.records)


def elastic() -> list[dict[str, Any]]:
    springs = {"stiffness": {"initial": 5e4, "fixed": True}, "damping": {"initial": 20.0, "fixed": True}}
    return [{"kind": "joint-compliance", "axes": ["rz"], **springs}]


@pytest.mark.parametrize("effects", [[], elastic()])
def test_a_heavier_body_moves_as_one_that_is_described_so(tmp_path: Path, effects: list[Any]) -> None:
    _, told = moved(tmp_path / "a", heavier(arms.three_links(), 2, 0.3), effects=effects)
    _, found = moved(tmp_path / "b", arms.three_links(), bodies={"mass": [0, 0.3, 0]}, effects=effects)
    np.testing.assert_allclose(found.coordinates, told.coordinates, atol=1e-9)
    np.testing.assert_allclose(found.torque, told.torque, rtol=1e-7, atol=1e-6)
    _, light = moved(tmp_path / "c", arms.three_links(), effects=effects)
    assert np.abs(light.torque - told.torque).max() > 1.0


def test_lanes_of_other_masses_move_as_each_alone(tmp_path: Path) -> None:
    free = {"mass": {"initial": 0.0, "bounds": [-0.5, 1.0], "joints": [2]}}
    problem, light = moved(tmp_path, arms.three_links(), bodies=free)
    assert [p.name for p in problem.parameters] == ["joint2.bodies.mass"]
    together = problem.run(np.array([[0.0], [0.4], [0.2], [0.4]]), problem.records)
    alone = [problem.run(np.array([[share]]), problem.records).torque[0] for share in (0.4, 0.2)]
    for lane, torque in enumerate([light.torque[0], *alone, alone[0]]):
        np.testing.assert_allclose(together.torque[lane], torque, rtol=1e-9)
    assert np.abs(alone[1] - light.torque[0]).max() > 1.0


@pytest.mark.parametrize("effects", [[], elastic()])
def test_a_balancer_takes_its_torque_off_what_holds_at_rest(tmp_path: Path, effects: list[Any]) -> None:
    told = {"sine": [0, 40.0, 0], "cosine": [0, -25.0, 0]}
    problem, balanced = moved(tmp_path / "a", arms.three_links(), balancer=told, effects=effects)
    _, plain = moved(tmp_path / "b", arms.three_links(), effects=effects)
    turn = np.radians(20.0)
    names = problem.arm.names
    if effects:
        turn += balanced.coordinates[0, 0, names.index("joint2.rz")]
    by = 40.0 * np.sin(turn) - 25.0 * np.cos(turn)
    assert plain.torque[0, 0, 1] - balanced.torque[0, 0, 1] == pytest.approx(by, abs=0.3)
    still = np.abs(balanced.velocities[0, :20]).max()
    assert still < 1e-4  # it begins in equilibrium


def test_a_motor_that_gives_more_than_it_reports(tmp_path: Path) -> None:
    _, plain = moved(tmp_path / "a", arms.three_links())
    halved = {**SERVO, "velocity_gain": [1500.0, 1500.0, 400.0]}
    problem = arms.study(
        tmp_path / "b",
        arms.three_links(),
        servo=halved,
        motor={**arms.PLAIN_MOTOR, "torque_gain": 2.0},
        records=[{**RECORD, "moves": MOVES}],
    )
    strong = problem.run(problem.initial[None], problem.records)
    np.testing.assert_allclose(strong.coordinates, plain.coordinates, atol=1e-10)
    np.testing.assert_allclose(2 * strong.torque, plain.torque, atol=1e-6)


def test_a_latency_of_whole_steps_is_a_delay(tmp_path: Path) -> None:
    servo = {**SERVO, "period_s": 2e-3}
    records = [{**RECORD, "moves": MOVES}]
    motions = []
    for name, keys in (
        ("a", {"delay_s": 2e-3}),
        ("b", {"latency": 2e-3}),
        ("c", {"latency": 1.9e-3}),
        ("d", {}),
    ):
        problem = arms.study(
            tmp_path / name, arms.three_links(), servo={**servo, **keys}, step_s=1e-3, records=records
        )
        motions.append(problem.run(problem.initial[None], problem.records).coordinates)
    delayed, late, nearly, prompt = motions
    np.testing.assert_allclose(late, delayed, atol=1e-12)
    off, all_of_it = np.abs(nearly - delayed).max(), np.abs(prompt - delayed).max()
    assert 0 < off < 0.15 * all_of_it


def test_a_number_of_joints_that_are_not_there_is_refused(tmp_path: Path) -> None:
    free = {"mass": {"initial": 0.0, "bounds": [-0.5, 1.0], "joints": [4]}}
    with pytest.raises(
        (InputErrors, Exception), match=r"bodies.mass.joints: \[4\]; expected numbers from 1 to 3"
    ):
        moved(tmp_path, arms.three_links(), bodies=free)
