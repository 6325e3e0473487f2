"""First looks at candidates where errors of what was told are stated and fitted along: residuals count for
little at first, so that the errors stay near what was stated (`identify.discovery.softly`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from identify.core.thresholds import MISSING, QUIET
from identify.discovery.evidence import FAR, POLICY, above_noise, nearly_closed, removed
from identify.discovery.neighbours import moved, siblings, turning
from identify.discovery.suspects import stated_already
from identify.discovery.task import Task, Trial, near_enough, once, squares_of
from identify.discovery.workers import Workers
from identify.model.effects.appended_resonator import AppendedResonator
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.place import Rows
from identify.model.effects.springs import Springs
from identify.vibration.nuisances.nuisance import bare
from identify.vibration.problem import Problem

_GLANCED, _FOLLOWED, _MOST, _VARIED = 8, 12, 4, 2
"""How many wrong channels are followed beyond a glance, and how many candidates beyond first looks; get to
the likelihood; and of those, are tried in their other variants, and afresh where none has closed the gap."""
_FOLLOWED_AT_MOST, _LEVEL, _LEVEL_NEARBY = 30, 1.1, 1.2
"""How many are followed where they are level with the best one, leaving at most so many times its gap; where
little is left, of which bodies take most while only errors of links move.
"""
_WORTH, _NEARLY = 2.5, 1.5
"""How many times the best one's gap a candidate may leave when residuals count for little, and still be
followed; and how many times its squares, to be fitted to the likelihood."""
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
_HALF = 0.5
"""Share of the present gap above noise that an effect must explain for its variants to begin afresh."""
_TIMES, _AS_NEAR = 2.0, 1.3
"""How many times the best one's gap above noise a candidate may leave at the likelihood, and still win; and a
variant, which few lines compare with it well."""
_SOMETHING = 0.1
"""Share of the present gap above noise that a third candidate must explain, as far as few lines tell."""
_NOWHERE_NEAR = 2 * FAR
"""Gap where residuals count for little that no likelihood closes."""
_AHEAD = 0.9
"""What share of the gap of a form with fewer parameters one leaves that is far ahead."""
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


def further(
    workers: Workers,
    trials: Sequence[Trial],
    how: Literal["led", "quick", "nearby", "likely", "afresh", "thorough", "onward", "settled"],
    done: Callable[[], None] = lambda: None,
) -> list[Trial]:
    """Trials taken on from where they are, the best first."""
    tasks = [replace(trial.task, values=trial.values, how=how, far=False) for trial in trials]
    return sorted(workers.run(tasks, done), key=squares_of)


def promising_softly(screened: Sequence[Trial]) -> list[Trial]:
    """Those that may win: what leaves far more than the best one does not; where that leaves much, so that
    something else is missing, only the best few and the smallest of the others.
    """
    quick = [trial for trial in screened if trial.task.how == "quick"]
    best = min((trial.squares for trial in quick), default=np.inf)
    chosen = [trial for trial in quick if trial.squares <= _NEARLY * best][:_MOST]
    if chosen and chosen[0].gap > MISSING:
        chosen = [*chosen[:_VARIED], *sorted(chosen[_VARIED:], key=lambda one: one.free)[:1]]
    new = [trial.task.new for trial in chosen]
    return [*chosen, *(t for t in screened if t.task.how == "beside" and t.task.new not in new)]


def thorough_softly(workers: Workers, trials: Sequence[Trial], present: float = np.inf) -> list[list[Trial]]:
    """Each promising candidate that may win on all lines, the best of them in their other variants too.

    From where residuals counted for little to the likelihood; afresh too where none of them closes the gap,
    but variants only where the best of them comes near, and afresh where it explains half of the present gap:
    with less, something else is missing beside it, and forms are compared once that is found.
    """
    beside = [trial for trial in trials if trial.task.how == "beside"]
    if len(beside) == len(trials):  # looked at from the present model alone
        ends = further(workers, beside, "nearby")
    else:
        ends = _to_likelihood(workers, [trial for trial in trials if trial not in beside], beside)
    whole = further(workers, _near_enough(ends, present), "onward")
    if not whole:
        return []
    added = whole[0].task.new if removed(present, whole[0].gap) >= _HALF else ()
    others = varied_softly(workers, _other_forms(whole), whole[0], added, closed=whole[0].gap <= QUIET)
    return [
        [one, *(other for other in others if other.task.new[0] in one.task.new[0].variants())]
        for one in whole
    ]


def _other_forms(whole: Sequence[Trial]) -> list[Task]:
    """What else the best few effects may be: of one while much is left, of none from far."""
    if whole[0].gap > FAR:
        return []
    tried, tasks = [one.task.new for one in whole], list[Task]()
    for one in whole[: 1 if whole[0].gap > MISSING else _VARIED]:
        left = [variant for variant in one.task.new[0].variants() if (variant,) not in tried]
        tried += [(variant,) for variant in left]
        tasks += [replace(one.task, new=(variant,), values=one.values) for variant in left]
    return tasks


def _to_likelihood(workers: Workers, quick: Sequence[Trial], beside: Sequence[Trial]) -> list[Trial]:
    """Quick trials at the likelihood, best first, and what was looked at beside the present model: afresh, or
    from there where one of the others closes the gap.

    The best of the quick ones also afresh where none of them closes the gap, but not where they leave so much
    that something else is missing; of what leaves still more the likelihood would only bend the errors.
    """
    if not beside and min(trial.gap for trial in quick) > _NOWHERE_NEAR:
        return sorted(quick, key=squares_of)
    likely = further(workers, quick, "likely")
    if above_noise(likely[0].gap):
        besides = workers.run([replace(trial.task, how="afresh") for trial in beside])
    else:
        besides = further(workers, beside, "nearby")
    best = once(sorted([*likely, *besides], key=squares_of))
    if QUIET < best[0].gap <= FAR:
        left = [end for end in best[:_VARIED] if not _nonuniform(end.task)]
        best = once(sorted([*best, *further(workers, left, "afresh")], key=squares_of))
    return best


def _nonuniform(task: Task) -> bool:
    """Whether what is new is a link that is not uniform: only the uniform one leads to where it begins."""
    return isinstance(task.new[0], LinkFlexibility) and task.new[0].nonuniform


def _near_enough(ends: Sequence[Trial], present: float = np.inf) -> Sequence[Trial]:
    """Those, the best first, that may win on all lines, as they explain something of the present gap, and the
    second: what is best is told with a rival.

    While something else is missing beside them only the best one, and a smaller one that is as near: details
    are compared once that is found.
    """
    if ends and ends[0].gap > MISSING:
        best, *others = _one_form_each(ends)
        smaller = [one for one in others if one.free < best.free and one.gap <= _LEVEL * best.gap]
        return [best, *sorted(smaller, key=lambda one: one.free)[:1]]
    near = near_enough(ends, min((end.gap for end in ends), default=np.inf), _TIMES)
    explaining = [end for end in near if removed(present, end.gap) >= _SOMETHING]
    return ends[: max(_VARIED, len(explaining))]


def _one_form_each(ends: Sequence[Trial]) -> list[Trial]:
    """The best first, of each effect the form with the fewest parameters that a richer one is not far ahead
    of.
    """
    chosen: list[Trial] = []
    for end in sorted(ends, key=lambda one: one.free):
        alike = [one for one in chosen if one.task.new[0] in end.task.new[0].variants()]
        if all(end.gap < _AHEAD * one.gap for one in alike):
            chosen = [*(one for one in chosen if one not in alike), end]
    return sorted(chosen, key=squares_of)


def _softly(workers: Workers, best: Trial, tasks: Sequence[Task]) -> list[Trial]:
    """The best trial's model, then those of the tasks, where residuals count for little."""
    found = []
    for task in (replace(best.task, values=best.values), *tasks):
        *known, last = task.effects
        found.append(Task(tuple(known), (last,), task.values, "quick"))
    return workers.run(found)


