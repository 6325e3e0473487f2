"""Errors of what was told that are beyond belief become effects; those that can be believed do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from identify.discovery.loop import promoted
from identify.discovery.promote import alike, beyond_belief, stated_already
from identify.discovery.task import Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import parse_effect
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


def _robot() -> Robot:
    links = tuple(Link(name, 10.0, np.zeros(3), np.eye(3)) for name in ("base", "link1"))
    joint = Joint("joint1", "base", "link1", np.eye(4), np.array([0.0, 0.0, 1.0]))
    return Robot("arm", links, (joint,))


def _found(**shifts: float) -> list[str]:
    names = [one.name for one in _ENTRIES]
    values = dict.fromkeys(names, 0.5)
    values.update({names[int(key.removeprefix("n"))]: shift for key, shift in shifts.items()})
    return [effect.sentence() for effect, _ in beyond_belief(_STATED, values, _robot())]


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


def test_the_least_likely_comes_first() -> None:
    assert _found(n0=8.0, n10=15.0)[0] == "gain of channel 7:+X"


def test_only_a_wrong_link_may_be_a_rotor_or_the_sensors() -> None:
    mass, gain = (
        parse_effect(one)
        for one in ({"kind": "added-mass", "link": "link1"}, {"kind": "channel-gain", "channel": "7:+X"})
    )
    points = {7: Point(7, "7", "link1", np.zeros(3), np.eye(3), "points.csv:2")}
    assert [one.kind for one in alike(mass, _robot(), points)] == ["sensor-mass", "rotor-inertia"]
    assert [one.kind for one in alike(mass, _robot(), {})] == ["rotor-inertia"]
    faults = [one.kind for one in alike(gain, _robot(), {**points, 8: replace(points[7], node=8)})]
    assert [faults.count(kind) for kind in dict.fromkeys(faults)] == [3, 3, 2, 3]


@pytest.mark.parametrize(("by_rotor", "named"), [(60.0, "rotor-inertia"), (20.0, "added-mass")])
def test_the_rival_that_takes_most_off_is_named(by_rotor: float, named: str) -> None:
    names = [one.name for one in _ENTRIES]
    believed, first = dict.fromkeys(names, 0.5), Task((), (), {})
    problem = cast(Problem, SimpleNamespace(nuisances=_STATED, robot=_robot(), points={}))
    fall = {"added-mass": 40.0, "rotor-inertia": by_rotor}

    class Fitting:
        """Workers whose refits take so much off."""

        def run(self, tasks: Sequence[Task]) -> list[Trial]:
            return [Trial(t, believed, 100.0 - fall[t.new[0].kind], 100, free=1) for t in tasks]

    beyond = Trial(first, {**believed, names[0]: 9.0}, 100.0, 100)
    kept, model = promoted(problem, cast(Workers, Fitting()), [], beyond, Story())
    assert [option.effect.kind for option in kept] == [named]
    assert model.squares == pytest.approx(100.0 - max(fall.values()))


def test_a_sensor_that_is_turned_may_have_exchanged_axes() -> None:
    names = [one.name for one in _ENTRIES]
    believed, first = dict.fromkeys(names, 0.5), Task((), (), {})
    points = {7: Point(7, "7", "link1", np.zeros(3), np.eye(3), "points.csv:2")}
    problem = cast(Problem, SimpleNamespace(nuisances=_STATED, robot=_robot(), points=points))
    asked: list[Task] = []

    class Fitting:
        """Workers whose refits explain most with exchanged axes."""

        def run(self, tasks: Sequence[Task]) -> list[Trial]:
            asked.extend(tasks)
            fall = {"channel-swap": 60.0, "sensor-rotation": 40.0}
            return [Trial(t, believed, 100.0 - fall.get(t.new[0].kind, 0.0), 100, free=1) for t in tasks]

    beyond = Trial(first, {**believed, names[8]: 30.0}, 100.0, 100)
    kept, model = promoted(problem, cast(Workers, Fitting()), [], beyond, Story())
    assert [option.effect.kind for option in kept] == ["channel-swap"]
    assert model.task.how == "onward"
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
    problem = cast(Problem, SimpleNamespace(nuisances=_STATED, robot=_robot(), points={}))
    workers = cast(Workers, _Workers())

    def ended(gap: float) -> Trial:
        return Trial(Task((), (), values), values, gap**2 * 100, 100)

    kept, model = promoted(problem, workers, [], ended(2.0), Story())
    assert kept == []
    assert model.gap == pytest.approx(2.0)
    with pytest.raises(_Asked):
        promoted(problem, workers, [], ended(1.0), Story())
