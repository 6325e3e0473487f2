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


def _problem(folder: Path, **changes: str) -> tuple[MotionProblem, Array]:
    """The first 1.3 s of one fast move of the shipped study, at its true numbers."""
    text = "".join(f"{key}: {value}\n" for key, value in changes.items())
    path = ROOT / "data" / "nagoya_two_link" / "fast1.csv"
    head, *rows = path.read_text().splitlines()
    short = [head, *(row for row in rows if float(row.split(",")[0]) < 1.3)]
    (folder / "short.csv").write_text("\n".join(short) + "\n")
    begin = "start_deg: [100, -100]\n    duration_s: 4.0"
    brief = (begin, begin.replace("4.0", "1.3"))
    file = (str(path), str(folder / "short.csv"))
    return study("nagoya_two_link", folder, ("noise: {", f"{text}noise: {{"), brief, file)


def test_extrapolation_takes_out_what_is_in_proportion_to_the_step(tmp_path: Path) -> None:
    """A damped pendulum that a spring drives, against an eighth of the step, extrapolated."""
    friction = {"coulomb": 2.0, "viscous": 6.0, "creep_velocity": 0.05}
    record = [{"name": "turn", "start_deg": [0.0], "duration_s": 0.8, "moves": [arms.move(1, 30, 90)]}]

    def moved(step_s: float, extrapolate: bool) -> Array:
        keys = {"friction": friction, "records": record, "step_s": step_s, "extrapolate": extrapolate}
        problem = arms.study(tmp_path, arms.one_link(9.81), **keys)
        return problem.run(problem.initial[None], problem.records).coordinates[0]

    exact = moved(1.25e-4, True)
    plain, better = (np.sqrt(np.mean((moved(1e-3, way) - exact) ** 2)) for way in (False, True))
    assert plain > 8 * better


def _checked(problem: MotionProblem, values: Array) -> StepError:
    chosen = [record for record in problem.records if record.settings.name == "fast1"]
    objective = TrajectoryObjective(problem, chosen, problem.file.study.noise)
    scale = Scale(problem.parameters)
    seen = objective.residuals(values, scale.free)
    return step_error(objective, scale, values, seen, trajectory_trust(objective, scale, values, seen))


@pytest.mark.parametrize(("changes", "good"), [({}, False), ({"extrapolate": "true"}, True)])
def test_a_step_that_moves_values_out_of_their_intervals_is_named(
    tmp_path: Path, changes: dict[str, str], good: bool
) -> None:
    found = _checked(*_problem(tmp_path, **changes))
    assert found.good is good
    assert ("extrapolate: true" in found.sentence()) is not good
    assert found.mismatch == pytest.approx(0.02 if good else 0.2, abs=0.02 if good else 0.1)


def test_counts_cannot_be_extrapolated(tmp_path: Path) -> None:
    record = [{"name": "turn", "start_deg": [0.0], "duration_s": 1.0, "moves": [arms.move(1, 30, 90)]}]
    with pytest.raises(InputErrors, match="encoder_counts"):
        arms.study(tmp_path, arms.one_link(0.0), encoder_counts=[4096], extrapolate=True, records=record)
