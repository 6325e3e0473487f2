"""Which candidates go on where errors of what was told are stated, in a world where every gap is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest

from identify.discovery.evidence import EvidenceCriterion
from identify.discovery.neighbours import moved
from identify.discovery.pairs import first_of_two, second_of_two
from identify.discovery.refit_softly import (
    _near_enough,
    closing,
    promising_softly,
    thorough_softly,
    varied_softly,
)
from identify.discovery.screen_softly import screened_softly
from identify.discovery.task import Option, Step, Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.selection.gain import Gain
from identify.model.effects.appended_resonator import AppendedResonator
from identify.model.effects.base import Effect, parse_effect
from identify.model.effects.channel_polarity import ChannelPolarity
from identify.model.effects.rigid_body import MOMENTS
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
TILT = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})
BODY = parse_effect({"kind": "added-mass", "link": "link3", "extent": "body"})
FRICTION = parse_effect({"kind": "joint-friction", "joints": [2]})
BASE, DELAY = parse_effect({"kind": "base-compliance"}), parse_effect({"kind": "time-delay"})
COUNT, FREE = 10_000, 12


class _World:
    """Workers that know the gap of every model, by its new effects and how it is tried."""

    with_errors = True

    def __init__(self, gap: Callable[[Task], float]) -> None:
        self.gap, self.tasks = gap, list[Task]()

    def run(self, tasks: Sequence[Task], done: Callable[[], None] = lambda: None) -> list[Trial]:
        """The trials of all tasks."""
        self.tasks += tasks
        return [Trial(task, task.values, COUNT * self.gap(task) ** 2, COUNT, free=FREE) for task in tasks]


def _workers(world: _World) -> Workers:
    return cast(Workers, world)


def _trial(task: Task, gap: float) -> Trial:
    return Trial(task, task.values, COUNT * gap**2, COUNT)


@pytest.fixture(scope="module")
def problem() -> Problem:
    """The shipped example with its data."""
    return load_problem(read_study(CONFIG))


@pytest.mark.parametrize(("left", "enough"), [(1.03, True), (1.4, False)])
@pytest.mark.parametrize(("with_errors", "how"), [(True, "likely"), (False, "thorough")])
def test_the_second_of_two_comes_from_pairs_where_one_closes_the_gap(
    left: float, enough: bool, with_errors: bool, how: str
) -> None:
    pairs = [_trial(Task((), two, {"a": 1.0}), gap) for two, gap in (((BASE, TILT), 0.1), ((TILT, DELAY), 2))]
    pairs.append(_trial(Task((), (BASE, DELAY), {}), 0.05))
    world = _World(lambda task: left)
    world.with_errors = with_errors
    found = second_of_two(_workers(world), _trial(Task((), (TILT,), {}), 14.0), pairs)
    assert [task.how for task in world.tasks] == [how]
    assert world.tasks[0].effects == (TILT, BASE)
    assert [trial.task.effects for trial in found] == ([(TILT, BASE), (TILT, DELAY)] if enough else [])


def test_nothing_comes_from_pairs_without_the_effect_that_was_found() -> None:
    world = _World(lambda task: 1.0)
    pairs = [_trial(Task((), (BASE, DELAY), {}), 0.05)]
    assert not second_of_two(_workers(world), _trial(Task((), (TILT,), {}), 14.0), pairs)
    assert not world.tasks


@pytest.mark.parametrize(
    ("gap", "other", "far"), [(14.0, BASE, True), (1.1, BASE, False), (14.0, FRICTION, False)]
)
def test_pairs_begin_afresh_too_but_where_impacts_are_simulated_or_little_is_left(
    gap: float, other: Effect, far: bool
) -> None:
    """Where either was fitted by itself it made up for the other."""
    world = _World(lambda task: gap / len(task.new) if task.new else gap)
    world.with_errors = False
    before = _trial(Task((), (), {}), gap)
    ones = [_trial(Task((), (effect,), {}), gap / 2) for effect in (TILT, other)]
    best = Option(TILT, ones[0], 4, Gain(50.0, 0.5))
    first_of_two(_workers(world), Step(before, (best,), (best,), (), EvidenceCriterion(1.0), 0.5), ones)
    assert [task.far for task in world.tasks if task.how == "brief"] == [far]
    assert not any(task.far for task in world.tasks if task.how == "quick")


def _resonators(problem: Problem) -> list[Effect]:
    return list(AppendedResonator.instances(problem.robot, problem.points))


def test_a_body_that_moves_to_another_link_has_no_moments_there(problem: Problem) -> None:
    """On that link the same moments would be those of a body far outside."""
    first, *_, last = _resonators(problem)
    where = f"{first.link}.resonator_x"  # type: ignore[attr-defined]
    own = dict.fromkeys((f"{where}.{one}" for one in MOMENTS), 3.0)
    values = {**own, f"{where}.stiffness": 4.0, f"{where}.damping": 5.0}
    trial = _trial(Task(tuple(problem.file.study.effects), (first,), values), 2.0)
    there = {name.rpartition(".")[2]: value for name, value in moved(problem, trial, last).items()}
    sizes = {"mass": 3.0, "stiffness": 4.0, "damping": 5.0}
    assert there == {**sizes, **dict.fromkeys(MOMENTS[1:], 0.0)}


def test_what_moves_to_another_place_keeps_its_size(problem: Problem) -> None:
    first, second = _resonators(problem)[:2]
    known = tuple(problem.file.study.effects)
    names = [f"{first.link}.resonator_x.{one}" for one in ("mass", "stiffness", "damping")]  # type: ignore[attr-defined]
    model = AppendedResonator.model_validate(first.model_dump() | {"extent": "point"})
    other = AppendedResonator.model_validate(second.model_dump() | {"extent": "point"})
    trial = _trial(
        Task(known, (model,), {"stays": 4.0, **dict(zip(names, (1.0, 2.0, 3.0), strict=True))}), 2.0
    )
    values = moved(problem, trial, other)
    assert values == {"stays": 4.0} | {name.replace("_x", "_y"): trial.values[name] for name in names}


def _gap_of(task: Task) -> float:
    """The right resonator is on link 4 along x, which only a start beside it shows."""
    new = task.new[0] if task.new else None
    if isinstance(new, AppendedResonator) and (new.link, new.axis) == ("link4", "x"):
        return 0.1 if f"{new.link}.resonator_x.mass" in task.values else 0.9
    return 0.5 if isinstance(new, AppendedResonator) and (new.link, new.axis) == ("link4", "z") else 1.2


def test_resonators_beside_the_best_one_start_from_where_it_ended(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    def beside(_: Problem, __: Trial, effect: Effect) -> dict[str, float]:
        assert isinstance(effect, AppendedResonator)
        return {f"{effect.link}.resonator_{effect.axis}.mass": 1.0}

    monkeypatch.setattr("identify.discovery.screen_softly.moved", beside)
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), 2.0)
    screened = screened_softly(_workers(_World(_gap_of)), problem, [*_resonators(problem), TILT], before)
    quick = [trial for trial in screened if trial.task.how == "quick"]
    [best] = quick[0].task.new
    assert isinstance(best, AppendedResonator)
    assert (best.link, best.axis) == ("link4", "x")
    effects = [trial.task.new[0] for trial in screened]
    assert all(effect not in effects[:number] for number, effect in enumerate(effects))


@pytest.mark.parametrize(("gap", "looked_at"), [(1.2, 3), (2.0, 0)])
def test_small_gaps_are_looked_at_from_the_present_model_too(
    problem: Problem, gap: float, looked_at: int
) -> None:
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), gap)
    world = _World(lambda task: 1.1 if task.how == "beside" and task.new != (BASE,) else 1.15)
    effects = [BASE, TILT, *_resonators(problem)[:4]]
    screened = screened_softly(_workers(world), problem, effects, before)
    beside = [trial for trial in promising_softly(screened) if trial.task.how == "beside"]
    assert sum(trial.task.how == "beside" for trial in screened) == looked_at
    assert all(trial.task.new != (BASE,) for trial in beside)


@pytest.mark.parametrize(("gap", "best", "count"), [(1.3, 4.0, 14), (3.0, 4.0, 12), (3.0, 4.6, 14)])
def test_what_closes_a_small_gap_need_not_show_in_a_first_look(
    problem: Problem, gap: float, best: float, count: int
) -> None:
    """There noise counts for so much more that nothing takes one per cent off; nor where none takes much."""
    candidates = [BASE, TILT, *_resonators(problem)[:12]]
    world = _World(lambda task: (best if task.new == (TILT,) else 5.0) if task.new else 5.01)
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), gap)
    screened_softly(_workers(world), problem, candidates, before)
    led = [one for task in world.tasks if task.how == "led" for one in task.new if one in candidates]
    assert len(led) == count


@pytest.mark.parametrize(("gap", "refitted"), [(1.3, True), (3.0, False)])
def test_where_little_is_left_bodies_may_be_ahead_while_only_errors_of_links_move(
    problem: Problem, gap: float, refitted: bool
) -> None:
    """A base that turns came 26th of 85, 16 % behind, and closed the gap with all errors."""
    others = [
        parse_effect({"kind": "joint-compliance", "joints": [joint], "axes": axes})
        for joint in range(1, 7)
        for axes in (["tz"], ["tx", "ty"])
    ]
    leaves = {one.model_dump_json(): 2.0 + 0.01 * n for n, one in enumerate(others)}

    def left(task: Task) -> float:
        if not task.new:
            return 3.0
        return {"led": leaves.get(task.new[0].model_dump_json(), 2.3)}.get(task.how, 2.2)

    world = _World(left)
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), gap)
    screened_softly(_workers(world), problem, [*others, BASE], before)
    assert any(task.how == "quick" and task.new == (BASE,) for task in world.tasks) == refitted


def test_beside_a_bending_link_one_looks_from_the_present_model_alone(
    problem: Problem,
) -> None:
    """First looks hold its form as it was told, and stay far behind the present model."""
    bent = parse_effect({"kind": "link-flexibility", "link": "link2"})
    known = (*problem.file.study.effects, bent)
    before, other = _trial(Task(known, (), {"stays": 1.0}), 1.3), _channel(problem)
    world = _World(lambda task: 1.1 if task.new == (other,) else 1.2)
    screened = screened_softly(_workers(world), problem, [BASE, TILT, other], before)
    assert {task.how for task in world.tasks} == {"glance", "beside"}
    assert screened[0].task.new == (other,)
    world.tasks.clear()
    groups = thorough_softly(_workers(world), promising_softly(screened), before.gap)
    assert groups[0][0].task.new == (other,)
    assert [task.how for task in world.tasks[:3]] == ["nearby"] * 3
    assert "afresh" not in {task.how for task in world.tasks}


@pytest.mark.parametrize(("gap", "hows"), [(1.03, {"glance", "beside"}), (1.07, {"brief", "led"})])
def test_what_shows_in_other_data_alone_is_looked_for_from_the_present_model_alone(
    gap: float, hows: set[str], problem: Problem
) -> None:
    """It is less than the noise that counts for little in first looks."""
    task = Task(tuple(problem.file.study.effects), (), {})
    before = replace(_trial(task, gap), squares_validation=COUNT * 1.3**2, count_validation=COUNT)
    world = _World(lambda task: 1.1 if task.new else 1.2)
    screened_softly(_workers(world), problem, [BASE, TILT, _channel(problem)], before)
    assert hows <= {task.how for task in world.tasks}
    assert ("brief" in {task.how for task in world.tasks}) is ("brief" in hows)


@pytest.mark.parametrize(("best", "how"), [(1.02, "nearby"), (1.12, "afresh")])
def test_what_was_looked_at_beside_the_present_model_goes_on_from_there_where_another_closes_the_gap(
    best: float, how: str
) -> None:
    world = _World(lambda task: best if task.new == (BASE,) else 1.2)
    screened = [
        _trial(Task((DELAY,), (BASE,), {}, "quick"), 1.2),
        _trial(Task((DELAY,), (TILT,), {}, "beside"), 1.2),
    ]
    thorough_softly(_workers(world), screened, 1.25)
    assert next(task.how for task in world.tasks if task.new == (TILT,)) == how


def _channel(problem: Problem) -> Effect:
    """Reversed polarity of some channel."""
    return next(iter(ChannelPolarity.instances(problem.robot, problem.points)))


def test_another_form_with_more_parameters_counts_by_the_better_of_its_starts() -> None:
    """One of them ends in a wrong valley, far behind the form that it is compared with."""
    world = _World(lambda task: {"quick": 0.5, "likely": 2.9, "afresh": 1.5, "onward": 1.4}[task.how])
    task, other = Task((), (TILT,), {}), TILT.variants()[-1]
    best = replace(_trial(Task((), (other,), {}), 1.9), free=FREE)
    assert not varied_softly(_workers(world), [task], best, [other])
    fewer = replace(best, free=FREE - 1)
    [found] = varied_softly(_workers(world), [task], fewer, [other])
    assert found.gap == pytest.approx(1.4)
    assert not varied_softly(_workers(world), [task], fewer, [BASE]), "not of what is asked for"
    told = [one.how for one in world.tasks if one.how != "quick"]
    assert told == ["likely", "likely", "afresh", "onward", "likely"]


TURNED = TILT.variants()[-1]
BENT = parse_effect({"kind": "link-flexibility", "link": "link2", "nonuniform": True})


@pytest.mark.parametrize(
    ("form", "more", "gap", "soft", "tried"),
    [
        (TILT, False, 1.9, 0.55, True),  # fewer parameters that leave about as little where errors are few
        (TILT, False, 1.9, 0.9, False),  # or far more
        (TURNED, True, 1.9, 0.9, True),  # more of them, which another start may bring down
        (TURNED, True, 1.02, 0.5, False),  # and that explain nothing where nothing is left
        (TURNED, True, 1.02, 0.3, True),
        (BENT, True, 1.02, 0.9, True),  # whose few steps did not get there
    ],
)
def test_other_forms_that_may_not_win_are_not_fitted_to_the_likelihood(
    form: Effect, more: bool, gap: float, soft: float, tried: bool
) -> None:
    best = replace(_trial(Task((), (BASE,), {}), gap), free=FREE - more)
    world = _World(lambda task: (soft if task.new == (form,) else 0.5) if task.how == "quick" else 1.0)
    found = varied_softly(_workers(world), [Task((), (form,), {})], best, [], closed=gap < 1.15)
    assert bool(found) is tried
    assert ("likely" in {task.how for task in world.tasks}) is tried


@pytest.mark.parametrize(("gap", "looked_at"), [(1.5, True), (6.0, False)])
def test_a_link_that_bends_is_looked_at_in_its_other_form_while_errors_are_few(
    problem: Problem, gap: float, looked_at: bool
) -> None:
    """Without those that made up for the form that it has; not where far more is missing."""
    bent = parse_effect({"kind": "link-flexibility", "link": "link2"})
    values = {"joint1.rz.stiffness": 3e5, "link3.mass.error": -19.0}
    before = _trial(Task(tuple(problem.file.study.effects), (), values), 12.0)
    world = _World(lambda task: gap if task.new == (bent,) else 1.2 if task.new == (BENT,) else 11.0)
    best = screened_softly(_workers(world), problem, [bent, DELAY, BASE], before)[0]
    assert best.task.new == ((BENT,) if looked_at else (bent,))
    tried = [task.values for task in world.tasks if task.new == (BENT,)]
    assert tried == ([{"joint1.rz.stiffness": 3e5}] if looked_at else [])


def test_a_form_with_more_parameters_goes_to_the_likelihood_without_the_errors_of_the_other() -> None:
    values = {"joint1.rz.stiffness": 3e5, "link3.mass.error": -19.0}
    for more in (True, False):
        best = replace(_trial(Task((), (BASE,), values), 1.3), free=FREE - more)
        world = _World(lambda task: 1.3)
        varied_softly(_workers(world), [Task((), (BENT,), values)], best, [BENT.variants()[0]])
        [likely] = [task.values for task in world.tasks if task.how == "likely"]
        assert ("link3.mass.error" in likely) is not more
        assert "afresh" not in {task.how for task in world.tasks}


def test_only_what_comes_near_where_errors_are_few_is_refitted() -> None:
    """The models that are left without an effect that a closed one has."""
    without, needed = Task((), (TILT,), {}), Task((), (BASE,), {})
    best = _trial(Task((DELAY,), (TILT, BASE), {}), 1.02)
    world = _World(lambda task: 3.0 if task.effects == needed.effects else 1.2)
    assert closing(_workers(world), [without, needed], best) == [without]
    assert {task.how for task in world.tasks} == {"quick"}
    assert closing(_workers(world), [], best) == []


@pytest.mark.parametrize(
    ("left", "chosen"),
    [
        ([("body", 13, 4.0), ("swing", 13, 4.1), ("base", 4, 4.2)], ["body", "base"]),
        ([("body", 13, 4.0), ("swing", 13, 4.1), ("base", 4, 4.7)], ["body"]),
        ([("turned", 5, 3.9), ("tilt", 4, 4.0)], ["tilt"]),
        ([("turned", 5, 3.0), ("tilt", 4, 4.0)], ["turned"]),
        ([("turned", 5, 1.02), ("tilt", 4, 1.03)], ["turned", "tilt"]),
    ],
)
def test_while_much_is_left_only_the_best_and_a_smaller_one_go_on(
    left: list[tuple[str, int, float]], chosen: list[str]
) -> None:
    """Of an effect one form, the one with fewer parameters unless a richer one is far ahead."""
    effects = {"body": BODY, "swing": DELAY, "base": BASE, "tilt": TILT, "turned": TURNED}
    ends = [replace(_trial(Task((), (effects[name],), {}), gap), free=free) for name, free, gap in left]
    assert [trial.task.new for trial in _near_enough(ends)] == [(effects[name],) for name in chosen]


@pytest.mark.parametrize(("present", "count"), [(1.12, 2), (1.3, 3)])
def test_a_third_candidate_goes_on_only_if_it_explains_something(present: float, count: int) -> None:
    ends = [_trial(Task((), (one,), {}), gap) for one, gap in ((BODY, 1.12), (BASE, 1.125), (TILT, 1.13))]
    assert list(_near_enough(ends, present)) == ends[:count]


def test_a_first_look_that_ends_behind_the_present_model_is_taken_again(problem: Problem) -> None:
    """It has the present model in it."""
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), 1.9)
    looks = [(TILT, 2.0), (DELAY, 2.6), (BASE, 2.7)]

    def gap(task: Task) -> float:
        again = task.how == "astray" and task.new == (BASE,)
        return 1.5 if again else next((left for one, left in looks if task.new == (one,)), 2.5)

    world = _World(gap)
    screened = screened_softly(_workers(world), problem, [one for one, _ in looks], before)
    assert [task.new for task in world.tasks if task.how == "astray"] == [(DELAY,), (BASE,)]
    assert len(screened) == len(looks)


@pytest.mark.parametrize(
    ("best", "present", "again"),
    [(9.0, 12.0, True), (3.0, 12.0, False), (9.0, 1.3, False)],
    ids=["none comes near", "one does", "little is open"],
)
def test_what_gives_way_is_looked_at_again_where_much_is_open_and_none_comes_near(
    problem: Problem, best: float, present: float, again: bool
) -> None:
    """A present model that is bent far hides the valley of the right one, even from what does something."""
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), present)

    def gap(task: Task) -> float:
        left = {BODY.kind: best, TILT.kind: 9.5}
        return 1.5 if task.how == "astray" else left.get(task.new[0].kind if task.new else "", 10.0)

    world = _World(gap)
    candidates = [BODY, TILT, DELAY]
    screened_softly(_workers(world), problem, candidates, before)
    anew = [task.new[0] for task in world.tasks if task.how == "astray" and task.new[0] in candidates]
    assert anew == [TILT] * again


@pytest.mark.parametrize(
    ("left", "quick"),
    [
        ((3.0, 4.0, 5.0, 7.0, 7.2, 4.4), {3.0, 4.0, 4.4, 5.0}),  # one leaves little
        ((6.0, 6.2, 6.4, 6.5, 7.0, 9.9), {6.0, 6.2, 6.4, 6.5, 7.0}),  # what takes next to nothing off
    ],
)
def test_only_what_may_win_is_looked_at_with_all_errors(
    problem: Problem, left: Sequence[float], quick: set[float]
) -> None:
    candidates = [TILT, BASE, DELAY, *_resonators(problem)[:3]]
    of = dict(zip((one.model_dump_json() for one in candidates), left, strict=True))

    def gap(task: Task) -> float:
        return 1.2 if task.how == "quick" else next((of[one.model_dump_json()] for one in task.new), 10.0)

    world = _World(gap)
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), 12.0)
    screened_softly(_workers(world), problem, candidates, before)
    tried = {of[one.model_dump_json()] for task in world.tasks if task.how == "quick" for one in task.new}
    assert tried == quick


def test_none_but_the_first_few_is_looked_at_with_all_errors_where_one_leaves_little_and_is_far_ahead(
    problem: Problem,
) -> None:
    candidates = [TILT, BASE, DELAY, *_resonators(problem)[:3]]
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), 12.0)
    for others, count in ((5.0, 4), (1.5, 6)):
        quick = {TILT.model_dump_json(): 1.2}

        def gap(task: Task, quick: dict[str, float] = quick, others: float = others) -> float:
            if task.how != "quick":
                return 5.0 if task.new else 10.0
            return quick.get(task.new[0].model_dump_json(), others)

        world = _World(gap)
        screened_softly(_workers(world), problem, candidates, before)
        told = [task.new[0] for task in world.tasks if task.how == "quick" and task.new[0] in candidates]
        assert len(told) == count


@pytest.mark.parametrize(("best", "count"), [(5.0, 12), (2.0, 1)], ids=["level", "far ahead"])
def test_what_adds_nothing_goes_no_further(problem: Problem, best: float, count: int) -> None:
    """All begin beside the present model as it is with few errors; a dozen go on, and what adds to it."""
    before = _trial(Task(tuple(problem.file.study.effects), (), {"k": 1.0}), 12.0)
    dull, *idle = _resonators(problem)
    looks = {TILT.model_dump_json(): best, dull.model_dump_json(): 9.0}

    def gap(task: Task) -> float:
        return next(
            (looks[one.model_dump_json()] for one in task.new if one.model_dump_json() in looks), 10.0
        )

    world = _World(gap)
    candidates = [TILT, dull, BASE, DELAY, *idle]
    screened = screened_softly(_workers(world), problem, candidates, before)
    led = [one for task in world.tasks if task.how == "led" for one in task.new if one in candidates]
    assert led[0] == TILT
    assert (dull in led) is (count > 1)
    assert len(led) == count
    told = [trial.task.new[0] for trial in screened]
    assert all(one in told for one in candidates), "those that stay behind too"


@pytest.mark.parametrize(
    ("plain", "other", "turned"), [(5.0, 5.0, True), (30.0, 4.0, True), (1.5, 5.0, False)]
)
def test_directions_that_turn_are_looked_at_where_nothing_else_closes_the_gap(
    problem: Problem, plain: float, other: float, turned: bool
) -> None:
    """A bearing that is far softer in a direction between its axes than across it; along these alone it may
    do nothing at all.
    """
    before = _trial(Task(tuple(problem.file.study.effects), (), {}), 6.0)
    [form], [far] = ([one for one in effect.variants() if one.valleys > 1] for effect in (TILT, BASE))
    gaps = [(form, 1.2), (far, 7.0), (TILT, plain)]
    world = _World(lambda task: next((gap for one, gap in gaps if task.new == (one,)), other))
    best = screened_softly(_workers(world), problem, [TILT, DELAY, BASE], before)[0]
    assert (best.task.new == (form,)) is turned
    hows = [[task.how for task in world.tasks if task.new == (one,)] for one in (form, far)]
    assert hows[0] == (["astray", "led", "quick"] if turned else []), "afresh: the present model is bent"
    assert hows[1] == (["astray"] if turned else []), "what is far from the best goes no further"
