"""Errors of what was told that are beyond belief become effects; those that can be believed do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from identify.core.parameters import Parameter
from identify.discovery import promotion
from identify.discovery.promotion import Promotion, in_place_of, promoted, rivals
from identify.discovery.suspects import (
    alike,
    beyond_belief,
    causes,
    foreseen_fall,
    log_chance,
    stated_already,
)
from identify.discovery.task import Step, Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.selection.gain import Gain
from identify.fitting.selection.workbench import Attempt, Option, Story
from identify.model.effects.base import Effect, parse_effect
from identify.model.system import build_site, list_parameters
from identify.robot.description import Joint, Link, Robot
from identify.robot.points import Point
from identify.vibration.nuisances.nuisance import Nuisance, Nuisances
from identify.vibration.problem import Problem

_ENTRIES = (
    Nuisance("link", "link1", "mass", 0.02, "1"),
    *(Nuisance("link", "link1", f"centre_{x}", 0.005, "m") for x in "xyz"),
    *(Nuisance("point", "7", x, 0.003, "m") for x in "xyz"),
    *(Nuisance("point", "7", f"r{x}", 0.02, "rad") for x in "xyz"),
    Nuisance("channel", "7:+X", "gain", 0.01, "1"),
    Nuisance("set", "day1", "delay", 1e-5, "s", lasting=False),
)
_STATED = Nuisances(_ENTRIES)
_EXACT = np.zeros((len(_ENTRIES),) * 2), np.eye(len(_ENTRIES))
"""Covariance and scatter of errors that data tell exactly."""


def _robot() -> Robot:
    links = tuple(Link(name, 10.0, np.zeros(3), np.eye(3)) for name in ("base", "link1"))
    joint = Joint("joint1", "base", "link1", np.eye(4), np.array([0.0, 0.0, 1.0]))
    return Robot("arm", links, (joint,))


def _judge(model: Trial, points: dict[int, Point] | None = None) -> Promotion:
    told = SimpleNamespace(nuisances=_STATED, robot=_robot(), points=points or {})
    return Promotion(cast(Problem, told), lambda trial: 1.0, lambda trial: 1.0, lambda trial: _EXACT, model)


def _found(**shifts: float) -> list[str]:
    names = [one.name for one in _ENTRIES]
    values = dict.fromkeys(names, 0.5)
    values.update({names[int(key.removeprefix("n"))]: shift for key, shift in shifts.items()})
    return [one.effect.sentence() for one in beyond_belief(_STATED, values, _robot())]


def _parameters(effect: Effect) -> tuple[Parameter, ...]:
    site = build_site(_robot(), np.zeros(1), [effect])
    return list_parameters(_robot(), site, [effect])


def test_what_can_be_believed_is_no_effect() -> None:
    assert _found() == []
    assert _found(n0=2.9, n10=2.5) == []
    assert _found(n0=3.2) == []  # of four numbers of a link one may be that large
    assert _found(n10=3.2) != []


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (0, "added body (mass, centre, inertia) on link1"),
        (8, "sensor at point 7 turned about its y axis"),
        (10, "gain of channel 7:+X"),
        (11, "time delay of all responses"),
    ],
)
def test_what_is_beyond_belief_is_named(number: int, said: str) -> None:
    assert _found(**{f"n{number}": 9.0}) == [said]
    assert _found(**{f"n{number}": -9.0}) == [said]


def test_a_point_that_is_far_off_has_no_effect_of_its_own() -> None:
    assert _found(n4=9.0) == []


def test_the_body_that_stands_for_errors_reaches_as_far_as_they_do() -> None:
    """A centre that is 2 m off is far beyond what is looked for otherwise."""
    names = [one.name for one in _ENTRIES]
    values = {**dict.fromkeys(names, 0.0), names[1]: 400.0}
    [found] = beyond_belief(_STATED, values, _robot())
    parameters, start = {p.name: p for p in _parameters(found.effect)}, found.start
    assert start["link1.moment_x"] == pytest.approx(10.0 * 0.005 * 400.0)
    for name, value in start.items():
        if name in parameters:
            assert parameters[name].lower < value < parameters[name].upper


def test_the_least_likely_comes_first() -> None:
    assert _found(n0=8.0, n10=15.0)[0] == "gain of channel 7:+X"


def test_whatever_may_be_wrong_at_the_same_sensor_is_alike() -> None:
    gain = parse_effect({"kind": "channel-gain", "channel": "7:+X"})
    points = {7: Point(7, "7", "link1", np.zeros(3), np.eye(3), "points.csv:2")}
    faults = [one.kind for one in alike(gain, _robot(), {**points, 8: replace(points[7], node=8)})]
    assert [faults.count(kind) for kind in dict.fromkeys(faults)] == [3, 3, 2, 3]


@pytest.mark.parametrize("screened", [True, False])
@pytest.mark.parametrize(
    ("error", "by_body", "by_rotor", "named"),
    [
        (9.0, 40.0, 60.0, "rotor-inertia"),
        (9.0, 40.0, 20.0, "added-mass"),
        (9.0, 2.0, 60.0, "rotor-inertia"),
        (3.6, 2.0, 60.0, ""),
    ],
)
def test_a_wrong_link_is_compared_with_all_structure(
    error: float, by_body: float, by_rotor: float, named: str, screened: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And with a rotor that turns with it, whether a first look finds that or not; where all errors together
    are too large also if no body on that link explains it.
    """
    names = [one.name for one in _ENTRIES]
    believed, first = dict.fromkeys(names, 0.5), Task((), (), {})
    rotor = parse_effect({"kind": "rotor-inertia", "joints": [1], "gear_ratio": [100.0]})
    fall = {"added-mass": by_body, "rotor-inertia": by_rotor}

    class Fitting:
        """Workers whose refits take so much off."""

        def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
            return [Trial(t, believed, 100.0 - fall[t.new[0].kind], 100, free=1) for t in tasks]

    monkeypatch.setattr(promotion, "candidates", lambda *given: [rotor] if screened else [])
    monkeypatch.setattr(
        promotion, "screened_softly", lambda workers, problem, found, before, done, part: found
    )
    monkeypatch.setattr(promotion, "promising_softly", lambda found: [Task((), (one,), {}) for one in found])
    monkeypatch.setattr(promotion, "thorough_softly", lambda workers, tasks: [workers.run(tasks)])
    beyond = Trial(first, {**believed, names[0]: error}, 100.0, 100)
    kept, model = promoted(_judge(beyond), cast(Workers, Fitting()), [], Story())
    assert [option.effect.kind for option in kept] == [named] * bool(named)
    assert model.squares == pytest.approx(100.0 - max(fall.values()) * bool(named))


