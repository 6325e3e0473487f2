"""What is refitted beside the best candidates before one of them is settled on: the same kind on the links or
joints beside it, and simpler forms that only its refit can suggest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.thresholds import QUIET
from identify.discovery.evidence import clearly_nearer
from identify.discovery.lean import leaning_task, may_lean
from identify.discovery.neighbours import siblings, turning
from identify.discovery.screen import likeliest_first, thorough
from identify.discovery.strut import springs_of, strut_task
from identify.discovery.task import Task, Trial, near_enough, solved, squares_of
from identify.discovery.thinned import thinned
from identify.discovery.workers import Workers, further
from identify.model.effects.base import Effect
from identify.vibration.problem import Problem

_NEARLY, _NOISE = 1.5, 0.03
"""How many times the gap above noise that the best candidate leaves springs in any direction may leave for a
strut to be tried; which gap above noise counts as none."""
_OPEN, _PAIRS, _FEW = 1.5, 2, 4
"""The gap above which none of the candidates is what is missing; how many of two directions are turned; how
many springs beside the best ones are taken further."""


def with_siblings(
    workers: Workers,
    problem: Problem,
    before: Trial,
    found: Sequence[Effect],
    groups: Sequence[list[Trial]],
) -> list[list[Trial]]:
    """The refitted candidates, with what resembles the likeliest of them where that leaves about noise: the
    same kind in the same place and on the links or joints beside it, on from there while that is likelier.

    What data that were fitted hardly tell apart, a quick look at few of them puts in any order.
    """
    result, tried = list(groups), [group[0].task.new[0] for group in groups if group]
    while trials := [trial for group in result for trial in group]:
        best = likeliest_first(trials)[0]
        left = [one for one in siblings(problem, best.task.new[0], found) if one not in tried]
        if best.gap > QUIET or not left:
            break
        tried += left
        quick = workers.run([Task(before.task.effects, (one,), before.values) for one in left])
        result += thorough(workers, near_enough(quick, best.gap))
    return result


def with_springs_beside(
    workers: Workers, problem: Problem, quick: Sequence[Trial], groups: Sequence[list[Trial]]
) -> list[list[Trial]]:
    """The refitted candidates where errors of what was told are fitted along and springs in any direction
    leave least, with those on the same link and on the links beside it, from their quick trials: which of
    them is right, struts in their place tell.
    """
    trials = [trial for group in groups for trial in group]
    best = min(trials, key=squares_of, default=None)
    if best is None or springs_of(best) is None:
        return list(groups)
    tried = [trial.task.new[0] for trial in trials]
    alike = siblings(problem, best.task.new[0], [trial.task.new[0] for trial in quick])
    left = [t for t in quick if t.task.new[0] in alike and t.task.new[0] not in tried]
    near = near_enough(further(workers, sorted(left, key=squares_of)[:_FEW], "likely"), best.gap, _NEARLY)
    return [*groups, *([trial] for trial in further(workers, near, "onward"))]


def with_struts(workers: Workers, groups: Sequence[list[Trial]]) -> list[list[Trial]]:
    """Springs in any direction that leave about as little as the best candidate also as a single strut."""
    best = min((trial.gap for group in groups for trial in group), default=np.inf)
    most = 1 + _NEARLY * max(best - 1, _NOISE)
    near = [(n, t) for n, group in enumerate(groups) for t in group if t.gap <= most and springs_of(t)]
    result = [list(group) for group in groups]
    if not near:
        return result
    found = list(zip(near, workers.each(_strut_task, [trial for _, trial in near]), strict=True))
    numbers, tasks = [n for (n, _), task in found if task], [task for _, task in found if task]
    if workers.with_errors:  # which made up for what the springs left open
        ends = workers.run([replace(task, how="likely") for task in tasks])
        tasks = [replace(task, values=end.values) for task, end in zip(tasks, ends, strict=True)]
    for number, trial in zip(numbers, workers.run(tasks), strict=True):
        if solved(trial):
            result[number].append(trial)
    return result


def with_leaning(workers: Workers, groups: Sequence[list[Trial]]) -> list[list[Trial]]:
    """The best measured law on a single coordinate, if it leaves about as little as the best candidate, about
    an axis of its own direction where the data show one; not beside errors of what was told.
    """
    result = [list(group) for group in groups]
    best = min((trial.gap for group in groups for trial in group), default=np.inf)
    laws = [(t.squares, n, t) for n, group in enumerate(groups) for t in group if may_lean(t.task.new[0])]
    if not laws or workers.with_errors:
        return result
    _, number, law = min(laws, key=lambda one: one[0])
    if not near_enough([law], best, _NEARLY):
        return result
    [task] = workers.each(leaning_task, [law])
    for turned in workers.run([task]) if task else []:
        if turned.squares < law.squares:
            [own] = thorough(workers, [turned])  # with its variants: fewer or more relaxation times
            result[number] = [*own, *(trial for trial in groups[number] if trial is not law)]
    return result


def with_coupled(
    workers: Workers, quick: Sequence[Trial], groups: Sequence[list[Trial]]
) -> list[list[Trial]]:
    """The refitted candidates; where all of them leave far more than noise, with the best quick ones of two
    directions in the form whose soft direction lies anywhere between them: without it they may not get far.
    """
    least = min((trial.gap for group in groups for trial in group), default=0.0)
    if least <= _OPEN:
        return list(groups)
    pairs = [(trial, forms) for trial in quick if (forms := turning(trial.task.new[0]))]
    tried = [trial.task.new for group in groups for trial in group]
    tasks = [
        Task(trial.task.known, (form,), trial.values, "thorough")
        for trial, forms in pairs[:_PAIRS]
        for form in forms
        if (form,) not in tried
    ]
    return [*groups, *([trial] for trial in clearly_nearer(workers.run(tasks), least))]


def _strut_task(problem: Problem, trial: Trial) -> Task | None:
    """None, too, where the search for its direction fails: one candidate ends no search."""
    try:
        return strut_task(thinned(problem), trial)
    except np.linalg.LinAlgError:
        return None
