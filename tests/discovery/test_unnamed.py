"""What gives way without a name is in the intervals of the drives, on a test simulated by a generator that
shares no code with the fit.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from identify.core.parameters import Scale
from identify.core.threads import one_thread
from identify.discovery import unnamed
from identify.discovery.records import timed
from identify.discovery.state import Added, State
from identify.discovery.task import Task, Trial
from identify.discovery.trial import TrialRunner
from identify.discovery.unnamed import _left_open, left_open
from identify.discovery.workers import Workers
from identify.fitting.uncertainty import Uncertainty
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.nonlinear import JointFriction
from identify.vibration.intervals import with_left_open
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study
from identify.vibration.uncertainty import uncertainty
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

_STRENGTH = 0.05
"""Share of the compliance of a link that is clearly visible."""


@pytest.fixture(scope="module")
def tilted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Problem, Trial, list[float]]:
    """An arm whose joint 2 tilts, with a link that bends hardly, the model that has the tilt alone, and the
    stiffnesses of its drives.
    """
    folder = tmp_path_factory.mktemp("unnamed")
    arm = MAKES["compact"](3).at_points([5, 9, 12, 14])
    spec = TestSpec(arm, seed=3, postures=2, averages=4, binary=True, oversampling=4, linear=True)
    effects = (*hide(spec, "tilt_j2").effects, *hide(spec, "link2_flex", _STRENGTH).effects)
    generate(replace(spec, case="test", effects=effects), folder / "test")
    problem = timed(load_problem(read_study(config_of(folder / "test", folder))))
    true = json.loads((folder / "test.truth.json").read_text())["k"]
    tilt = JointCompliance(joints=[2], axes=["rx", "ry"])
    with one_thread():
        task = Task(problem.file.study.effects, (tilt,), problem.starts, whole=True)
        return problem, TrialRunner(problem).run(task), true


def _errors(problem: Problem, model: Trial, found: Uncertainty, true: list[float]) -> np.ndarray:
    """(joints,): how far true stiffnesses are from their values, in half widths of their intervals."""
    names = [p.name for p in with_effects(problem, model.task.effects, model.values).of_effects]
    rows = [names.index(f"joint{n}.rz.stiffness") for n in range(1, len(true) + 1)]
    half = np.log(found.high[rows] / found.low[rows]) / 2
    return np.abs(np.log(true / np.array([model.values[names[row]] for row in rows]))) / half


def test_true_stiffnesses_are_in_intervals_that_know_of_a_link_without_a_name(
    tilted: tuple[Problem, Trial, list[float]],
) -> None:
    problem, model, true = tilted
    known = with_effects(problem, model.task.effects, model.values)
    plain = uncertainty(known.targets(), Scale(known.parameters), known.initial)
    with one_thread():
        opened = _left_open(State(problem, model))
    wider = with_left_open(known, plain, known.initial, opened)
    assert _errors(problem, model, plain, true).max() > 2
    assert _errors(problem, model, wider, true).max() < 1.2
    assert any("too stiff to be named" in note for note in wider.notes)


def test_nothing_is_left_open_where_nothing_was_found_or_impacts_are_simulated(
    tilted: tuple[Problem, Trial, list[float]],
) -> None:
    problem, model, _ = tilted
    friction = replace(model.task, new=(JointFriction(joints=[2]),))
    named = (Added(model.task.new[0], 100.0),)
    workers = cast("Workers", None)  # not asked
    assert left_open(workers, State(problem, model)) == {}
    assert left_open(workers, State(problem, replace(model, task=friction), named)) == {}


def test_by_how_much_values_move_counts(
    tilted: tuple[Problem, Trial, list[float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside how much less they are determined, which is taken away here."""
    problem, model, true = tilted
    monkeypatch.setattr(unnamed, "_variance", lambda information: np.zeros(len(information)))
    with one_thread():
        moved = unnamed._left_open(State(problem, model))
    error = abs(np.log(model.values["joint2.rz.stiffness"] / true[1]))
    assert 0.3 * error < moved["joint2.rz.stiffness"] < 3 * error