@pytest.mark.parametrize(("ahead", "named"), [(3.0, "channel-polarity"), (30.0, "sensor-rotation")])
def test_a_turned_sensor_must_explain_more_than_a_reversed_channel(ahead: float, named: str) -> None:
    """It has an angle of its own, by which it nearly does what a reversed channel that hardly moves does."""
    names = [one.name for one in _ENTRIES]
    believed = dict.fromkeys(names, 0.0)
    left = {"sensor-rotation": 100.0, "channel-polarity": 100.0 + ahead}

    class Fitting:
        """Workers whose refits take the error away."""

        def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
            kinds = [task.new[0].kind for task in tasks]
            pairs = zip(tasks, kinds, strict=True)
            return [
                Trial(
                    t, believed, left.get(kind, 150.0), 100, free=kind in ("sensor-rotation", "channel-gain")
                )
                for t, kind in pairs
            ]

    points = {7: Point(7, "7", "link1", np.zeros(3), np.eye(3), "points.csv:2")}
    beyond = Trial(Task((), (), {}), {**believed, names[9]: 9.0}, 100.0 + 9.0**2, 160)
    kept, _ = promoted(_judge(beyond, points), cast(Workers, Fitting()), [], Story())
    assert [option.effect.kind for option in kept] == [named]


@pytest.mark.parametrize(("shift", "named"), [(4.0, True), (3.01, False)])
def test_an_error_is_an_effect_where_chance_among_all_causes_does_not_let_it_be(
    shift: float, named: bool
) -> None:
    """Of four causes; its squares are all that goes, and the residuals stay."""
    names = [one.name for one in _ENTRIES]
    believed = dict.fromkeys(names, 0.0)

    class Fitting:
        """Workers whose refits take the error away."""

        def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
            return [Trial(t, believed, 100.0, 100, free=1) for t in tasks]

    beyond = Trial(Task((), (), {}), {**believed, names[10]: shift}, 100.0 + shift**2, 150)
    kept, _ = promoted(_judge(beyond), cast(Workers, Fitting()), [], Story())
    assert bool(kept) == named


