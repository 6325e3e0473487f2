"""The fast-chirp study: time histories to normalised responses that agree with the truth behind them, and
with nothing less.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from identify.fitting.fit import fit
from identify.model.frf import frf_by_solve
from identify.vibration.costs.target import FrfTarget
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from tests.digits import nine_digits
from tests.generator.chirp import Sweep, machine, path_rates, truth

ROOT = Path(__file__).parents[1]
DATA = ROOT / "data" / "fast_chirp_rx160"
CELL = (
    "  - {kind: load-cell, link: link6, at_m: 0.26, centre_m: [0, 0, 0.2367], mass: {initial: 9, fixed:"
    " true}}\n"
)


@cache
def _truth() -> dict[str, float]:
    """Parameters by name as truth.json has them."""
    told = json.loads((DATA / "truth.json").read_text())
    values = {"link6.cell.mass": told["spindle"]["mass"]}
    for joint, (springs, dampers) in enumerate(zip(told["stiffness"], told["damping"], strict=True), start=1):
        for axis, k, c in zip(told["axes"], springs, dampers, strict=True):
            values[f"joint{joint}.{axis}.stiffness"], values[f"joint{joint}.{axis}.damping"] = k, c
    for number, axis in enumerate("xyz"):
        values[f"base.r{axis}.stiffness"], values[f"base.r{axis}.damping"] = (
            told["base"][0][number],
            told["base"][1][number],
        )
        values[f"link6.cell_{axis}.stiffness"], values[f"link6.cell_{axis}.damping"] = (
            told["cell"][0][number],
            told["cell"][1][number],
        )
    return values


def _problem(folder: Path, text: str, only: tuple[str, ...] = ()) -> Problem:
    """The study in `text`, or some of its measurements."""
    path = folder / "config.yaml"
    path.write_text(text.replace("../data", str(ROOT / "data")))
    file = read_study(path)
    chosen = [m for m in file.study.measurements if not only or m.name in only]
    return load_problem(
        file.model_copy(update={"study": file.study.model_copy(update={"measurements": chosen})})
    )


def _errors(problem: Problem, name: str) -> dict[str, float]:
    """RMS difference of logarithmic magnitudes between truth and measurement, below and above 24 Hz."""
    target = next(m.target for m in problem.measurements if m.name == name)
    assert isinstance(target, FrfTarget)
    h = target.predict_pairs(np.array([_truth().get(p.name, p.initial) for p in problem.parameters]))
    difference = np.log(np.abs(h) / np.abs(target.measured)) ** 2
    f = target.data.frequency_hz
    parts = {"low": (f > 10) & (f < 24), "high": f >= 24}
    return {part: float(np.sqrt(difference[lines].mean())) for part, lines in parts.items()}


def test_the_responses_are_those_of_the_true_joints_and_of_a_rotating_force(tmp_path: Path) -> None:
    text = (ROOT / "configs" / "fast_chirp_rx160.yaml").read_text()
    problem = _problem(tmp_path, text)
    for zone in ("zone1", "zone4", "zone5"):
        errors = _errors(problem, zone)
        assert max(errors.values()) < 0.12, (zone, errors)
    backwards = _problem(
        tmp_path,
        text.replace("acts_at: ['14:+X', '14:+Y']", "acts_at: ['14:+X', '14:-Y']"),
        ("zone1", "zone5"),
    )
    assert _errors(backwards, "zone5")["low"] > 0.5, "a force that turned the other way would not do"
    assert sum(p.free for p in problem.parameters) == 42
    own = [name.split(".")[1] for name in problem.measurements[0].system.coordinates]
    assert len([name for name in own if name != "servo"]) == 27, "Eq. 3"


def test_the_load_cell_is_in_the_force_of_the_formula_and_not_in_that_of_the_cell(tmp_path: Path) -> None:
    """Above 24 Hz; with the formula the model needs the cell, with the corrected force of the cell it must
    not have it.
    """
    text = (ROOT / "configs" / "fast_chirp_rx160_formula.yaml").read_text()
    cases = {
        (force, cell): text.replace("force: formula", f"force: {force}") + CELL * cell
        for force in ("formula", "load-cell")
        for cell in (0, 1)
    }
    high = {
        case: _errors(_problem(tmp_path, config, ("zone5",)), "zone5")["high"]
        for case, config in cases.items()
    }
    assert high["formula", 1] < 0.7 * high["formula", 0], high
    assert high["load-cell", 0] < 0.8 * high["load-cell", 1], high


def test_the_study_runs_and_approaches_the_data(tmp_path: Path) -> None:
    text = (
        (ROOT / "configs" / "fast_chirp_rx160_xy.yaml")
        .read_text()
        .replace("evaluations: 12000", "evaluations: 150")
    )
    problem = _problem(tmp_path, text)
    initial = np.array([p.initial for p in problem.parameters])
    objective = problem.file.study.cost.objective(problem.targets())
    assert fit(fit_plan(problem)).cost < objective.costs(initial[None])[0]


def test_the_tool_moves_at_ten_millimetres_a_second_and_the_spindle_as_stated() -> None:
    robot, angle = machine(), Sweep().turning(np.array([0.0, 2.0, 4.0, 5.0]))
    for measurement in ("zone1", "zone4"):
        assert 1e-3 < np.abs(path_rates(robot, measurement)).max() < 0.05
    assert angle[1] / (2 * np.pi) == pytest.approx([0, 20, 40, 0])
    assert angle[0] / (2 * np.pi) == pytest.approx([0, 20, 80, 100])
    assert np.linalg.norm(Sweep().force(3.9999)) == pytest.approx(0.16 * 0.02 * (80 * np.pi) ** 2, rel=1e-3)


def test_shipped_truth_is_that_of_the_generator() -> None:
    assert nine_digits((DATA / "truth.json").read_text()) == nine_digits(json.dumps(truth(machine())))


def test_hzz_is_that_of_equations_six_to_eight(tmp_path: Path) -> None:
    """With G the inverse of H: Eq. 8 as printed, Eq. 7 with the sign of its second part put right."""
    problem = _problem(tmp_path, (ROOT / "configs" / "fast_chirp_rx160.yaml").read_text(), ("hammer",))
    target = next(m.target for m in problem.measurements if m.name == "hammer")
    assert isinstance(target, FrfTarget)
    system, s = target.system, target.data.s[::20]
    tool = system.jacobian("link6", problem.points[14].position)[:3]
    h = frf_by_solve(*system.matrices(np.array([p.initial for p in problem.parameters])), s, tool, tool.T, 0)
    g = np.linalg.inv(h)
    det = np.linalg.det(g)
    assert (g[:, 0, 0] * g[:, 1, 1] - g[:, 0, 1] * g[:, 1, 0]) / det == pytest.approx(h[:, 2, 2], rel=1e-6)
    assert (g[:, 0, 1] * g[:, 1, 2] - g[:, 0, 2] * g[:, 1, 1]) / det == pytest.approx(h[:, 2, 0], rel=1e-6)
    assert -(g[:, 0, 0] * g[:, 1, 2] - g[:, 0, 2] * g[:, 1, 0]) / det == pytest.approx(h[:, 2, 1], rel=1e-6)
