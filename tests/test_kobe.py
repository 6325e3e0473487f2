"""The Kobe study: its data agree with the truth behind them and not with less, its controllers hold, and it
runs as configured.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from identify.fitting.fit import fit
from identify.modal.analysis import analyse
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.target import FrfTarget
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap
from tests.digits import nine_digits
from tests.generator.kobe import CHAIN, fastest, plant, truth
from tests.generator.kobe_arm import kobe

ROOT = Path(__file__).parents[1]
ELASTIC = """
  - {kind: base-compliance, axes: [rx, ry]}
  - {kind: link-flexibility, link: link1}
"""


@cache
def _truth() -> dict[str, float]:
    """Parameters by name as data/kobe_36dof/truth.json has them."""
    told = json.loads((ROOT / "data" / "kobe_36dof" / "truth.json").read_text())
    values = {}
    for joint, (springs, dampers) in enumerate(zip(told["stiffness"], told["damping"], strict=True), start=1):
        for axis, k, c in zip(told["axes"], springs, dampers, strict=True):
            values[f"joint{joint}.{axis}.stiffness"], values[f"joint{joint}.{axis}.damping"] = k, c
    base, link = told["effects"]
    for axis, k, c in zip(base["axes"], base["stiffness"], base["damping"], strict=True):
        values[f"base.{axis}.stiffness"], values[f"base.{axis}.damping"] = k, c
    length = float(np.linalg.norm(link["along"]))
    # A cantilever of hinges bends less than a beam: 1/3 of L^3/EI where two hinges give 0.3125.
    for name, share in (("bending_1", 0.3125 * 3), ("bending_2", 0.3125 * 3), ("torsion", 1.0)):
        values[f"link1.{name}.stiffness"] = link["bending_stiffness"] / link["segments"] * length / share
        values[f"link1.{name}.damping"] = link["bending_damping"] / link["segments"] * length / share
    return values


def _problem(folder: Path, text: str) -> Problem:
    path = folder / "config.yaml"
    path.write_text(text.replace("../data", str(ROOT / "data")))
    return load_problem(read_study(path))


def _at_truth(problem: Problem) -> np.ndarray:
    return np.array([_truth().get(parameter.name, parameter.initial) for parameter in problem.parameters])


def test_data_agree_with_the_truth_and_with_nothing_less(tmp_path: Path) -> None:
    """The generator's sampled controllers and hinges against the model's continuous ones and a beam: nearly
    the noise.
    """
    text = (ROOT / "configs" / "kobe_36dof_defaults.yaml").read_text()
    gaps = {}
    for name, config in {
        "whole truth": text + ELASTIC,
        "rigid base and link": text,
        "slow servo": text.replace("current_bandwidth_hz: 400", "current_bandwidth_hz: 20") + ELASTIC,
        "no integral": text.replace("integral_time_s: 0.05", "integral_time_s: 100.0") + ELASTIC,
    }.items():
        problem = _problem(tmp_path, config)
        gaps[name] = gap(problem.targets(), _at_truth(problem))
    assert gaps.pop("whole truth") < 2.5
    assert min(gaps.values()) > 4, gaps


def test_modes_are_where_the_paper_finds_them(tmp_path: Path) -> None:
    """Section 4: first mode near 15 Hz without J4 to J6, near 10 and 20 Hz with them, in phase and then out
    of phase across J3.
    """
    problem = _problem(tmp_path, (ROOT / "configs" / "kobe_36dof.yaml").read_text())
    detached, whole, _ = problem.measurements
    assert isinstance(detached.target, FrfTarget) and isinstance(whole.target, FrfTarget)
    assert analyse(detached.target.data).table.frequency_hz[0] == pytest.approx(15, abs=1)
    table = analyse(whole.target.data).table
    assert table.shapes is not None
    columns = {(channel.node, channel.axis): number for number, channel in enumerate(table.channels)}
    for wanted, sign in ((10.0, 1.0), (20.0, -1.0)):
        mode = int(np.argmin(np.abs(table.frequency_hz - wanted)))
        assert table.frequency_hz[mode] == pytest.approx(wanted, abs=1.5)
        ratio = (
            table.shapes[mode, columns[19, 1]] / table.shapes[mode, columns[44, 1]]
        )  # link 2 against link 6, along Y
        assert sign * ratio.real > 0.2 > abs(ratio.imag)


def test_the_study_runs_in_its_two_stages(tmp_path: Path) -> None:
    text = (
        (ROOT / "configs" / "kobe_36dof.yaml").read_text().replace("evaluations: 10000", "evaluations: 200")
    )
    problem = _problem(tmp_path, text)
    assert sum(parameter.free for parameter in problem.parameters) == 72
    assert (
        sum(
            name.split(".")[1] not in ("rotor", "servo")
            for name in problem.measurements[1].system.coordinates
        )
        == 36
    )
    found = fit(fit_plan(problem))
    area = parse_cost("frf-area").objective(problem.targets())
    initial = np.array([parameter.initial for parameter in problem.parameters])
    assert found.cost < area.costs(initial[None])[0]
    assert set(found.history[:, 1]) == {0, 1}


def test_controllers_carry_the_weight_and_return_what_was_pushed_away() -> None:
    held = plant(kobe(), 3)
    assert fastest(held) * CHAIN.step < 1.5
    still = held.respond(held.sensors[-1], lambda time: np.zeros(3), 0.0, CHAIN.step, 200)
    assert np.abs(still).max() < 1e-6
    held.respond(
        held.sensors[-1], lambda time: np.array([0.0, 0.0, 50.0]), 1.0, CHAIN.step, round(1.0 / CHAIN.step)
    )
    rotor, gear = (held.data.qpos[held.coordinates.index(f"joint2.{name}")] for name in ("rotor", "rz"))
    assert abs(rotor) < 0.02 * abs(gear), "the integral leaves no error where the gear winds up"


def test_shipped_truth_is_that_of_the_generator() -> None:
    assert nine_digits((ROOT / "data" / "kobe_36dof" / "truth.json").read_text()) == nine_digits(
        json.dumps(truth(kobe()))
    )