def test_what_a_fit_without_the_statement_would_gain_is_foreseen() -> None:
    """Of a linear model with two errors, one of which costs nothing any more."""
    rng = np.random.default_rng(4)
    slopes, rows = rng.normal(size=(30, 3)), rng.normal(size=30)

    def least(stated: np.ndarray) -> tuple[np.ndarray, float]:
        a, b = np.vstack([slopes, stated]), np.concatenate([rows, np.zeros(len(stated))])
        x, [squares], *_ = np.linalg.lstsq(a, b, rcond=None)
        return x, float(squares)

    priors = np.eye(3)[1:] * 4
    shift, before = least(priors)
    covariance = np.linalg.inv(slopes.T @ slopes + priors.T @ priors)
    fall = foreseen_fall(4 * shift[1:2], 16 * covariance[1:2, 1:2])
    assert fall == pytest.approx(before - least(priors[1:])[1], rel=1e-4)


def test_an_effect_is_fitted_only_where_it_may_be_shown() -> None:
    """Among sixty causes; what data tell less of may be larger than it seems, and correlated residuals, which
    pull at it, make it no cause.
    """
    many = Nuisances(tuple(Nuisance("channel", f"{n}:+X", "gain", 0.01, "1") for n in range(60)))
    values = {**dict.fromkeys((one.name for one in many.entries), 0.0), many.entries[10].name: 3.2}
    told = cast(Problem, SimpleNamespace(nuisances=many, robot=_robot(), points={}))

    def suspects(open_wide: float, pulled: float = 1.0) -> list[str]:
        errors = open_wide * np.eye(60), pulled * np.eye(60)
        one = (lambda trial: 1.0,) * 2
        judge = Promotion(told, *one, lambda trial: errors, Trial(Task((), (), {}), values, 100.0, 150))
        return [one.effect.kind for one in judge.suspects]

    assert suspects(0.0) == []
    assert suspects(0.5) == ["channel-gain"]
    assert suspects(0.5, pulled=3.0) == []


@pytest.mark.parametrize(("elsewhere", "named"), [(1.02, True), (1.14, False)])
def test_what_predicts_other_data_worse_once_settled_is_no_cause(elsewhere: float, named: bool) -> None:
    """A rotor took an error of a mass away and led to another valley, where another posture was off."""
    names = [one.name for one in _ENTRIES]
    believed = dict.fromkeys(names, 0.0)

    class Fitting:
        """Workers whose refits take the error away, but predict a posture worse in the end."""

        def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
            gaps = [elsewhere if t.how == "settled" else 1.02 for t in tasks]
            return [
                Trial(t, believed, 100.0, 100, 100 * gap**2, 100, free=1)
                for t, gap in zip(tasks, gaps, strict=True)
            ]

    beyond = Trial(Task((), (), {}), {**believed, names[10]: 9.0}, 100.0 + 81, 150, 100 * 1.02**2, 100)
    kept, model = promoted(_judge(beyond), cast(Workers, Fitting()), [], Story())
    assert bool(kept) == named
    assert (model is not beyond) == named


