"""When impacts are in their records is part of every model that discovery looks at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from identify.discovery.records import timed
from identify.discovery.run import run_discover
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import parse_effect
from identify.model.effects.pre_trigger import PRE_TRIGGER, PreTrigger
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

pytestmark = pytest.mark.usefixtures("no_measured_modes")

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


@pytest.fixture(scope="module")
def problem() -> Problem:
    """The shipped example with its data."""
    return load_problem(read_study(CONFIG))


def test_the_time_of_impacts_is_taken_up_once(problem: Problem) -> None:
    once = timed(problem)
    assert once.file.study.effects == [*problem.file.study.effects, PreTrigger()]
    assert timed(once) is once
    told = parse_effect({"kind": "pre-trigger", "time": {"initial": 0.01, "fixed": True}})
    stated = with_effects(problem, [*problem.file.study.effects, told], {})
    assert timed(stated) is stated


def test_frfs_without_a_window_are_not_those_of_impacts(problem: Problem) -> None:
    def whole(target: object) -> FrfTarget:
        assert isinstance(target, FrfTarget)
        return replace(target, record=None)

    shaken = replace(
        problem, measurements=tuple(replace(m, target=whole(m.target)) for m in problem.measurements)
    )
    assert timed(shaken) is shaken


def test_records_that_begin_before_the_impact_leave_no_gap(tmp_path: Path) -> None:
    """Their window lets the slowest mode ring on beyond the end."""
    arm = MAKES["compact"](5).at_points([5, 9, 12, 14])
    spec = TestSpec(
        arm=arm,
        seed=5,
        postures=2,
        averages=2,
        binary=True,
        linear=True,
        duration_s=0.6,
        pre_trigger_s=0.02,
        window_decay_per_s=0.693,
    )
    generate(hide(spec, "none"), tmp_path / "none")
    config = config_of(tmp_path / "none", tmp_path, extra="starts: 1")
    result, _ = run_discover(config, tmp_path / "found.h5", {}, Story(), workers=1, as_stated=True)
    assert result.added.sentence == ()
    table = result.after.parameters
    row = table.name.index(PRE_TRIGGER)
    # The filter of the generator has 29 ms before, and the middle of a half-sine of 5 to 8 ms is another 3.
    assert table.value[row] == pytest.approx(0.0525, abs=2e-3)
    assert table.low_95[row] > 0.045
    assert result.before.gap < 1.1
