"""The step of integration: extrapolated to none, checked after every fit, named where it is too large."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.core.errors import InputErrors
from identify.core.parameters import Scale
from identify.motion.problem import MotionProblem
from identify.motion.step_error import StepError, step_error
from identify.motion.trajectory import TrajectoryObjective, trajectory_trust
from tests.motion import arms
from tests.motion.test_nagoya import ROOT, study

Array = NDArray[np.float64]
_KNOWN = (
    ("cubic_stiffness: {initial: 1.0e+10, bounds: [1.0e+8, 1.0e+13]}", "cubic_stiffness: [8.0e+10, 4.0e+10]"),
    ("amplitude: {initial: 3.0e-5, bounds: [1.0e-6, 1.0e-3]}", "amplitude: [8.0e-5, 6.0e-5]"),
    ("phase: {initial: [0.0, 1.0], bounds: [-3.2, 3.2]}", "phase: [0.6, 1.9]"),
    ("coulomb: {initial: 200, bounds: [1, 5000]}", "coulomb: [400, 200]"),
    ("viscous: {initial: 100, bounds: [1, 5000]}", "viscous: [300, 150]"),
    ("stribeck: {initial: 50, bounds: [1, 5000]}", "stribeck: [250, 120]"),
    ("stribeck_velocity: {initial: 0.03, bounds: [0.005, 0.5]}", "stribeck_velocity: 0.05"),
)
"""What is not fitted here: all but stiffness and damping of the joints."""


def _problem(folder: Path) -> tuple[MotionProblem, Array]:
    """The first 1.3 s of one fast move of the shipped study, not extrapolated, at its true numbers."""
    path = ROOT / "data" / "nagoya_two_link" / "fast1.csv"
    head, *rows = path.read_text().splitlines()
    short = [head, *(row for row in rows if float(row.split(",")[0]) < 1.3)]
    (folder / "short.csv").write_text("\n".join(short) + "\n")
    begin = "start_deg: [100, -100]\n    duration_s: 4.0"
    brief = (begin, begin.replace("4.0", "1.3"))
    file = (str(path), str(folder / "short.csv"))
    return study("nagoya_two_link", folder, brief, file, ("extrapolate: true", "extrapolate: false"), *_KNOWN)


def test_extrapolation_takes_out_what_is_in_proportion_to_the_step(tmp_path: Path) -> None:
    """A damped pendulum that a spring drives, against a quarter of the step, extrapolated."""
    friction = {"coulomb": 2.0, "viscous": 6.0, "creep_velocity": 0.05}
    record = [{"name": "turn", "start_deg": [0.0], "duration_s": 0.6, "moves": [arms.move(1, 20, 90)]}]

    def moved(step_s: float, extrapolate: bool) -> Array:
        keys = {"friction": friction, "records": record, "step_s": step_s, "extrapolate": extrapolate}
        problem = arms.study(tmp_path, arms.one_link(9.81), **keys)
        return problem.run(problem.initial[None], problem.records).coordinates[0]

    exact = moved(2.5e-4, True)
    plain, better = (np.sqrt(np.mean((moved(1e-3, way) - exact) ** 2)) for way in (False, True))
    assert plain > 8 * better


def _checked(problem: MotionProblem, values: Array) -> StepError:
    chosen = [record for record in problem.records if record.settings.name == "fast1"]
    objective = TrajectoryObjective(problem, chosen, problem.file.study.noise)
    scale = Scale(problem.parameters)
    seen = objective.residuals(values, scale.free)
    return step_error(objective, scale, values, seen, trajectory_trust(objective, scale, values, seen))


def test_a_step_that_moves_values_out_of_their_intervals_is_named(tmp_path: Path) -> None:
    found = _checked(*_problem(tmp_path))
    assert not found.good
    assert "extrapolate: true" in found.sentence()
    assert found.names[int(np.argmax(np.abs(found.shift)))] in found.sentence()
    assert found.mismatch == pytest.approx(0.2, abs=0.1)


def test_a_step_that_moves_no_value_by_much_is_good() -> None:
    names = ("joint1.rz.stiffness", "joint1.rz.damping")
    found = StepError(5e-4, 0.01, names, np.array([0.1, -0.2]))
    assert found.good
    assert "no value by more than 0.2 of half its interval" in found.sentence()
    assert not StepError(5e-4, 0.01, names, np.array([0.1, -0.3])).good


def test_counts_cannot_be_extrapolated(tmp_path: Path) -> None:
    record = [{"name": "turn", "start_deg": [0.0], "duration_s": 1.0, "moves": [arms.move(1, 30, 90)]}]
    with pytest.raises(InputErrors, match="encoder_counts"):
        arms.study(tmp_path, arms.one_link(0.0), encoder_counts=[4096], extrapolate=True, records=record)