@pytest.mark.parametrize(("left", "named"), [(1.0, True), (5.9, False)])
def test_another_form_of_what_was_added_takes_errors_of_sensors_away(left: float, named: bool) -> None:
    """Where it leaves the gain of a sensor as large as it was, it explains nothing."""
    names = [one.name for one in _ENTRIES]
    believed = dict.fromkeys(names, 0.0)
    uniform = parse_effect({"kind": "link-flexibility", "link": "link1"})
    [nonuniform] = uniform.variants()
    delay = parse_effect({"kind": "time-delay"})

    def trial(effect: Effect, error: float, free: int) -> Trial:
        task = Task((delay,), (effect,), {})
        return Trial(task, {**believed, names[10]: error}, 100.0 + error**2, 150, free=free)

    before, after = trial(uniform, 6.0, 9), trial(nonuniform, left, 20)
    gain = Gain(50.0, 0.9, True, True)
    options = [Option(delay, before, 1, gain), Option(uniform, before, 8, gain)]
    judge, kept = in_place_of(_judge(before), [Attempt(nonuniform, after, 11)], options, Story())
    assert [one.effect for one in kept] == [delay, nonuniform if named else uniform]
    assert judge.model is (after if named else before)
    assert kept[1].size == (19 if named else 8)
    assert in_place_of(_judge(before), [], options, Story())[1] == options


def test_a_rival_that_needs_fewer_errors_takes_an_effect_s_place() -> None:
    """A resonator on the neighbouring link, for which a mass would have to be far off."""
    names = [one.name for one in _ENTRIES]
    believed, known = dict.fromkeys(names, 0.0), (parse_effect({"kind": "joint-compliance"}),)
    wrong, right, other = (
        parse_effect({"kind": "appended-resonator", "link": link, "axis": "z"})
        for link in ("link2", "link3", "link4")
    )

    def trial(effect: Effect, error: float, **changes: Any) -> Trial:
        ended = Trial(
            Task(known, (effect,), {}), {**believed, names[0]: error}, 100.0 + error**2, 150, free=9
        )
        return replace(ended, **changes)

    model, rival = trial(wrong, 6.0), trial(right, 1.0)
    unlike = [
        trial(other, 0.0, squares=30.0, count=30),  # on few lines
        trial(other, 0.0, squares=300.0),  # does not close the gap
        replace(trial(other, 0.0), task=Task((), (other,), {})),  # beside other effects
    ]
    gain = Gain(50.0, 0.9, True, True)
    options = [Option(one.task.new[0], one, 9, gain) for one in (model, rival, *unlike)]
    step = SimpleNamespace(options=options)
    assert rivals(model, [cast(Step, step)]) == [rival]
    judge, [kept] = in_place_of(_judge(model), [Attempt(right, rival, 0)], options[:1], Story())
    assert (kept.effect, kept.size, judge.model) == (right, 9, rival)
    weak = [Attempt(right, trial(right, 5.9), 0)]
    assert in_place_of(_judge(model), weak, options[:1], Story())[1] == options[:1]


def test_residuals_count_for_less_where_they_are_correlated_and_all_where_forces_disagree() -> None:
    believed = dict.fromkeys((one.name for one in _ENTRIES), 0.0)
    before, after = (
        Trial(Task((), (), {}), believed, squares, 100, free=n) for squares, n in ((150, 0), (100, 1))
    )
    told = cast(Problem, SimpleNamespace(nuisances=_STATED))
    plain, correlated, disagreeing = (
        Promotion(told, lambda trial, one=one: one, lambda trial, two=two: two, lambda trial: _EXACT, before)
        for one, two in ((1.0, 1.0), (10.0, 1.0), (1.0, 25.0))
    )
    assert plain.log_odds(after) == pytest.approx(-log_chance(50.0, 1) - np.log(causes(_STATED)))
    assert correlated.log_odds(after) == pytest.approx(-log_chance(5.0, 1) - np.log(causes(_STATED)))
    assert disagreeing.log_odds(after) == pytest.approx(-log_chance(2.0, 1) - np.log(causes(_STATED)))


