"""Candidates that are moved beside one motion, to first order, are where the engine moves them; what promises
most is the same.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.fitting.fit import Fit
from identify.motion import trajectory
from identify.motion.changed import coarse
from identify.motion.judging import FittedMotion
from identify.motion.missing.noise import with_noise
from identify.motion.missing.screen import Promise, promises
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from tests.generator import hidden_motion
from tests.motion import arms, kobe_begins

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
MOVES = [
    {"joint": joint, "start_s": 0.02, "by_deg": by, "speed_deg_s": 90.0, "acceleration_deg_s2": 900.0}
    for joint, by in ((1, 12.0), (2, -9.0), (3, 15.0))
]
FREE: dict[str, Any] = {
    "friction": {
        "coulomb": {"initial": [30, 40, 10], "bounds": [1, 100]},
        "viscous": {"initial": [9, 9, 4], "bounds": [0.1, 100]},
        "creep_velocity": 2e-3,
    },
    "motor": {"kind": "torque", "rotor_inertia": {"initial": 1e-3, "bounds": [1e-5, 1e-1]}},
    "bodies": {"mass": {"initial": [0.0, 0.0, 0.05], "bounds": [-0.5, 0.5]}},
    "balancer": {"sine": {"initial": 0.0, "bounds": [-500, 500]}},
}


def springs(damping: float) -> dict[str, Any]:
    """Of all joints, tilts and gears, free."""
    return {
        "kind": "joint-compliance",
        "joints": "all",
        "axes": ["rx", "ry", "rz"],
        "stiffness": {"initial": 4e5, "bounds": [1e4, 1e8]},
        "damping": {"initial": damping, "bounds": [1.0, 1e5]},
    }


def elastic(folder: Path) -> MotionProblem:
    """A quickly moving arm of three links with springs, friction, and a heavier forearm; two records."""
    record = {"start_deg": [10.0, 20.0, 30.0], "duration_s": 0.3}
    records = [
        {**record, "name": "one", "moves": MOVES},
        {**record, "name": "two", "moves": MOVES[1:]},
    ]
    effects = [springs(400.0)]
    return arms.study(folder, arms.three_links(), effects=effects, records=records, **FREE)


def test_lanes_beside_a_motion_are_where_the_engine_moves_them(tmp_path: Path) -> None:
    problem = elastic(tmp_path)
    start = problem.initial
    moved = np.tile(start, (len(start) + 1, 1))
    off = np.array([1e-3 * (p.initial if p.log else (p.upper - p.lower) / 10) for p in problem.parameters])
    moved[1 + np.arange(len(start)), np.arange(len(start))] += off
    near, exact = (
        problem.run(moved, problem.records, near=near).coordinates.reshape(
            len(moved), 2, -1, len(problem.arm.names)
        )
        for near in (True, False)
    )
    np.testing.assert_array_equal(near[0], exact[0])
    for n, parameter in enumerate(problem.parameters, start=1):
        away, right = near[n] - near[0], exact[n] - exact[0]
        assert np.linalg.norm(right) > 0, parameter.name
        assert np.linalg.norm(away - right) < 0.01 * np.linalg.norm(right), parameter.name


def test_a_motion_that_runs_away_takes_those_beside_it_along(tmp_path: Path) -> None:
    problem = elastic(tmp_path)
    fast = replace(problem, step_s=problem.file.study.servo.period_s)
    with np.errstate(all="ignore"):
        stiff = np.array([1e4 if p.name.endswith("stiffness") else 1.0 for p in problem.parameters])
        motion = fast.run(np.tile(stiff * problem.initial, (2, 1)), problem.records, near=True)
    assert np.isnan(motion.coordinates[:, -1]).all()


@pytest.fixture
def rocking(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FittedMotion:
    """An arm of two links on a base that rocks, of which its study says nothing, moving for 1.7 s, once."""
    monkeypatch.setattr(hidden_motion, "DURATION_S", 1.7)
    monkeypatch.setattr(hidden_motion, "PARTS", 4)
    rng = np.random.default_rng(90562)
    case = hidden_motion.drawn(rng, "compliance of the base", False)
    hidden_motion.write(case, tmp_path, rng, ["one"])
    problem = coarse(with_noise(load_motion(read_motion_study(tmp_path / "motion.yaml")))[0])
    return FittedMotion(problem, Fit(problem.initial, 1.0, (), np.zeros((0, 5)), 0.0))


@pytest.mark.exam
def test_what_promises_most_is_the_same_by_the_dear_way(
    rocking: FittedMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    def looked(most: int) -> list[Promise]:
        monkeypatch.setattr(trajectory, "_AS_FAST", most)
        return promises(replace(rocking))

    dear, cheap = looked(999), looked(0)
    assert len(dear) > 8
    assert [one.effect.name for one in cheap] == [one.effect.name for one in dear]
    odds = [[one.log_odds for one in found] for found in (cheap, dear)]
    np.testing.assert_allclose(odds[0], odds[1], rtol=0.02, atol=0.5)
    assert cheap[0].effect.name.startswith("compliance of the base")


def test_the_base_of_the_kobe_circle_promises_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first 0.1 s of its motion: without a list of candidates, out of all that the catalogue has."""
    begun = coarse(kobe_begins.first(600))
    found = promises(FittedMotion(begun, Fit(begun.initial, 1.0, (), np.zeros((0, 5)), 0.0)))
    assert found[0].effect.name.startswith("compliance of the base")
