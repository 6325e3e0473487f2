"""First looks at candidates, cheaply: what gets further than a glance, and which two may hide each other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from identify.core.thresholds import QUIET
from identify.discovery.evidence import EvidenceCriterion, removed
from identify.discovery.trial import Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.selection.turn import as_options
from identify.fitting.selection.workbench import Attempt, Option, Step, Story
from identify.model.effects.base import Effect

_GLANCED, _REFITTED, _MOST, _VARIED = 8, 12, 4, 2
"""How many effects of single channels get further than a glance; candidates further than a few steps; further
than quick trials; and of those, are tried in their other variants."""
_PAIRED, _OF_A_KIND, _FAR_MORE = 9, 2, 0.5
"""How many are tried in pairs; how many of them may be of one kind; what a pair must leave at most of what
the best one leaves."""
_NEAR, _LEAST_INFLATION = 5.0, 5.0
"""How many times the best one's gap above noise a candidate may leave and still win when fitted thoroughly;
the least that correlation of residuals has been seen to count for."""


def attempt(before: Trial, trial: Trial) -> Attempt[Effect, Trial]:
    """A trial of one more effect."""
    return Attempt(trial.task.new[0], trial, trial.free - before.free)


def screened(workers: Workers, found: Sequence[Effect], before: Trial, story: Story) -> list[Trial]:
    """All candidates, best first: after a glance at those of single channels and a few steps of the others,
    the best of them quickly.
    """
    known, values, far, anchor = before.task.effects, before.values, before.gap > QUIET, anchor_of(before)
    places = Counter(effect.kind for effect in found)
    measuring, others = list[Effect](), list[Effect]()
    for effect in found:
        (measuring if effect.of_measurement and places[effect.kind] > 1 else others).append(effect)
    glances = sorted(
        workers.run([Task(known, (effect,), values, "glance", anchor=anchor) for effect in measuring]),
        key=squares_of,
    )
    tasks = [
        Task(known, (effect,), values, "brief", far, anchor)
        for effect in (*others, *(t.task.new[0] for t in glances[:_GLANCED]))
    ]
    count = [0]

    def one() -> None:
        count[0] += 1
        story.done(count[0], len(tasks))

    brief = sorted(workers.run(tasks, one), key=squares_of)
    best = [trial for trial in brief[:_REFITTED] if np.isfinite(trial.squares)]
    quick = workers.run([Task(known, trial.task.new, trial.values, "quick", anchor=anchor) for trial in best])
    return [*sorted(quick, key=squares_of), *brief[len(quick) :], *glances[_GLANCED:]]


def promising(workers: Workers, before: Trial, quick: Sequence[Trial]) -> list[Trial]:
    """Those that may win: near the best one, and better than nothing on the few lines that were looked at."""
    anchor = anchor_of(before)
    [present] = workers.run([Task(before.task.effects, (), before.values, "quick", anchor=anchor)])
    best = quick[0]
    criterion = EvidenceCriterion(_LEAST_INFLATION * best.gap**2)
    most = _MOST // 2 if anchor else _MOST  # simulated ones take long
    near = [
        t
        for t in quick[:most]
        if t.gap - 1 <= _NEAR * max(best.gap - 1, 0.05) and criterion.log_odds(present, t) > 0
    ]
    return near or [best]


def thorough(workers: Workers, trials: Sequence[Trial]) -> list[list[Trial]]:
    """Each promising candidate on all lines, the best of them in their other variants too; those with a
    solution.
    """
    tasks, owners = [], []
    for number, trial in enumerate(trials):
        effect = trial.task.new[0]
        variants = effect.variants() if number < _VARIED and not trial.task.anchor else []
        for one in (effect, *variants):
            tasks.append(Task(trial.task.known, (one,), trial.values, "thorough"))
            owners.append(number)
    found = list(zip(owners, workers.run(tasks), strict=True))
    return [
        [t for owner, t in found if owner == number and np.isfinite(t.squares)]
        for number in range(len(trials))
    ]


def first_of_two(
    workers: Workers, step: Step[Effect, Trial], quick: Sequence[Trial]
) -> tuple[Option[Effect, Trial], float]:
    """What the step chose, or the better of two simple ones that together would explain far more than it; and
    the fraction that is explained then.

    Two effects hide each other, and what stands for both of them at once, with many parameters, is not
    either.
    """
    before, best = step.before, step.found[0]
    known, pairs = before.task.effects, list(combinations(quick, 2))
    trials = workers.run(
        [Task(known, (*a.task.new, *b.task.new), {**b.values, **a.values}, "quick") for a, b in pairs]
    )
    number = min(range(len(pairs)), key=lambda n: trials[n].squares)
    if trials[number].gap - 1 > _FAR_MORE * (best.model.gap - 1):
        return best, best.gain.explained
    two = [trial.task.new[0] for trial in pairs[number]]
    single = workers.run(
        [
            Task(known, (effect,), trial.values, "thorough")
            for effect, trial in zip(two, pairs[number], strict=True)
        ]
    )
    either = [option for option in step.options if option.effect in two]
    alone = as_options(step.criterion, before, [attempt(before, trial) for trial in single])
    either += sorted((o for o in alone if o.gain.confirmed), key=lambda option: -option.gain.log_odds)
    chosen = max(either, key=lambda option: option.gain.log_odds, default=best)
    return chosen, removed(before.gap, trials[number].gap)


def various(quick: Sequence[Trial]) -> list[Trial]:
    """The best, but few of each kind: what resembles the best one comes right behind it, and what is missing
    beside it may not.
    """
    chosen: list[Trial] = []
    for trial in quick:
        alike = sum(one.task.new[0].kind == trial.task.new[0].kind for one in chosen)
        if alike < _OF_A_KIND and len(chosen) < _PAIRED and np.isfinite(trial.squares):
            chosen.append(trial)
    return chosen


def anchor_of(before: Trial) -> Mapping[str, float]:
    """The values of a model that depends on amplitude; nothing for a linear one."""
    return before.values if any(effect.of_amplitude for effect in before.task.effects) else {}


def squares_of(trial: Trial) -> float:
    """Sum of squared residuals over noise."""
    return trial.squares
