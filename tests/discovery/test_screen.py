"""How far correlated residuals count, when candidates are chosen from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from identify.discovery import evidence, screen
from identify.discovery.places.job import Known
from identify.discovery.places.look import Looked
from identify.discovery.places.screen import PlaceFit
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.screen_softly import screened_softly
from identify.discovery.task import Task, Trial
from identify.discovery.thinned import thinned
from identify.discovery.workbench import ImpactWorkbench
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect, parse_effect
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
DRIVES = parse_effect({"kind": "joint-compliance"})
TILT = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})
BASE = parse_effect({"kind": "base-compliance"})


def _louder(problem: Problem, factor: float) -> Problem:
    measurements = tuple(
        replace(m, target=replace(m.target, noise=factor * m.target.noise))  # type: ignore[union-attr,operator]
        for m in problem.measurements
    )
    return replace(problem, measurements=measurements)


def test_inflation_is_a_ratio_of_variances(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise that is stated three times too small makes the naive variance nine times too small."""
    problem = thinned(load_problem(read_study(CONFIG)))
    trial = Trial(Task(tuple(problem.file.study.effects), (), {}, "quick"), {}, 1.0, 1)
    found = []
    for factor in (1.0, 1 / 3):
        stated = _louder(problem, factor)
        monkeypatch.setattr(evidence, "with_effects", lambda p, effects, values, stated=stated: stated)
        found.append(evidence.variance_inflation(problem, trial))
    assert found[0] > 1.5, "the model is wrong, so the residual is more than noise"
    assert found[1] / found[0] == pytest.approx(9.0, rel=0.01)
    monkeypatch.setattr(evidence, "with_effects", lambda p, effects, values: _louder(problem, 1e4))
    assert evidence.variance_inflation(problem, trial) == pytest.approx(1.0, rel=1e-9)


def test_a_second_spring_on_a_link_is_not_compared_by_its_size() -> None:
    """Both would have the same parameters."""
    problem = load_problem(read_study(CONFIG))
    link = problem.robot.links[2].name
    one, other = (
        parse_effect({"kind": "spring-to-ground", "link": link, "at_m": at, "cross_coupling": True})
        for at in ([0.0, 0.0, 0.1], [0.0, 0.0, 0.2])
    )
    assert screen._size(problem, other) == 12
    with_one = with_effects(problem, (*problem.file.study.effects, one), {})
    assert screen._size(with_one, other) == np.inf


class _Present:
    """Workers that know the model without candidates."""

    def __init__(self, present: Trial) -> None:
        self.present = present

    def run(self, tasks: list[Task]) -> list[Trial]:
        """That one."""
        assert [task.new for task in tasks] == [()]
        return [self.present]


@pytest.mark.parametrize(("gain", "kept"), [(100.0, False), (250.0, True)])
def test_a_gain_that_correlation_may_account_for_is_no_promise(gain: float, kept: bool) -> None:
    """Four parameters at 10,000 numbers: chi-square counts a fifth at best, so 100 is not worth 4 ln 2,000
    = 30, and 250 is; were it counted whole, both would be.
    """
    count, known = 10_000, (DRIVES,)

    def trial(effect: Effect | None, squares: float, free: int) -> Trial:
        return Trial(Task(known, () if effect is None else (effect,), {}), {}, squares, count, free=free)

    present = trial(None, count + gain, 12)
    best, other = trial(TILT, count + gain - 400, 16), trial(BASE, count, 16)
    found = screen.promising(cast(Workers, _Present(present)), present, [best, other])
    assert best in found
    assert (other in found) is kept


@pytest.mark.parametrize(("gap", "left", "kept"), [(2.0, 1.95, False), (2.0, 1.8, True), (20.0, 19.5, True)])
def test_near_the_data_what_hardly_helps_is_not_refitted(gap: float, left: float, kept: bool) -> None:
    """A twentieth of what is above noise is no promise, a fifth is; far from the data anything may be."""
    count, known = 100_000, (DRIVES,)
    present = Trial(Task(known, (), {}), {}, count * gap**2, count, free=12)
    one = Trial(Task(known, (TILT,), {}), {}, count * left**2, count, free=16)
    found = screen.promising(cast(Workers, _Present(present)), present, [one])
    assert found == ([one] if kept else [])


def test_what_does_the_same_with_fewer_parameters_is_not_crowded_out() -> None:
    """Three resonators leave a little less than a rotor, but not what their parameters cost."""
    count = 20_000
    rotor = parse_effect(
        {"kind": "rotor-inertia", "joints": [2], "gear_ratio": [100.0], "inertia": {"initial": 1e-4}}
    )
    body = parse_effect({"kind": "appended-resonator", "link": "link2", "axis": "x", "extent": "body"})
    trials = [
        Trial(Task((DRIVES,), (effect,), {}), {}, count * gap**2, count, free=free)
        for effect, gap, free in ((body, 1.0063, 24), (rotor, 1.0068, 13), (TILT, 1.2, 16))
    ]
    assert [trial.task.new[0] for trial in screen.likeliest_first(trials)] == [rotor, body, TILT]