def closing(workers: Workers, tasks: Sequence[Task], best: Trial) -> list[Task]:
    """Those of the tasks that leave about as little as the best model where residuals count for little."""
    if not tasks:
        return []
    soft, *others = _softly(workers, best, tasks)
    found = zip(tasks, others, strict=True)
    return [task for task, trial in found if trial.squares <= _NEARLY * soft.squares]


def varied_softly(
    workers: Workers, tasks: Sequence[Task], best: Trial, added: Sequence[Effect], *, closed: bool = False
) -> list[Trial]:
    """Other variants of effects on all lines, but those that leave far more than the best trial does where
    residuals count for little, or on few lines.

    closed: the best trial closes the gap, so that directions that turn only count by what is missing where
    errors are few; else they may take away errors that it needs.

    Variants that give it more free parameters, which can leave less, go without its errors, which are bent
    far where they make up for a form that is not quite right; of effects that were added to it also by
    another start.
    """
    if not tasks:
        return []
    soft, *variants = _softly(workers, best, tasks)

    def most(trial: Trial) -> float:
        if trial.free <= best.free:
            return _NEARLY
        return _IDLE if closed and trial.task.new[0].valleys > 1 else np.inf

    def start(trial: Trial) -> Mapping[str, float]:
        return bare(trial.values) if trial.free > best.free else trial.values

    found = zip(tasks, variants, strict=True)
    chosen = [(task, trial) for task, trial in found if trial.squares <= most(trial) * soft.squares]
    ends = workers.run([replace(task, values=start(trial), how="likely") for task, trial in chosen])
    richer = [one for effect in added for one in effect.variants()]
    again = [
        replace(task, how="afresh")
        for (task, _), end in zip(chosen, ends, strict=True)
        if task.new[0] in richer and not _nonuniform(task) and end.free > best.free and end.gap > QUIET
    ]
    every = sorted([*ends, *workers.run(again)], key=squares_of)
    return further(workers, near_enough(once(every), best.gap, _AS_NEAR), "onward")
