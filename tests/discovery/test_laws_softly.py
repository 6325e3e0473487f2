"""Laws that no effect has, in place of springs, beside errors of what was told: by workers of canned ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

import pytest

from identify.discovery.laws_softly import leaning_softly, with_laws
from identify.discovery.task import Task, Trial
from identify.discovery.workers import Workers
from identify.model.effects.base import Effect, parse_effect
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
TILT = parse_effect({"kind": "joint-compliance", "joints": [3], "axes": ["rx", "ry"]})
VALUES = {"joint3.rx.stiffness": 3e4, "joint3.ry.stiffness": 8e4, "1.x.error": 4.0}
COUNT = 10_000


@pytest.fixture(scope="module")
def problem() -> Problem:
    """The shipped example."""
    return load_problem(read_study(CONFIG))


class _Told:
    """Workers whose trials leave what a function of the law says."""

    def __init__(self, squares: Callable[[MeasuredImpedance], float]) -> None:
        self.squares, self.tasks = squares, list[Task]()

    def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
        """As told; data that were not fitted say the same."""
        self.tasks += tasks
        left = [self.squares(cast(MeasuredImpedance, task.new[0])) * COUNT for task in tasks]
        return [
            Trial(task, task.values, one, COUNT, one, COUNT, free=20)
            for task, one in zip(tasks, left, strict=True)
        ]


def _trial(effect: Effect, gap: float) -> Trial:
    squares = gap**2 * COUNT
    return Trial(Task((), (effect,), VALUES), VALUES, squares, COUNT, squares, COUNT, free=16)


def _about_x(gap: float) -> Callable[[MeasuredImpedance], float]:
    """A law about the first axis leaves this gap; about the other, much."""
    return lambda law: (gap if "joint3.rx" in law.at else 5.0) ** 2


@pytest.mark.parametrize(
    ("gap", "left", "taken", "named"),
    [(1.3, 1.03, 2, True), (1.3, 1.15, 2, False), (1.12, 1.09, 0, False)],
)
def test_a_law_takes_the_place_of_springs_if_it_takes_most_of_what_they_leave(
    problem: Problem, gap: float, left: float, taken: int, named: bool
) -> None:
    """And closes the gap; more parameters always leave a little less, and what takes too little of it on few
    lines is not taken to all of them.
    """
    best, workers = _trial(TILT, gap), _Told(_about_x(left))
    groups = with_laws(cast(Workers, workers), problem, [[best]])
    assert groups[0] == [best]
    laws = [cast(MeasuredImpedance, one.task.new[0]) for group in groups[1:] for one in group]
    assert bool(laws) is named
    assert all("joint3.rx" in law.at for law in laws)
    looked = [task for task in workers.tasks if task.how == "likely"]
    assert len(looked) == 4, "laws that are far behind go no further than a quick look"
    assert sum(task.how == "onward" for task in workers.tasks) == taken


def test_laws_begin_at_the_springs_without_their_errors(problem: Problem) -> None:
    """Those are bent to make up for what springs are not."""
    workers = _Told(_about_x(1.03))
    with_laws(cast(Workers, workers), problem, [[_trial(TILT, 1.3)]])
    at = [(task.new[0].at, task.new[0].branches) for task in workers.tasks if task.how == "quick"]  # type: ignore[attr-defined]
    names = ["joint3.rx", "joint3.ry"]
    assert at == [(some, count) for some in (names, names[:1], names[1:]) for count in (1, 2)]
    for task in workers.tasks:
        assert "1.x.error" not in task.values
        assert task.values["joint3.rx.stiffness"] == 3e4
    single = workers.tasks[2].values
    assert single["joint3.rx.branch_1.stiffness"] == pytest.approx(0.2 * 3e4)
    assert "joint3.ry.branch_1.stiffness" not in single


@pytest.mark.parametrize(
    ("effect", "gap"),
    [(TILT, 1.05), (TILT, 2.5), (parse_effect({"kind": "link-flexibility", "link": "link2"}), 1.3)],
)
def test_laws_are_tried_only_where_springs_nearly_close_the_gap(
    problem: Problem, effect: Effect, gap: float
) -> None:
    best, workers = _trial(effect, gap), _Told(_about_x(1.0))
    assert with_laws(cast(Workers, workers), problem, [[best]]) == [[best]]
    assert not workers.tasks
    assert with_laws(cast(Workers, workers), problem, []) == []


def test_the_axis_of_a_single_law_turns_to_where_it_leaves_least(problem: Problem) -> None:
    """Here at slopes of 0.03 and -0.02, where it leaves next to nothing."""

    def squares(law: MeasuredImpedance) -> float:
        x, z = (law.lean.get(f"joint3.{axis}", 0.0) for axis in ("rx", "rz"))
        return 1.04 + 200 * (x - 0.03) ** 2 + 50 * (z + 0.02) ** 2

    law = MeasuredImpedance(at=["joint3.ry"], branches=2)
    plain = Trial(Task((), (law,), VALUES), VALUES, squares(law) * COUNT, COUNT)
    [turned] = leaning_softly(cast(Workers, _Told(squares)), plain).task.new
    assert cast(MeasuredImpedance, turned).lean == pytest.approx({"joint3.rx": 0.03, "joint3.rz": -0.02})
    flat = leaning_softly(cast(Workers, _Told(lambda law: 2.0)), plain)
    assert flat is plain, "nothing tells a direction"


def test_a_law_is_named_about_its_own_axis(problem: Problem) -> None:
    """What a single axis leaves open is its direction."""

    def squares(law: MeasuredImpedance) -> float:
        if "joint3.ry" not in law.at:
            return 9.0
        return 1.02**2 + 200 * (law.lean.get("joint3.rx", 0.0) - 0.03) ** 2

    groups = with_laws(cast(Workers, _Told(squares)), problem, [[_trial(TILT, 1.3)]])
    laws = [cast(MeasuredImpedance, one.task.new[0]) for group in groups[1:] for one in group]
    assert laws[0].lean == pytest.approx({"joint3.rx": 0.03})
