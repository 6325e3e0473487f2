"""What is refitted beside the best candidates: neighbours, and a strut for springs in any direction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from identify.discovery.lean import leaning_task, may_lean
from identify.discovery.neighbours import siblings
from identify.discovery.siblings import (
    with_coupled,
    with_leaning,
    with_siblings,
    with_springs_beside,
    with_struts,
)
from identify.discovery.strut import _Strut, strut_task
from identify.discovery.task import Task, Trial
from identify.discovery.thinned import thinned
from identify.discovery.trial import TrialRunner
from identify.discovery.workers import Workers
from identify.model.effects.base import Effect, parse_effect
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.spring_to_ground import SpringToGround
from identify.vibration.given import Given
from identify.vibration.problem import Measurement, Problem, load_problem, with_effects
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
TILT = {"kind": "joint-compliance", "axes": ["rx", "ry"]}


@pytest.fixture(scope="module")
def problem() -> Problem:
    """The shipped example with its data."""
    return load_problem(read_study(CONFIG))


def _springs(problem: Problem) -> list[Effect]:
    return list(SpringToGround.instances(problem.robot, problem.points))


def test_siblings_are_of_the_same_kind_and_axes_right_beside(problem: Problem) -> None:
    springs = _springs(problem)
    beside = siblings(problem, springs[4], springs)
    links = [problem.robot.links[n].name for n in (2, 3, 4)]
    assert {one.link for one in beside if isinstance(one, SpringToGround)} == set(links)
    every = list(JointCompliance.instances(problem.robot, problem.points))
    found = siblings(problem, parse_effect(TILT | {"joints": [2]}), every)
    assert [one.sentence() for one in found] == [f"tilt compliance of joint {n} (rx, ry)" for n in (1, 2, 3)]
    assert not siblings(problem, parse_effect({"kind": "time-delay"}), every)


class _Sloping:
    """Workers that leave less the nearer springs are to the first link."""

    with_errors = False

    def __init__(self, problem: Problem, least: float) -> None:
        self.names, self.least = [link.name for link in problem.robot.links], least

    def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
        """As told."""
        links = [one.link for task in tasks for one in task.new if isinstance(one, SpringToGround)]
        gaps = [self.least + 0.01 * self.names.index(link) for link in links]
        return [
            Trial(task, {}, 1e5 * gap**2, 100_000, free=12) for task, gap in zip(tasks, gaps, strict=True)
        ]


@pytest.mark.parametrize(("least", "ends"), [(1.0, 1), (1.5, 5)])
def test_near_noise_neighbours_are_refitted_while_they_are_likelier(
    problem: Problem, least: float, ends: int
) -> None:
    """From link 5 down to link 1; where much is left, what else is missing comes first."""
    springs, known = _springs(problem), tuple(problem.file.study.effects)
    plain = [one.model_copy(update={"cross_coupling": False, "axes": ["x"]}) for one in springs]
    workers = cast(Workers, _Sloping(problem, least))
    first = workers.run([Task(known, (plain[-2],), {})])
    before = Trial(Task(known, (), {}), {}, 4e5, 100_000)
    groups = with_siblings(workers, problem, before, plain, [first])
    best = min((group[0] for group in groups), key=lambda trial: trial.squares).task.new[0]
    assert isinstance(best, SpringToGround)
    assert problem.robot.links[ends].name == best.link


def _measured(problem: Problem, model: Problem) -> Problem:
    """The problem with what a model predicts, and some noise, in place of its data."""
    rng = np.random.default_rng(1)

    def other(m: Measurement, told: Measurement) -> Measurement:
        frf = told.target.predict(model.initial)  # type: ignore[union-attr]
        noise = 0.001 * (np.abs(frf) + np.abs(frf).mean())
        frf = frf + noise * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape)) / np.sqrt(2)
        given: Given = replace(m.given, data=replace(m.given.data, frf=frf, noise=noise / np.sqrt(2)))
        return replace(m, given=given)

    pairs = zip(problem.measurements, model.measurements, strict=True)
    measured = replace(problem, measurements=tuple(other(m, told) for m, told in pairs))
    return with_effects(measured, problem.file.study.effects, {})


def test_a_strut_is_found_in_springs_in_any_direction(problem: Problem) -> None:
    """With its direction, stiffness and four parameters in place of twelve; and not where much is left."""
    known, true = tuple(problem.file.study.effects), np.array([0.6, -0.48, 0.64])
    thin = thinned(problem)
    link = thin.robot.links[3].name
    strut = {"kind": "spring-to-ground", "link": link, "at_m": [0.1, -0.2, 0.3]}
    own = {f"{link}.strut.stiffness": 3e5, f"{link}.strut.damping": 300.0}
    told = with_effects(thin, (*known, parse_effect(strut | {"direction": true.tolist()})), own)
    measured = _measured(thin, told)
    springs, runner = parse_effect(strut | {"cross_coupling": True}), TrialRunner(measured)
    values = {p.name: p.initial for p in measured.parameters}
    trial = runner.run(Task(known, (springs,), values, "onward"))
    assert trial.gap < 1.05
    starts = np.array(
        [y[-4:-1] for y in _Strut(with_effects(measured, trial.task.effects, trial.values)).starts()]
    )
    along = np.abs(starts @ true) / np.linalg.norm(starts, axis=1)
    assert along.max() > np.cos(np.radians(2.0)), "a linear step from the springs knows the direction"
    task = strut_task(measured, trial)
    assert task is not None
    [found] = task.new
    assert isinstance(found, SpringToGround)
    assert np.allclose(found.direction or 0.0, true, atol=0.03)
    with Workers(measured, 1) as workers:
        [[same, end]] = with_struts(workers, [[trial]])
    assert same is trial
    assert end.task.new == (found,)
    assert end.values[f"{link}.strut.stiffness"] == pytest.approx(3e5, rel=0.03)
    assert end.gap == pytest.approx(trial.gap, abs=0.01)
    assert trial.free - end.free == 8
    assert strut_task(measured, replace(trial, squares=4 * trial.squares)) is None


@pytest.mark.parametrize("lean", [0.03, 0.0])
def test_a_measured_law_leans_where_the_data_show_it(problem: Problem, lean: float) -> None:
    """And only there: a law about the coordinate stays as it is."""
    known, thin = tuple(problem.file.study.effects), thinned(problem)
    straight = {"kind": "measured-impedance", "at": ["joint2.rx"], "branches": 0}
    own = {"joint2.rx.stiffness": 1e6, "joint2.rx.damping": 1e3}
    turned = straight | ({"lean": {"joint2.ry": lean}} if lean else {})
    measured = _measured(thin, with_effects(thin, (*known, parse_effect(turned)), own))
    law, runner = parse_effect(straight), TrialRunner(measured)
    values = {**{p.name: p.initial for p in measured.parameters}, **own}
    trial = runner.run(Task(known, (law,), values, "onward"))
    task = leaning_task(measured, trial)
    if not lean:
        assert task is None
        return
    assert task is not None
    [found] = task.new
    assert isinstance(found, MeasuredImpedance)
    assert found.lean["joint2.ry"] == pytest.approx(lean, rel=0.1)
    with Workers(measured, 1) as workers:
        [[end, *_]] = with_leaning(workers, [[trial]])
    assert end.task.new == (found,)
    assert end.gap < 1.05 < trial.gap
    assert end.values["joint2.rx.stiffness"] == pytest.approx(1e6, rel=0.02)
    assert end.free == trial.free + 1


def test_what_an_axis_may_lean_towards() -> None:
    """The other coordinates of its kind, and only of a single one."""
    one = {"kind": "measured-impedance", "at": ["joint2.rx"]}
    assert may_lean(parse_effect(one))
    assert not may_lean(parse_effect(one | {"at": ["joint2.rx", "joint2.ry"]}))
    assert not may_lean(parse_effect(one | {"lean": {"joint2.ry": 0.1}}))
    for lean in ({"joint2.tx": 0.1}, {"joint3.ry": 0.1}, {"joint2.rx": 0.1}):
        with pytest.raises(ValueError, match="lean"):
            parse_effect(one | {"lean": lean})


def test_where_no_springs_are_tried_no_strut_is(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor are lines left out for it, or anything run."""
    monkeypatch.setattr("identify.discovery.siblings.thinned", lambda _problem: pytest.fail("thinned"))
    workers = Workers(problem, 1)
    delay = Task(tuple(problem.file.study.effects), (parse_effect({"kind": "time-delay"}),), {})
    groups = [[Trial(delay, {}, 1e5, 100_000, free=12)], []]
    assert with_struts(workers, groups) == groups


