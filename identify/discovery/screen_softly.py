"""First looks at candidates where errors of what was told are stated and fitted along: residuals count for
little at first, so that the errors stay near what was stated (`identify.discovery.softly`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identify.core.thresholds import MISSING
from identify.discovery.evidence import FAR, POLICY, above_noise, nearly_closed
from identify.discovery.neighbours import moved, siblings, turning
from identify.discovery.suspects import stated_already
from identify.discovery.task import Task, Trial, once, squares_of
from identify.discovery.workers import Workers, further
from identify.model.effects.appended_resonator import AppendedResonator
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.place import Rows
from identify.model.effects.springs import Springs
from identify.vibration.nuisances.nuisance import bare
from identify.vibration.problem import Problem

_GLANCED, _FOLLOWED, _MOST = 8, 12, 4
"""How many wrong channels are followed beyond a glance, and how many candidates beyond first looks; how many
get all errors before the others."""
_FOLLOWED_AT_MOST, _LEVEL, _LEVEL_NEARBY = 30, 1.1, 1.2
"""How many are followed where they are level with the best one, leaving at most so many times its gap; where
little is left, of which bodies take most while only errors of links move.
"""
_WORTH = 2.5
"""How many times the best one's gap a candidate may leave when residuals count for little, and still be
followed."""
_BEHIND, _IDLE, _UNMOVED, _MUCH, _FAR_BEHIND = 1.01, 0.99, 0.999, 0.8, 4.0
"""How many times the squares of the present model a first look leaves that went astray, that does nothing, a
glance that does nothing, the best first look where it takes much; how many times the best one's gap a first
look may leave to go on."""
_UNCLEAR = 0.6
"""Share of the present gap that the best first look leaves where none comes near."""
_ALONE = 0.6
"""What share of the gap of the next best the best candidate leaves that hides behind nothing."""
_WITHIN, _PART = 1.5, 0.1
"""How many times the best one's gap a candidate may leave once errors of links were followed, and still be
looked at with all errors where it is clear what is best, or in a form whose directions turn; which part of
what the best one takes off the squares of the present model another one must take off."""
_SEEN = 0.9
"""Share of the squares that a wrong channel may leave and be paired with what is missing beside it."""
_FEW = 3
"""How many candidates of those looked at from the present model go on."""


def screened_softly(
    workers: Workers,
    problem: Problem,
    found: Sequence[Effect],
    before: Trial,
    done: Callable[[], None] = lambda: None,
    part: float = _PART,
) -> list[Trial]:
    """Candidates, best first: a glance at those of single sensors, first looks at the others that follow the
    errors of links alone, the best of them with all errors.

    part: of what the best one takes off the squares, what another one must to be looked at with all errors.
    """
    known = before.task.effects
    left = [effect for effect in found if not stated_already(problem.nuisances, effect)]
    if not left:
        return []
    of_sensors = [effect for effect in left if _of_a_sensor(problem, effect)]
    others = [effect for effect in left if effect not in of_sensors]
    if nearly_closed(before) and (before.task.has_form or not above_noise(before.gap)):
        # First looks hold the form of a bending link as it was told, so that where only that form brought the
        # gap down none of them comes near the present model; and what shows in other data alone is less than
        # the noise that counts for so little there.
        return _beside(workers, before, [*others, *_moving(workers, before, of_sensors, done)], done)
    # Errors of the present model make up for what is missing: all begin beside one that has few, where only
    # what they add to it is still to be found.
    [present] = workers.run([Task(known, (), before.values, "brief")], done)
    wrong = _moving(workers, present, of_sensors, done)
    tasks = [Task(known, (effect,), present.values, "brief") for effect in (*others, *wrong)]
    first = workers.run(tasks, done)
    brief = _found_again(workers, first, present, wrong, open_wide=before.gap > MISSING)
    led = further(workers, brief if nearly_closed(before) else _under_way(brief, present), "led", done)
    [idle] = further(workers, [present], "led", done)
    level = _LEVEL_NEARBY if nearly_closed(before) else _LEVEL
    quick = _followed(workers, _likely_best(led, idle, part, level), idle.free, done)
    quick = _with_siblings(workers, problem, quick, others)
    quick = _with_turning(workers, present, others, (brief, led), _with_forms(workers, quick))
    seen = [*quick, *_beside(workers, before, others, done)] if nearly_closed(before) else quick
    tried = [trial.task.new for trial in seen]
    return [*seen, *(trial for trial in once([*led, *brief]) if trial.task.new not in tried)]


def _glanced(
    workers: Workers,
    model: Trial,
    of_sensors: Sequence[Effect],
    share: float,
    done: Callable[[], None] = lambda: None,
) -> list[Trial]:
    """Glances beside a model at those of these that leave less than this share of its squares, best first."""
    alone = Task(model.task.effects, (), model.values, "glance")
    ones = [replace(alone, new=(effect,)) for effect in of_sensors]
    idle, *glances = workers.run([alone, *ones], done)
    return sorted((trial for trial in glances if trial.squares < share * idle.squares), key=squares_of)


def _moving(
    workers: Workers, model: Trial, of_sensors: Sequence[Effect], done: Callable[[], None]
) -> list[Effect]:
    """The best few of these at a glance beside a model, of those that do anything there."""
    return [trial.task.new[0] for trial in _glanced(workers, model, of_sensors, _UNMOVED, done)[:_GLANCED]]


def _found_again(
    workers: Workers,
    brief: Sequence[Trial],
    present: Trial,
    wrong: Sequence[Effect],
    *,
    open_wide: bool,
) -> list[Trial]:
    """First looks, the best first, and once more those that ended behind the present model, which every one
    of them has in it: they went astray.  A resonator has looked from all its starts, and a wrong sensor moves
    nothing.

    Where much is open and none of them comes near, also all that gives way: the present model without it may
    be bent far, and its own valley not be in sight from there.
    """
    unclear = open_wide and min((trial.gap for trial in brief), default=np.inf) > _UNCLEAR * present.gap

    def astray(trial: Trial) -> bool:
        [effect] = trial.task.new
        if isinstance(effect, AppendedResonator) or effect in wrong:
            return False
        hidden = unclear and isinstance(effect, (Springs, LinkFlexibility))
        return hidden or trial.squares > _BEHIND * present.squares

    again = workers.run([replace(trial.task, how="astray") for trial in brief if astray(trial)])
    return once(sorted([*brief, *again], key=squares_of))


def _under_way(brief: Sequence[Trial], present: Trial) -> list[Trial]:
    """Those first looks, the best first, that may lead to the right one, which may still be under way after a
    few steps: not what adds nothing to the present model, nor what leaves many times what the best one does;
    all where none takes much, because noise counts for far more.
    """
    if not brief or brief[0].squares > _MUCH * present.squares:
        return list(brief)
    seen = [
        trial
        for number, trial in enumerate(brief)
        if number < _FOLLOWED or trial.squares < _IDLE * present.squares
    ]
    return [trial for trial in seen if trial.gap <= _FAR_BEHIND * brief[0].gap]


def _with_siblings(
    workers: Workers, problem: Problem, quick: Sequence[Trial], found: Sequence[Effect]
) -> list[Trial]:
    """Quick trials, the best first; where a resonator leaves least also of the others on its link and on
    those beside it, from where it ended: their valleys are as narrow as their peaks, and a first look may
    miss them.
    """
    result, tried = list(quick), list[Effect]()
    while result and isinstance(best := result[0].task.new[0], AppendedResonator):
        tried.append(best)
        left = [one for one in siblings(problem, best, found) if one not in tried]
        if not left:
            break
        tried += left
        tasks = [Task(result[0].task.known, (one,), moved(problem, result[0], one), "led") for one in left]
        own, *others = workers.run([replace(result[0].task, values=result[0].values, how="led"), *tasks])
        near = [trial for trial in others if trial.gap <= _LEVEL * own.gap]
        result = sorted([*result, *further(workers, near, "quick")], key=squares_of)
    return once(result)


def _with_turning(
    workers: Workers,
    present: Trial,
    found: Sequence[Effect],
    plain: tuple[Sequence[Trial], Sequence[Trial]],
    quick: Sequence[Trial],
) -> list[Trial]:
    """Quick trials, the best first; where none of them will close the gap also of what was looked at in the
    forms whose soft direction lies anywhere between two: without it they may not get anywhere, and the
    present model is bent far to make up for it, so that they begin afresh too.

    plain: first looks, and what they led to; forms that are far from the best there go no further.
    """
    if not quick or quick[0].gap <= MISSING:
        return list(quick)
    forms = [form for effect in found for form in turning(effect)]
    turned = workers.run([Task(present.task.effects, (form,), present.values, "astray") for form in forms])
    led = further(workers, _few_near(turned, plain[0]), "led")
    return sorted([*quick, *further(workers, _few_near(led, plain[1]), "quick")], key=squares_of)


def _few_near(trials: Sequence[Trial], others: Sequence[Trial]) -> list[Trial]:
    """The best few, of those that are not far behind the best of them and of some others."""
    most = _WITHIN * min(trial.gap for trial in (*others, *trials))
    return sorted((trial for trial in trials if trial.gap <= most), key=squares_of)[:_FEW]


def _with_forms(workers: Workers, quick: Sequence[Trial]) -> list[Trial]:
    """Quick trials, the best first; where a bending link leaves least, and no more than what is missing
    beside a form could, also in its other form.

    At the likelihood errors are bent far to make up for a form that is not quite right: what they hide there
    shows while they are few.
    """
    best = min(quick, key=squares_of, default=None)
    if best is None or best.gap > FAR or not isinstance(best.task.new[0], LinkFlexibility):
        return list(quick)
    forms = best.task.new[0].variants()
    tasks = [replace(best.task, new=(form,), values=bare(best.values)) for form in forms]
    return sorted([*quick, *workers.run(tasks)], key=squares_of)


def _beside(
    workers: Workers, before: Trial, found: Sequence[Effect], done: Callable[[], None]
) -> list[Trial]:
    """The best few by one step from the present model: where its errors nearly make up for what is missing,
    that shows beside them sooner than afresh.
    """
    tasks = [Task(before.task.effects, (effect,), before.values, "beside") for effect in found]
    return sorted(workers.run(tasks, done), key=squares_of)[:_FEW]


def faults_beside(
    workers: Workers, problem: Problem, best: Trial, found: Sequence[Effect], most: int = 2
) -> list[Trial]:
    """Single sensors that are wrong beside the best candidate, as trials of their own: a wrong channel and
    what else is missing hide each other, because either alone leaves about all of the gap.
    """
    known, wrong = best.task.known, [effect for effect in found if _of_a_sensor(problem, effect)]
    beside = (*known, *best.task.new)
    [few] = workers.run([Task(beside, (), best.values, "brief")])  # errors there make up for a wrong channel
    ranked = _glanced(workers, few, [one for one in wrong if one not in beside], _SEEN)[:most]
    return [replace(one, task=replace(one.task, known=known)) for one in ranked]


def _likely_best(led: Sequence[Trial], idle: Trial, part: float, level: float) -> list[Trial]:
    """Those that may still be ahead with all errors fitted, of some that are the best first: where sensors'
    errors are most of what is left, many leave about the same.  idle: what the present model leaves; level:
    how many times the best one's gap leaves about the same.
    """
    least = part * (idle.squares - led[0].squares) if led else 0.0
    return [
        trial
        for number, trial in enumerate(led[:_FOLLOWED_AT_MOST])
        if trial.gap <= (_WORTH if number < _FOLLOWED else level) * led[0].gap
        and (number < _FEW or idle.squares - trial.squares >= least)
    ]


def _followed(workers: Workers, led: Sequence[Trial], free: int, done: Callable[[], None]) -> list[Trial]:
    """These, the best first, with all errors; where one of the first few leaves little, or far less than the
    others with few parameters, only those that were not far behind; where both, none.  free: of the present
    model.
    """
    first = further(workers, led[:_MOST], "quick", done)
    if not first:
        return []
    little = first[0].gap <= MISSING
    ahead = first[0].free - free < POLICY.many and stands_out(first)
    most = (_WITHIN if little or ahead else np.inf) * led[0].gap
    left = [] if little and ahead else [trial for trial in led[_MOST:] if trial.gap <= most]
    return sorted([*first, *further(workers, left, "quick", done)], key=squares_of)


def stands_out(quick: Sequence[Trial]) -> bool:
    """Whether the first of some trials leaves far less than all others: it hides behind nothing."""
    return all(quick[0].gap <= _ALONE * other.gap for other in quick[1:])


def _of_a_sensor(problem: Problem, effect: Effect) -> bool:
    """Whether an effect is about what a single sensor reads: many of them, which say at a glance what they
    do, while a delay of all responses shows only once the rest has moved with it.
    """
    return any(isinstance(place, Rows) for place in effect.places(problem.robot, problem.points))
