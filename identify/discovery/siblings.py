"""What is refitted beside the best candidates before one of them is settled on: the same kind on the links or
joints beside it, and simpler forms that only its refit can suggest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.thresholds import QUIET
from identify.discovery.neighbours import siblings
from identify.discovery.screen import likeliest_first, thorough
from identify.discovery.strut import springs_of, strut_task
from identify.discovery.task import Task, Trial, near_enough, solved
from identify.discovery.thinned import thinned
from identify.discovery.workers import Workers
from identify.model.effects.base import Effect
from identify.vibration.problem import Problem

_NEARLY, _NOISE = 1.5, 0.03
"""How many times the gap above noise that the best candidate leaves springs in any direction may leave for a
strut to be tried; which gap above noise counts as none."""


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


def with_struts(workers: Workers, problem: Problem, groups: Sequence[list[Trial]]) -> list[list[Trial]]:
    """Springs in any direction that leave about as little as the best candidate also as a single strut."""
    best = min((trial.gap for group in groups for trial in group), default=np.inf)
    most = 1 + _NEARLY * max(best - 1, _NOISE)
    near = [[t for t in group if t.gap <= most and springs_of(t)] for group in groups]
    if not any(near):
        return list(groups)
    thin = thinned(problem)
    tasks = [[task for t in group if (task := strut_task(thin, t))] for group in near]
    return [
        [*group, *(t for t in workers.run(own) if solved(t))]
        for group, own in zip(groups, tasks, strict=True)
    ]
