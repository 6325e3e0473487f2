"""Two effects that hide each other: which of the candidates are tried in pairs, and what a pair says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np

from identify.core.thresholds import MISSING, QUIET
from identify.discovery.evidence import CLOSED, removed
from identify.discovery.screen import attempt
from identify.discovery.task import Option, Step, Task, Trial, squares_of
from identify.discovery.workers import Workers, further
from identify.fitting.selection.turn import as_options
from identify.model.effects.base import Effect

_PAIRED, _OF_A_KIND, _FAR_MORE = 9, 2, 0.5
"""How many are tried in pairs; how many of them may be of one kind; what a pair must leave at most of what
the best one leaves."""
_IDLE, _PAIRS = 0.98, 8
"""Share of the present squares above which an effect does nothing, so that two of them are no pair; how many
pairs are refitted after a few steps of all."""


@dataclass(frozen=True)
class Two:
    """Two effects that may hide each other: the better one, or what a step chose; the fraction that is
    explained then; quick trials of all pairs, the best first; refits of one of the best pair each.
    """

    best: Option
    explained: float
    pairs: Sequence[Trial] = ()
    single: Sequence[Trial] = ()


def various(quick: Sequence[Trial]) -> list[Trial]:
    """The best, but few of each kind and one form of each: what resembles the best one comes right behind it,
    and what is missing beside it may not.
    """
    chosen, forms = list[Trial](), list[Effect]()
    for trial in quick:
        [effect] = trial.task.new
        alike = sum(one.task.new[0].kind == effect.kind for one in chosen)
        known = any(one in forms for one in (effect, *effect.variants()))
        if alike < _OF_A_KIND and len(chosen) < _PAIRED and not known and np.isfinite(trial.squares):
            chosen.append(trial)
            forms += [effect, *effect.variants()]
    return chosen


def first_of_two(workers: Workers, step: Step, quick: Sequence[Trial]) -> Two:
    """What the step chose, or the better of two simple ones that together would explain far more than it.

    Two effects hide each other, and what stands for both of them at once, with many parameters, is not
    either.  Where errors of what was told are fitted along, which takes long, only if they nearly close the
    gap.
    """
    before, best = step.before, step.found[0]
    known, pairs = before.task.effects, _pairs(workers, step.before, quick)
    if not pairs:
        return Two(best, best.gain.explained)
    tried = _together(workers, before, pairs)
    if workers.with_errors and tried[0].gap > MISSING:
        return Two(best, max(best.gain.explained, removed(before.gap, tried[0].gap)), tried)
    at_first, by_one, by_two = _above_noise(workers, step, quick, tried[0])
    if by_two > _FAR_MORE * by_one:
        return Two(best, best.gain.explained, tried)
    two = tried[0].task.new
    pair = next(p for p in pairs if two == (*p[0].task.new, *p[1].task.new))
    if workers.with_errors:
        there = [option.model.task.new for option in step.options]
        left = [one for one in pair if one.task.new not in there]
        single = further(workers, further(workers, left, "likely"), "onward")
    else:
        single = workers.run([Task(known, t.task.new, t.values, "thorough") for t in pair])
    either = [option for option in step.options if option.effect in two]
    alone = as_options(step.criterion, before, [attempt(before, trial) for trial in single])
    either += sorted((o for o in alone if o.gain.confirmed), key=lambda option: -option.gain.log_odds)
    chosen = max(either, key=lambda option: option.gain.log_odds, default=best)
    return Two(chosen, 1.0 - max(by_two, 0.0) / max(at_first, 1e-9), tried, single)


def second_of_two(workers: Workers, model: Trial, pairs: Sequence[Trial]) -> list[Trial]:
    """Quick trials of what may be missing beside an effect that was found in one of some pairs, best first;
    none where the best of them leaves more than noise, so that all candidates are to be looked at.
    """
    known = model.task.effects
    how: Literal["likely", "thorough"] = "likely" if workers.with_errors else "thorough"
    quick = [
        replace(pair, task=replace(pair.task, known=known, new=(other,)))
        for pair in pairs
        for one, other in (pair.task.new, pair.task.new[::-1])
        if (*pair.task.known, one) == known
    ]
    quick.sort(key=squares_of)
    near = [trial for trial in quick[:1] if trial.gap <= MISSING]
    return quick if any(end.gap < CLOSED for end in further(workers, near, how)) else []


def _above_noise(
    workers: Workers, step: Step, quick: Sequence[Trial], pair: Trial
) -> tuple[float, float, float]:
    """What gaps are above noise before, with the best one and with a pair; where errors of what was told are
    fitted along, residuals count for little in quick trials, and noise for next to nothing.
    """
    if not workers.with_errors:
        return step.before.gap - 1, step.found[0].model.gap - 1, pair.gap - 1
    [present] = workers.run([Task(step.before.task.effects, (), step.before.values, "quick")])
    return present.gap, quick[0].gap, pair.gap


def _pairs(workers: Workers, before: Trial, quick: Sequence[Trial]) -> list[tuple[Trial, Trial]]:
    """Two of the trials each, but not two that do nothing by themselves."""
    pairs = list(combinations(quick, 2))
    if workers.with_errors:
        return pairs
    [present] = workers.run([Task(before.task.effects, (), before.values, "quick")])
    return [pair for pair in pairs if min(map(squares_of, pair)) < _IDLE * present.squares]


def _together(workers: Workers, before: Trial, pairs: Sequence[tuple[Trial, Trial]]) -> list[Trial]:
    """Quick trials of pairs, the best first; only of those that are the best after a few steps: of linear
    ones also from where each begins, because either by itself made up for the other.
    """
    how: Literal["astray", "brief"] = "astray" if workers.with_errors else "brief"
    known, tasks = before.task.effects, list[Task]()
    for a, b in pairs:
        new = (*a.task.new, *b.task.new)
        far = before.gap > QUIET and not any(effect.of_amplitude for effect in new)
        tasks.append(Task(known, new, {**b.values, **a.values}, how, far))
    near = sorted(workers.run(tasks), key=squares_of)[:_PAIRS]
    if workers.with_errors:
        near = further(workers, near, "led")
    return further(workers, near, "quick")