@pytest.mark.parametrize(("squares", "counted"), [(9_990.0, False), (9_500.0, True)])
def test_what_noise_models_get_wrong_makes_no_larger_effect_of_a_wrong_link(
    squares: float, counted: bool
) -> None:
    """Of a body and a spring under it, only the latter's fall of the gap by 0.015 and more counts."""
    believed = dict.fromkeys((one.name for one in _ENTRIES), 0.0)
    task = Task((), (), {})
    before, body, sprung = (
        Trial(task, believed, size, 10_000, free=n)
        for size, n in ((10_100.0, 0), (10_000.0, 10), (squares, 12))
    )
    judge = _judge(before)
    assert judge.log_odds(sprung, body) == pytest.approx(
        -log_chance(10_100.0 - (squares if counted else 10_000.0), 12) - np.log(causes(_STATED))
    )
    assert (judge.log_odds(sprung, body) > judge.log_odds(body, body)) == counted


def test_the_logarithm_of_a_chance_goes_on_where_the_chance_itself_is_too_small() -> None:
    assert log_chance(0.0, 3) == 0.0
    assert log_chance(11.345, 3) == pytest.approx(np.log(0.01), abs=1e-3)  # tables of chi-square
    assert log_chance(1400.0, 1) == pytest.approx(log_chance(1500.0, 1) + 50, abs=0.1)
    assert np.isfinite(log_chance(1e6, 12))
    assert log_chance(20.0, 0) == log_chance(20.0, 1)  # a reversed channel, which has no parameter


def test_a_sensor_that_is_turned_may_have_exchanged_axes() -> None:
    names = [one.name for one in _ENTRIES]
    believed, first = dict.fromkeys(names, 0.5), Task((), (), {})
    points = {7: Point(7, "7", "link1", np.zeros(3), np.eye(3), "points.csv:2")}
    asked: list[Task] = []

    class Fitting:
        """Workers whose refits explain most with exchanged axes."""

        def run(self, tasks: Sequence[Task], done: object = None) -> list[Trial]:
            asked.extend(tasks)
            fall = {"channel-swap": 60.0, "sensor-rotation": 40.0}
            return [Trial(t, believed, 100.0 - fall.get(t.new[0].kind, 0.0), 100, free=1) for t in tasks]

    beyond = Trial(first, {**believed, names[8]: 30.0}, 100.0, 100)
    kept, model = promoted(_judge(beyond, points), cast(Workers, Fitting()), [], Story())
    assert [option.effect.kind for option in kept] == ["channel-swap"]
    assert model.task.how == "settled"
    assert asked[0].values[names[8]] == 0.0
    assert asked[0].values["7.ry.angle"] == pytest.approx(30.0 * 0.02)
    [swap] = [task for task in asked if task.new[0] == kept[0].effect and task.how == "nearby"]
    assert [swap.values[name] for name in names[7:11]] == [0.0] * 4  # the sensor is otherwise as told


def test_effects_that_are_fitted_along_anyway_are_not_candidates() -> None:
    gain = parse_effect({"kind": "channel-gain", "channel": "7:+X"})
    tilt = parse_effect({"kind": "joint-compliance", "joints": [1], "axes": ["rx"]})
    assert stated_already(_STATED, gain)
    assert not stated_already(_STATED, tilt)
    assert not stated_already(Nuisances(_ENTRIES[:4]), gain)


class _Asked(Exception):
    """Something was to be tried."""


class _Workers:
    """Workers that do nothing but say so."""

    def run(self, tasks: Sequence[Task]) -> list[Trial]:
        raise _Asked


def test_while_a_gap_is_open_errors_stand_for_what_was_not_found() -> None:
    names = [one.name for one in _ENTRIES]
    values = {**dict.fromkeys(names, 0.5), names[0]: 9.0}
    workers = cast(Workers, _Workers())

    def ended(gap: float) -> Trial:
        return Trial(Task((), (), values), values, gap**2 * 100, 100)

    kept, model = promoted(_judge(ended(2.0)), workers, [], Story())
    assert kept == []
    assert model.gap == pytest.approx(2.0)
    with pytest.raises(_Asked):
        promoted(_judge(ended(1.0)), workers, [], Story())
