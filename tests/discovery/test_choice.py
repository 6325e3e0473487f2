"""What a step and the loop choose, in a world where the sum of squares of every model is known: no model is
fitted here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, cast

import pytest

from identify.discovery import loop, search
from identify.discovery.evidence import EvidenceCriterion
from identify.discovery.loop import Story
from identify.discovery.search import Option
from identify.discovery.trial import Task, Trial
from identify.discovery.workers import Workers
from identify.model.effects.base import Effect, parse_effect
from identify.vibration.problem import Problem

DRIVES = parse_effect({"kind": "joint-compliance"})
TILT = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})
BASE = parse_effect({"kind": "base-compliance"})
BODY = parse_effect({"kind": "appended-resonator", "link": "link3", "axis": "x", "extent": "body"})
MASS = parse_effect({"kind": "added-mass", "link": "link6", "extent": "body"})
COUNT = 10_000
FREE = {id(DRIVES): 12, id(TILT): 4, id(BASE): 4, id(BODY): 12, id(MASS): 10}


class World:
    """Workers that know the gap of every model instead of fitting it."""

    def __init__(self, gap: Callable[[set[str]], float]) -> None:
        self.gap, self.tasks = gap, 0

    def run(self, tasks: Sequence[Task]) -> list[Trial]:
        """The trials of all tasks."""
        self.tasks += len(tasks)
        return [self.trial(task) for task in tasks]

    def trial(self, task: Task) -> Trial:
        """The same gap on fitted and on other data."""
        squares = COUNT * self.gap({effect.kind for effect in task.effects[1:]}) ** 2
        free = sum(FREE[id(effect)] for effect in task.effects)
        return Trial(task, {}, squares, COUNT, squares, COUNT, free)

    def model(self, *new: Effect) -> Trial:
        """The drives and these."""
        return self.trial(Task((DRIVES,), new, {}))


def _workers(world: World) -> Workers:
    return cast(Workers, world)


def _nothing(*_: Any) -> float:
    return 1.0


def test_a_pair_that_explains_far_more_goes_before_one_that_stands_for_both() -> None:
    gaps = {"appended-resonator": 8.0, "joint-compliance": 11.0, "base-compliance": 15.0}
    world = World(
        lambda kinds: (
            1.02
            if {"joint-compliance", "base-compliance"} <= kinds
            else min(gaps.get(k, 40.0) for k in kinds | {""})
        )
    )
    before, judge = world.model(), EvidenceCriterion(100.0)
    quick = [world.model(effect) for effect in (BODY, TILT, BASE)]
    judged = [Option(t.task.new[0], t, judge.evidence(before, t)) for t in quick]
    assert judged[0].evidence == max(option.evidence for option in judged)
    assert search._first_of_two(_workers(world), before, quick, judged, judged[0], judge) == (
        judged[1],
        pytest.approx(1.02),
    )
    alone = World(lambda kinds: min(gaps.get(k, 40.0) for k in kinds | {""}))
    assert search._first_of_two(_workers(alone), before, quick, judged, judged[0], judge) == (
        judged[0],
        pytest.approx(8.0),
    )


def test_few_of_a_kind_are_tried_in_pairs() -> None:
    world = World(lambda kinds: 5.0)
    bodies = [parse_effect({"kind": "added-mass", "link": f"link{n}"}) for n in range(1, 7)]
    FREE.update({id(effect): 1 for effect in bodies})
    chosen = search._various([world.model(effect) for effect in (*bodies, TILT, BASE)])
    assert [trial.task.new[0] for trial in chosen] == [*bodies[:2], TILT, BASE]


def test_data_that_were_not_fitted_count_in_the_choice() -> None:
    judge, task = EvidenceCriterion(1.0), Task((DRIVES,), (), {})
    better_fitted = Trial(task, {}, 5_000.0, COUNT, 30_000.0, COUNT, 12)
    better_elsewhere = Trial(task, {}, 6_000.0, COUNT, 10_000.0, COUNT, 12)
    assert judge.evidence(better_fitted, better_elsewhere) == pytest.approx(19_000)


@pytest.mark.parametrize("with_another", [True, False])
def test_one_that_removes_little_is_followed_where_with_another_it_removes_all(
    with_another: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = {"joint-compliance", "base-compliance"}
    world = World(lambda kinds: 1.01 if both <= kinds else 8.6 if "joint-compliance" in kinds else 9.5)

    def searched(workers: Workers, problem: Problem, before: Trial, done: Any = None) -> search.Step:
        effect = next((e for e in (TILT, BASE) if e not in before.task.effects), MASS)
        trial = world.trial(Task(before.task.effects, (effect,), {}))
        best = Option(effect, trial, 100.0) if trial.gap < before.gap else None
        return search.Step(before, (), best, (), EvidenceCriterion(1.0), 1.01 if with_another else trial.gap)

    monkeypatch.setattr(loop, "check_data", _nothing)
    monkeypatch.setattr(loop, "_base", lambda problem, workers: world.model())
    monkeypatch.setattr(loop, "search", searched)
    monkeypatch.setattr(loop, "inflation", _nothing)
    found = loop.discover(cast(Problem, None), _workers(world))
    assert [option.effect for option in found.added] == ([TILT, BASE] if with_another else [])


def test_what_is_left_in_the_end_may_be_the_form_of_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """An even beam was found while a delay was in the way; beside the delay an uneven one explains the
    rest.
    """
    even = parse_effect({"kind": "link-flexibility", "link": "link2"})
    [uneven] = even.variants()
    late = parse_effect({"kind": "time-delay"})
    gaps = {"": 60.0, "even": 40.0, "even late": 2.0, "late uneven": 1.0}

    class Forms(World):
        def trial(self, task: Task) -> Trial:
            new = [
                "late" if effect == late else "uneven" if effect == uneven else "even"
                for effect in task.effects[1:]
            ]
            squares = COUNT * gaps[" ".join(new)] ** 2
            return Trial(task, {}, squares, COUNT, squares, COUNT, 12 + len(new) + 14 * new.count("uneven"))

    world = Forms(lambda kinds: 1.0)

    def option(*new: Effect) -> Option:
        return Option(new[-1], world.trial(Task((DRIVES, *new[:-1]), new[-1:], {})), 100.0)

    story, first, options = Story(), world.model(), [option(even), option(even, late)]
    found, final = loop._reshaped(_workers(world), first, options, options[-1].trial, story)
    assert [one.effect for one in found] == [late, uneven]
    assert final.gap == pytest.approx(1.0)
    steps = (search.Step(first, (), options[0], (), EvidenceCriterion(1.0), 40.0), *story.steps)
    assert loop.Discovery(first, final, tuple(found), steps).kept == (True, True)
    gaps["late uneven"] = 1.9999
    assert loop._reshaped(_workers(world), first, options, options[-1].trial, story) == (
        options,
        options[-1].trial,
    )


def test_what_stands_for_many_things_gives_way_to_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A body on a spring that was found first took the place of a mass; with the tilt in the model the mass
    explains all.
    """

    def gap(kinds: set[str]) -> float:
        return (
            1.0
            if {"added-mass", "joint-compliance"} <= kinds
            else 1.1
            if len(kinds) > 1
            else 9.0 - len(kinds)
        )

    world = World(gap)
    first, wrong, found = world.model(), world.model(BODY), world.model(BODY, TILT)
    options = [Option(BODY, wrong, 100.0), Option(TILT, found, 100.0)]

    def searched(workers: Workers, problem: Problem, before: Trial, done: Any = None) -> search.Step:
        best = MASS if BODY not in before.task.effects else BODY
        trial = world.trial(Task(before.task.effects, (best,), {}))
        return search.Step(before, (), Option(best, trial, 100.0), (), EvidenceCriterion(1.0), trial.gap)

    monkeypatch.setattr(loop, "search", searched)
    monkeypatch.setattr(loop, "inflation", _nothing)
    story = Story()
    added, final = loop._exchanged(_workers(world), cast(Problem, None), options, found, story)
    assert [option.effect for option in added] == [TILT, MASS]
    assert final.gap == pytest.approx(1.0)
    assert len(story.steps) == 1
    told = loop._in_turn(_workers(world), cast(Problem, None), first, added, final)
    assert [option.trial.gap for option in told] == pytest.approx([8.0, 1.0])
    assert told[-1].trial is final
    assert loop._in_turn(_workers(world), cast(Problem, None), first, options, found) == options