@pytest.mark.parametrize(("validation", "all_places"), [(1.05, False), (1.4, True)])
def test_places_are_looked_at_while_other_data_show_that_something_is_missing(
    validation: float, all_places: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the gap on the data that are fitted is closed."""
    problem, least = thinned(load_problem(read_study(CONFIG))), list[float]()

    def looked(*given: object) -> tuple[list[PlaceFit], list[Looked]]:
        least.append(cast(float, given[-1]))
        return [], []

    monkeypatch.setattr(screen, "look", looked)
    known, values = tuple(problem.file.study.effects), {p.name: p.initial for p in problem.parameters}
    squares = [1000 * gap**2 for gap in (1.05, validation)]
    before = Trial(Task(known, (), {}), values, squares[0], 1000, squares[1], 1000)
    screen.screened(cast(Workers, _Asked()), problem, [], before, Story())
    assert np.isinf(least[0]) == all_places


class _Quiet:
    """Workers that leave by each effect a gap as told, and remember what they tried quickly."""

    with_errors = False

    def __init__(self, gaps: dict[str, float]) -> None:
        self.gaps, self.quick = gaps, list[str]()

    def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
        """As told."""
        kinds = [task.new[0].kind for task in tasks]
        self.quick += [kind for kind, task in zip(kinds, tasks, strict=True) if task.how == "quick"]
        return [
            Trial(task, {}, 1000 * self.gaps[kind] ** 2, 1000)
            for kind, task in zip(kinds, tasks, strict=True)
        ]

    def places(self, known: object, jobs: Sequence[object], done: object = None) -> list[object]:
        """None."""
        return [None for _ in jobs]


@pytest.mark.parametrize(("gap", "tried"), [(1.002, True), (1.9, False)])
def test_a_simple_effect_is_refitted_where_its_place_explains_all(gap: float, tried: bool) -> None:
    """A rotor that a first look puts behind eight bodies, because its law is judged far from its values."""
    problem = thinned(load_problem(read_study(CONFIG)))
    rotor = parse_effect(
        {"kind": "rotor-inertia", "joints": [2], "gear_ratio": [100.0], "inertia": {"initial": 1e-4}}
    )
    bodies = [
        parse_effect({"kind": "appended-resonator", "link": link.name, "axis": axis, "extent": "body"})
        for link in problem.robot.links[1:4]
        for axis in "xyz"
    ][:8]
    [place] = rotor.places(problem.robot, problem.points)
    fit = cast(SemiParametricFit, SimpleNamespace(gap=gap))
    looked = [*(Looked(body, 1.2) for body in bodies), Looked(rotor, 1.9)]
    workers = _Quiet({"appended-resonator": 1.006, "rotor-inertia": 1.007})
    before = Trial(Task(tuple(problem.file.study.effects), (), {}), {}, 9000.0, 1000)
    known = Known(before.task.effects, {})
    screen._refitted(
        cast(Workers, workers),
        problem,
        known,
        [],
        (before, ()),
        ([PlaceFit(place, fit)], looked),
        lambda: None,
    )
    assert ("rotor-inertia" in workers.quick) is tried


class _Recorded:
    """Workers that leave a gap by how a task is tried, and remember how."""

    with_errors = False

    def __init__(self, gap: float) -> None:
        self.gap, self.how = gap, list[str]()

    def run(self, tasks: list[Task], done: object = None) -> list[Trial]:
        """As told."""
        self.how += [task.how for task in tasks]
        return [Trial(task, {}, 1000 * self.gap**2, 1000) for task in tasks]


class _OfVariants(_Recorded):
    """Workers whose trials of the first effect leave one gap, those of its variants another."""

    def __init__(self, gap: float, effect: Effect, others: float) -> None:
        super().__init__(gap)
        self.effect, self.others = effect, others

    def run(self, tasks: list[Task], done: object = None) -> list[Trial]:
        """As told."""
        found = super().run(tasks)
        own = [self.gap if one.task.new == (self.effect,) else self.others for one in found]
        return [replace(one, squares=1000 * gap**2) for one, gap in zip(found, own, strict=True)]


@pytest.mark.parametrize(
    ("plain", "other", "tried"),
    [(1.1, 30.0, False), (1.1, 1.2, True), (20.0, 19.0, False), (20.0, 15.0, True)],
)
def test_variants_that_cannot_win_are_not_refitted(plain: float, other: float, tried: bool) -> None:
    """After a quick look only what comes near the best is fitted to all lines; where that is far from the
    data, only what comes clearly nearer.
    """
    workers, first = _OfVariants(plain, TILT, other), Task((DRIVES,), (TILT,), {})
    [group] = screen.thorough(cast(Workers, workers), [Trial(first, {}, 1e6, 1000)])
    assert workers.how[:2] == ["thorough", "quick"]
    assert ("thorough" in workers.how[1:]) is tried
    assert (len(group) > 1) is tried


@pytest.mark.parametrize(("present", "tried"), [(10.0, False), (80.0, True)])
def test_a_variant_of_many_more_parameters_waits_where_much_is_left(present: float, tried: bool) -> None:
    """It would stand for what else is missing."""
    link = parse_effect({"kind": "link-flexibility", "link": "link2"})
    [richer] = link.variants()

    class Sized(_Recorded):
        def run(self, tasks: list[Task], done: object = None) -> list[Trial]:
            return [replace(t, free=30 if t.task.new == (richer,) else 19) for t in super().run(tasks)]

    workers, before = Sized(4.0), Task((DRIVES,), (link,), {})
    [group] = screen.thorough(cast(Workers, workers), [Trial(before, {}, 81000.0, 1000)], present)
    assert any(trial.task.new == (richer,) for trial in group) is tried


class _Asked:
    """Workers that keep what they are asked for, and leave everything as it is."""

    with_errors = False

    def __init__(self) -> None:
        self.tasks: list[Task] = []

    def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
        """Trials that differ in nothing."""
        self.tasks += tasks
        return [Trial(task, task.values, 100.0, 100) for task in tasks]


def test_many_wrong_channels_do_not_keep_a_delay_from_being_looked_at() -> None:
    """A delay shows only once the rest has moved: at a glance it is as good as nothing."""
    problem, asked = load_problem(read_study(CONFIG)), _Asked()
    delay = parse_effect({"kind": "time-delay"})
    wrong = [parse_effect({"kind": "channel-polarity", "channel": f"{n}:+X"}) for n in problem.points]
    before = Trial(Task((DRIVES,), (), {}), {}, 1e4, 100)
    screened_softly(cast(Workers, asked), problem, [*wrong, delay], before)
    first = {task.new[0]: task.how for task in reversed(asked.tasks) if task.new}
    assert first[delay] == "brief"
    assert {first[one] for one in wrong} == {"glance"}
    followed = [task.new[0] for task in asked.tasks if task.how == "led" and task.new]
    assert delay in followed
    assert len(followed) < len(wrong)


def test_a_law_takes_the_place_of_springs_that_were_added_where_it_acts() -> None:
    """Springs of the study itself stay, and so do those elsewhere; the law then brings its own spring."""
    problem = thinned(load_problem(read_study(CONFIG)))
    law = parse_effect({"kind": "measured-impedance", "at": ["joint2.rx"], "released": False, "branches": 2})
    task = Task((DRIVES, TILT, BASE), (law,), {"joint2.rx.stiffness": 2.0}, "quick")
    trial = Trial(task, {"joint2.rx.stiffness": 3.0}, 1.0, 1)
    [instead] = screen.in_place_of_springs(problem, [trial], (TILT, BASE))
    assert instead.known == (DRIVES, BASE)
    assert instead.new == (law.model_copy(update={"released": True}),)
    assert instead.values["joint2.rx.stiffness"] == 3.0
    assert not screen.in_place_of_springs(problem, [trial], (BASE,))
    assert not screen.in_place_of_springs(problem, [replace(trial, task=instead)], (TILT, BASE))


def test_a_bearing_that_is_soft_in_one_direction_is_tried_with_its_others() -> None:
    """Two directions of the same bearing hide each other, and the second may look like nothing by itself."""
    tilt, radial, axial, elsewhere = (
        parse_effect({"kind": "joint-compliance", "joints": [joint], "axes": axes})
        for joint, axes in ((2, ["rx", "ry"]), (2, ["tx", "ty"]), (2, ["tz"]), (1, ["rx", "ry"]))
    )
    asked = _Asked()
    bench = ImpactWorkbench(cast(Problem, None), cast(Workers, asked))
    bench._looked_at = [elsewhere, tilt, radial, axial]
    before = Trial(Task((DRIVES,), (), {}), {"stays": 1.0}, 1e4, 100)
    link = parse_effect({"kind": "link-flexibility", "link": "link2"})
    quick = [Trial(Task((DRIVES,), (one,), {}), {}, 100.0, 100) for one in (link, tilt, axial, elsewhere)]
    found = bench._of_its_bearing(before, quick)
    assert [trial.task.new for trial in found] == [(radial,)]
    assert not bench._of_its_bearing(before, quick[:1])