class _Level(_Sloping):
    """Workers that leave the same wherever springs are, and remember what they tried."""

    def __init__(self, problem: Problem, least: float) -> None:
        super().__init__(problem, least)
        self.tasks: list[Task] = []

    def run(self, tasks: Sequence[Task], done: Callable[[], None] = lambda: None) -> list[Trial]:
        """As told."""
        self.tasks += tasks
        return [Trial(task, {}, 1e5 * self.least**2, 100_000, free=12) for task in tasks]


@pytest.mark.parametrize(("least", "beside"), [(1.02, True), (1.5, False)])
def test_springs_on_the_links_beside_the_best_ones_are_refitted(
    problem: Problem, least: float, beside: bool
) -> None:
    """From their quick trials, where errors of what was told are fitted along; not where much is left."""
    springs, known = _springs(problem), tuple(problem.file.study.effects)
    workers = _Level(problem, least)
    quick = workers.run([Task(known, (one,), {"far": 1.0}) for one in springs])
    best = next(n for n, one in enumerate(springs) if getattr(one, "link", "") == problem.robot.links[2].name)
    workers.tasks.clear()
    groups = with_springs_beside(cast(Workers, workers), problem, quick, [[quick[best]]])
    links = {one.link for [trial] in groups[1:] for one in trial.task.new if isinstance(one, SpringToGround)}
    assert links == ({problem.robot.links[n].name for n in (1, 2, 3)} if beside else set())
    assert {task.how for task in workers.tasks} == ({"likely", "onward"} if beside else set())


