"""What a step and the loop choose, in a world where the sum of squares of every model is known: no model is
fitted here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from identify.discovery import loop, pairs, screen
from identify.discovery.evidence import POLICY, EvidenceCriterion
from identify.discovery.task import Option, Step, Task, Trial
from identify.discovery.workbench import ImpactWorkbench
from identify.discovery.workers import Workers
from identify.fitting.selection import loop as selection_loop
from identify.fitting.selection import prune as selection_prune
from identify.fitting.selection import turn as selection_turn
from identify.fitting.selection import workbench as workbench_types
from identify.fitting.selection.gain import Gain
from identify.fitting.selection.prune import exchange, prune
from identify.fitting.selection.turn import as_options, choice
from identify.fitting.selection.workbench import Story
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

    with_errors = False

    def __init__(self, gap: Callable[[set[str]], float]) -> None:
        self.gap, self.tasks = gap, 0

    def run(self, tasks: Sequence[Task], done: Callable[[], None] = lambda: None) -> list[Trial]:
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


class Known(ImpactWorkbench):
    """Hammer tests of a study with the drives alone, in a world where every gap is known."""

    def __init__(self, world: World) -> None:
        file = SimpleNamespace(study=SimpleNamespace(effects=[DRIVES]))
        super().__init__(cast(Problem, SimpleNamespace(file=file)), _workers(world))
        self.world = world

    def begin(self) -> Trial:
        """The drives."""
        return self.world.model()

    def candidates(self, model: Trial) -> list[Effect]:
        """None: a test says what a turn finds."""
        return []


def _option(trial: Trial, log_odds: float = 50.0) -> Option:
    return workbench_types.Option(trial.task.new[-1], trial, 1, Gain(log_odds, 1.0))


def _one(*_: Any) -> float:
    return 1.0


def _step(before: Trial, best: Option | None, promise: float = 1.0) -> Step:
    found = () if best is None else (best,)
    return workbench_types.Step(before, (), found, (), EvidenceCriterion(1.0), promise)


def test_a_pair_that_explains_far_more_goes_before_one_that_stands_for_both() -> None:
    gaps = {"appended-resonator": 8.0, "joint-compliance": 11.0, "base-compliance": 15.0}
    world = World(
        lambda kinds: (
            1.02
            if {"joint-compliance", "base-compliance"} <= kinds
            else min(gaps.get(k, 40.0) for k in kinds | {""})
        )
    )
    before, criterion = world.model(), EvidenceCriterion(100.0)
    quick = [world.model(effect) for effect in (BODY, TILT, BASE)]
    options = as_options(criterion, before, [screen.attempt(before, trial) for trial in quick])
    chosen = choice(POLICY, options)
    assert chosen == (options[0],)
    step = workbench_types.Step(before, tuple(options), chosen, (), criterion, chosen[0].gain.explained)
    two = pairs.first_of_two(_workers(world), step, quick)
    assert two.best == options[1]
    assert two.explained == pytest.approx(1 - 0.02 / 39)
    alone = World(lambda kinds: min(gaps.get(k, 40.0) for k in kinds | {""}))
    two = pairs.first_of_two(_workers(alone), step, quick)
    assert two.best == options[0]
    assert two.explained == pytest.approx(1 - 7 / 39)


@pytest.mark.parametrize(
    ("size", "best", "next_best", "looked_at"),
    [(4, 5.0, 9.0, False), (4, 5.0, 7.0, True), (4, 1.02, 1.03, False), (13, 5.0, 9.0, True)],
    ids=["far ahead", "level", "closes the gap", "stands for many things"],
)
def test_pairs_are_looked_at_beside_errors_unless_one_hides_behind_nothing(
    size: int, best: float, next_best: float, looked_at: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, asked = {"joint-compliance": best, "base-compliance": next_best}, list[Any]()
    world = World(lambda kinds: min(left.get(kind, 40.0) for kind in kinds | {""}))
    found = replace(_option(world.model(TILT)), size=size)
    step = replace(_step(world.model(), found), options=(found,))
    monkeypatch.setattr(
        "identify.discovery.workbench.faults_beside", lambda *given: asked.append(given) or []
    )
    monkeypatch.setattr(pairs, "first_of_two", lambda *given: pairs.Two(found, 1.0))
    Known(world)._pair_softly(step, [world.model(TILT), world.model(BASE)])
    assert bool(asked) is looked_at


@pytest.mark.parametrize(
    ("left", "added", "looked_at"),
    [(1.2, True, False), (1.2, False, True), (2.5, True, True), (1.04, False, False)],
)
def test_beside_errors_two_are_not_made_of_what_little_is_left_beside_what_was_added(
    left: float, added: bool, looked_at: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    world, asked = World(lambda kinds: left - 0.01 * len(kinds)), list[Any]()
    before = world.trial(Task((DRIVES, TILT) if added else (DRIVES,), (), {}))
    before = replace(before, squares_validation=1.5 * before.squares)
    body, base = (world.trial(replace(before.task, new=(effect,))) for effect in (BODY, BASE))
    found = replace(_option(body), size=13)
    step = replace(_step(before, found), options=(found,))
    monkeypatch.setattr(
        "identify.discovery.workbench.faults_beside", lambda *given: asked.append(given) or []
    )
    monkeypatch.setattr(pairs, "first_of_two", lambda *given: pairs.Two(found, 1.0))
    Known(world)._pair_softly(step, [body, base])
    assert bool(asked) is looked_at


def test_beside_errors_nothing_is_tried_where_there_are_no_candidates() -> None:
    """The gap is closed; pairs of the step before would bring one."""
    world = World(lambda kinds: 1.02)
    world.with_errors = True
    bench = Known(world)
    bench._pairs = [world.trial(Task((DRIVES,), (TILT, BASE), {}))]
    assert bench.screen(world.model(TILT), [], Story()) == []
    assert world.tasks == 0


def test_what_a_pair_brought_is_ranked_among_the_others() -> None:
    world = World(lambda kinds: 5.0)
    worse, better = _option(world.model(BODY), 40.0), _option(world.model(TILT), 50.0)
    bench = SimpleNamespace(pair=lambda *_: ((better,), 0.9))
    step = replace(_step(world.model(), worse), options=(worse,))
    found = selection_turn._with_pair(cast(Any, bench), step, [], [])
    assert found.options == (better, worse)
    assert found.found == (better,)


def test_few_of_a_kind_are_tried_in_pairs() -> None:
    world = World(lambda kinds: 5.0)
    bodies = [parse_effect({"kind": "added-mass", "link": f"link{n}"}) for n in range(1, 7)]
    FREE.update({id(effect): 1 for effect in bodies})
    chosen = pairs.various([world.model(effect) for effect in (*bodies, TILT, BASE)])
    assert [trial.task.new[0] for trial in chosen] == [*bodies[:2], TILT, BASE]


def test_one_form_of_each_is_tried_in_pairs() -> None:
    """What two of them do together does not depend on it at first."""
    world = World(lambda kinds: 5.0)
    [turned] = [form for form in TILT.variants() if form.valleys > 1]
    FREE.update({id(turned): 6})
    chosen = pairs.various([world.model(effect) for effect in (turned, BASE, TILT)])
    assert [trial.task.new[0] for trial in chosen] == [turned, BASE]


@pytest.mark.parametrize(
    ("before", "resonator", "body", "chosen"),
    [(50.0, 16.14, 16.48, MASS), (50.0, 16.14, 18.0, BODY), (50.0, 1.16, 1.2, BODY), (1.7, 1.14, 1.15, BODY)],
)
def test_far_from_the_data_the_smaller_of_two_that_explain_as_much_is_chosen(
    before: float, resonator: float, body: float, chosen: Effect
) -> None:
    """A body of 10 numbers, and a resonator of 12 that fits a little of what else is missing."""
    world = World(lambda kinds: resonator if "appended-resonator" in kinds else body if kinds else before)
    bench, criterion = Known(world), EvidenceCriterion(1.0)
    attempts = [screen.attempt(world.model(), world.model(effect)) for effect in (BODY, MASS)]
    [found] = choice(POLICY, as_options(criterion, world.model(), attempts), bench.at_noise)
    assert found.effect == chosen


def test_data_that_were_not_fitted_count_in_the_choice() -> None:
    criterion, task = EvidenceCriterion(1.0), Task((DRIVES,), (), {})
    better_fitted = Trial(task, {}, 5_000.0, COUNT, 30_000.0, COUNT, 12)
    better_elsewhere = Trial(task, {}, 6_000.0, COUNT, 10_000.0, COUNT, 12)
    assert criterion.log_odds(better_fitted, better_elsewhere) == pytest.approx(19_000 / 2)


@pytest.mark.parametrize("with_another", [True, False])
def test_one_that_removes_little_is_followed_where_with_another_it_removes_all(
    with_another: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = {"joint-compliance", "base-compliance"}
    world = World(lambda kinds: 1.01 if both <= kinds else 8.6 if "joint-compliance" in kinds else 9.5)

    def turned(bench: Known, before: Trial, *_: Any) -> Step:
        effect = next((e for e in (TILT, BASE) if e not in before.task.effects), MASS)
        trial = world.trial(Task(before.task.effects, (effect,), {}))
        best = _option(trial) if trial.gap < before.gap else None
        return _step(before, best, 0.999 if with_another else 1 - (trial.gap - 1) / (before.gap - 1))

    monkeypatch.setattr(selection_loop, "turn", turned)
    found = selection_loop.select(Known(world))
    assert [option.effect for option in found.options] == ([TILT, BASE] if with_another else [])


@pytest.mark.parametrize(("at_first", "turns"), [(1.1, 1), (9.5, 2)])
def test_what_passes_as_noise_is_not_followed_by_additions_that_do_not_settle(
    at_first: float, turns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever they promise: any few explain some of it."""
    world, steps = World(lambda kinds: at_first - 0.3 * (at_first - 1) * len(kinds)), list[Step]()

    def turned(bench: Known, before: Trial, *_: Any) -> Step:
        effect = TILT if TILT not in before.task.effects else BASE
        steps.append(
            _step(
                before, None if len(steps) else _option(world.trial(Task(before.task.effects, (effect,), {})))
            )
        )
        return steps[-1]

    monkeypatch.setattr(selection_loop, "turn", turned)
    found = selection_loop.select(Known(world))
    assert (len(steps), found.options) == (turns, ())


