"""Candidates from where residuals counted for little to the likelihood, where errors of what was told are
fitted along (`identify.discovery.softly`): what may win, on few lines and on all, and other forms of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identify.core.thresholds import MISSING, QUIET
from identify.discovery.evidence import FAR, above_noise, removed
from identify.discovery.task import Task, Trial, near_enough, once, squares_of
from identify.discovery.workers import Workers, further
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.vibration.nuisances.nuisance import bare

_MOST, _VARIED = 4, 2
"""How many candidates get to the likelihood; and of those, are tried in their other variants, and afresh
where none has closed the gap."""
_NEARLY, _LEVEL = 1.5, 1.1
"""How many times the best one's squares a candidate may leave, where residuals count for little, to be fitted
to the likelihood; how many times its gap a smaller one, to be as near."""
_HALF = 0.5
"""Share of the present gap above noise that an effect must explain for its variants to begin afresh."""
_TIMES, _AS_NEAR = 2.0, 1.3
"""How many times the best one's gap above noise a candidate may leave at the likelihood, and still win; and a
variant, which few lines compare with it well."""
_SOMETHING = 0.1
"""Share of the present gap above noise that a third candidate must explain, as far as few lines tell."""
_NOWHERE_NEAR = 2 * FAR
"""Gap where residuals count for little that no likelihood closes."""
_AHEAD, _IDLE = 0.9, 0.99
"""What share of the gap of a form with fewer parameters one leaves that is far ahead; of the best trial's
squares, a form that does something."""


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