class _Recording:
    """Workers that leave a gap of 1.1, and remember what they were asked."""

    with_errors = False

    def __init__(self) -> None:
        self.tasks: list[Task] = []

    def run(self, tasks: Sequence[Task]) -> list[Trial]:
        """As told."""
        self.tasks += tasks
        return [Trial(task, {}, 1e5 * 1.1**2, 100_000, free=12) for task in tasks]


@pytest.mark.parametrize(("left", "turned"), [(6.9, 1), (1.4, 0)])
def test_a_pair_that_got_nowhere_is_also_tried_with_its_axes_turned(left: float, turned: int) -> None:
    """A tilt whose soft direction lies between x and y leaves much: what leaves less may be wrong."""
    tilt = parse_effect({"kind": "joint-compliance", "joints": [3], "axes": ["rx", "ry"]})
    link = parse_effect({"kind": "link-flexibility", "link": "link3"})
    quick = [
        Trial(Task((), (one,), {"a": gap}), {"a": gap}, 1e5 * gap**2, 100_000, free=12)
        for one, gap in ((link, 15.0), (tilt, 22.0))
    ]
    best, workers = replace(quick[0], squares=1e5 * left**2), _Recording()
    groups = with_coupled(cast(Workers, workers), quick, [[best]])
    assert [task.how for task in workers.tasks] == ["thorough"] * turned
    assert [one.task.new[0].sentence() for group in groups[1:] for one in group] == [
        "tilt compliance of joint 3 (rx, ry, coupled)"
    ] * turned
    assert not workers.tasks or workers.tasks[0].values == {"a": 22.0}
    assert with_coupled(cast(Workers, workers), quick, []) == [], "nothing is worth a refit"