@pytest.mark.parametrize("promised", [True, False])
def test_a_promise_outlasts_patience(promised: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two that stand for little are found before one of a pair that explains all; its other half comes when
    patience is spent, and what came first is taken out again.
    """
    alone = {"joint-compliance": 7.0, "appended-resonator": 8.5, "added-mass": 9.0}
    both = {"joint-compliance", "base-compliance"}
    world = World(
        lambda kinds: 1.01 if both <= kinds else min((alone.get(kind, 9.5) for kind in kinds), default=9.5)
    )

    def turned(bench: Known, before: Trial, *_: Any) -> Step:
        effect = next((e for e in (MASS, BODY, TILT, BASE) if e not in before.task.effects), None)
        if effect is None:
            return _step(before, None)
        trial = world.trial(Task(before.task.effects, (effect,), {}))
        seen = 0.999 if promised and effect in (TILT, BASE) else 0.3
        gain = EvidenceCriterion(1.0).gain(before, trial)
        return _step(before, workbench_types.Option(effect, trial, 1, gain), seen)

    monkeypatch.setattr(selection_loop, "turn", turned)
    monkeypatch.setattr(selection_loop, "exchange", lambda bench, options, model, story: (options, model))
    found = selection_loop.select(Known(world))
    assert [option.effect for option in found.options] == ([TILT, BASE] if promised else [])


def test_what_is_left_in_the_end_may_be_the_variant_of_what_was_found() -> None:
    """A uniform beam was found while a delay was in the way; beside the delay a nonuniform one explains the
    rest.
    """
    uniform = parse_effect({"kind": "link-flexibility", "link": "link2"})
    [nonuniform] = uniform.variants()
    late = parse_effect({"kind": "time-delay"})
    gaps = {"": 60.0, "uniform": 40.0, "uniform late": 2.0, "late nonuniform": 1.0}

    class Variants(World):
        def trial(self, task: Task) -> Trial:
            new = [
                "late" if effect == late else "nonuniform" if effect == nonuniform else "uniform"
                for effect in task.effects[1:]
            ]
            squares = COUNT * gaps[" ".join(new)] ** 2
            return Trial(
                task, {}, squares, COUNT, squares, COUNT, 12 + len(new) + 14 * new.count("nonuniform")
            )

    world = Variants(lambda kinds: 1.0)

    def option(*new: Effect) -> Option:
        return _option(world.trial(Task((DRIVES, *new[:-1]), new[-1:], {})))

    story, first, options = Story(), world.model(), [option(uniform), option(uniform, late)]

    def tried() -> selection_loop._State[Effect, Trial]:
        state = selection_loop._State(options[-1].model, first, list(options))
        selection_loop._try_variants(Known(world), first, state, story)
        return state

    state = tried()
    assert [one.effect for one in state.options] == [late, nonuniform]
    assert state.present.gap == pytest.approx(1.0)
    steps = (_step(first, options[0]), *story.steps)
    found = loop.Discovery(cast(Problem, None), first, state.present, tuple(state.options), steps)
    assert found.kept == (True, True)
    gaps["late nonuniform"] = 1.9999
    state = tried()
    assert state.options == options
    assert state.present == options[-1].model


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
    bench, first, wrong, found = Known(world), world.model(), world.model(BODY), world.model(BODY, TILT)
    options = [_option(world.trial(Task((DRIVES,), (BODY,), {}))), _option(found)]

    def turned(bench: Known, before: Trial, *_: Any) -> Step:
        best = MASS if BODY not in before.task.effects else BODY
        return _step(before, _option(world.trial(Task(before.task.effects, (best,), {}))))

    monkeypatch.setattr(selection_prune, "turn", turned)
    monkeypatch.setattr(loop, "variance_inflation", _one)
    story = Story()
    added, final = exchange(bench, options, found, story)
    assert [option.effect for option in added] == [TILT, MASS]
    assert final.gap == pytest.approx(1.0)
    assert len(story.steps) == 1
    in_turn = loop.in_turn(cast(Problem, None), _workers(world), first, added, final)
    assert [option.model.gap for option in in_turn] == pytest.approx([8.0, 1.0])
    assert in_turn[-1].model is final
    on_the_way, tasks = replace(in_turn[0].model, squares=COUNT * 4.0), world.tasks
    again = loop.in_turn(cast(Problem, None), _workers(world), first, added, final, lambda _: on_the_way)
    assert [option.model.gap for option in again] == pytest.approx([2.0, 1.0])
    assert world.tasks == tasks, "what was fitted on the way is not fitted again"
    assert loop.in_turn(cast(Problem, None), _workers(world), first, options, found) == options
    settled = replace(found, squares=found.squares / 2)
    [one, last] = loop.in_turn(cast(Problem, None), _workers(world), first, options, settled)
    assert (one, last.model) == (options[0], settled)
    assert wrong.gap == pytest.approx(8.0)


def test_of_several_needless_effects_the_worst_goes_first() -> None:
    """With the tilt, neither the base nor the mass is needed; without both, the model is as good."""
    gaps = {"joint-compliance": 1.0}
    world = World(lambda kinds: min((gaps.get(kind, 9.0) for kind in kinds), default=9.0))
    told: list[str] = []
    model, dropped = prune(Known(world), world.model(BASE, TILT, MASS), Story(say=told.append))
    assert dropped == [BASE, MASS]
    assert model.task.effects == (DRIVES, TILT)
    assert all("not needed any more" in sentence for sentence in told)
    gaps["base-compliance"] = 1.0
    gaps["joint-compliance"] = 9.0
    assert prune(Known(world), world.model(BASE, TILT), Story())[1] == [TILT]


@pytest.mark.parametrize(("alone", "tried"), [(8.0, 3), (9.0, 2)])
def test_two_that_do_nothing_alone_are_no_pair(alone: float, tried: int) -> None:
    """Of three, the pair of those that leave the gap as it is is left out; where one does something it is
    tried.
    """
    gaps = {"joint-compliance": 4.0, "base-compliance": alone}
    world = World(lambda kinds: min((gaps.get(kind, 9.0) for kind in kinds), default=9.0))
    before = world.model()
    trials = [world.model(effect) for effect in (TILT, BASE, MASS)]
    step = _step(before, _option(trials[0]))
    world.tasks = 0
    pairs.first_of_two(_workers(world), step, trials)
    present = 1
    assert world.tasks == present + 2 * tried, "each briefly, then further"


@pytest.mark.parametrize(("gap", "stuck"), [(5.0, False), (7.0, True)])
def test_a_model_that_it_grew_from_counts_where_it_is_nearer_than_a_refit(gap: float, stuck: bool) -> None:
    """Left out of two, the second effect leaves the model that the search came through; one that was stuck in
    a wrong valley would keep what was added to it.
    """
    world = World(lambda kinds: 9.0 - 3 * len(kinds))
    bench = Known(world)
    one, both = world.model(TILT), world.model(TILT, BASE)
    one = replace(one, squares=one.count * gap**2)
    bench.came_through(one)
    without = bench.leave_out(both, [TILT, BASE])
    assert (without[1] is one) != stuck
    assert [effect.kind for effect in without[0].task.effects] == ["joint-compliance", "base-compliance"]


@pytest.mark.parametrize(("soft", "left"), [(1.1, 1.0), (3.0, 9.0)])
def test_what_is_far_from_the_data_only_with_the_errors_it_has_is_refitted_afresh(
    soft: float, left: float
) -> None:
    """Errors that a wrong effect brought may keep a model without it in a wrong valley; where residuals count
    for little, that shows.
    """
    world = World(_one)
    world.with_errors = True
    gaps = {"onward": 9.0, "quick": soft, "thorough": 1.0}

    def run(tasks: Sequence[Task], done: Callable[[], None] = lambda: None) -> list[Trial]:
        trials = [world.trial(task) for task in tasks]
        return [
            one if TILT in one.task.effects else replace(one, squares=COUNT * gaps[one.task.how] ** 2)
            for one in trials
        ]

    both = world.model(TILT, BASE)
    world.run = run  # type: ignore[method-assign]
    [without] = Known(world).leave_out(both, [TILT])
    assert without.gap == pytest.approx(left)
