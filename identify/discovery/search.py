"""One step of the loop: every candidate is tried, cheaply first, the promising ones thoroughly, and the best
is chosen by evidence.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from identify.core.parameters import Scale
from identify.core.thresholds import CONVINCING, QUIET
from identify.discovery.candidates import candidates, plausible
from identify.discovery.evidence import EvidenceCriterion, confirmed, removed
from identify.discovery.trial import Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.uncertainty import statuses
from identify.model.effects.base import Effect
from identify.model.effects.measurement import MeasurementEffect
from identify.model.effects.nonlinear import NonlinearEffect
from identify.vibration.problem import Problem, with_effects
from identify.vibration.uncertainty import uncertainty

_GLANCED, _REFITTED, _MOST, _FORMED = 8, 12, 4, 2
"""How many effects of single channels get further than a glance; candidates further than a few steps; further
than quick trials; and of those, are tried in their other variants."""
_ENOUGH, _PAIRED, _OF_A_KIND, _FAR_MORE = 0.9, 9, 2, 0.5
"""Where the best one explains less than this share of what is above noise, so many are tried in pairs; how
many of them may be of one kind; what a pair must leave at most of what the best one leaves."""
_NEAR, _LEAST_INFLATION = 5.0, 5.0
"""How many times the best one's gap above noise a candidate may leave and still win when fitted thoroughly;
the least that correlation of residuals has been seen to count for."""


@dataclass(frozen=True)
class Option:
    """A candidate with its best trial and the evidence for it over the model without it; not thorough where a
    quick look was enough.
    """

    effect: Effect
    trial: Trial
    evidence: float

    @property
    def thorough(self) -> bool:
        """Whether it was fitted on all lines and several starts."""
        return self.trial.task.how == "thorough"


@dataclass(frozen=True)
class Step:
    """What one search found: the model before; all options, best first; what the data cannot tell from the
    best; how it was judged.

    reach: the least gap seen, of the best one or of it together with another.
    """

    before: Trial
    options: tuple[Option, ...]
    best: Option | None
    alike: tuple[Option, ...]
    judge: EvidenceCriterion
    reach: float


def search(
    workers: Workers,
    problem: Problem,
    before: Trial,
    done: Callable[[int, int], None] = lambda number, total: None,
) -> Step:
    """Try all candidates beside the effects of `before`; `done` is told the number of finished trials and of
    all so far.
    """
    model = with_effects(problem, before.task.effects, before.values)
    quick = _screened(
        workers, plausible(model, before.values, candidates(problem, before.task.effects)), before, done
    )
    promising = _promising(workers, before, quick)
    variants = _thoroughly(workers, promising)
    judge = EvidenceCriterion(
        inflation(problem, min([before, *(trial for trials in variants for trial in trials)], key=_squares))
    )
    judged = as_options(judge, before, [min(trials, key=judge.score) for trials in variants if trials])
    rest = [Option(t.task.new[0], t, float("nan")) for t in quick if t not in promising]
    best = next(
        (option for option in judged if option.evidence > CONVINCING and confirmed(before, option.trial)),
        None,
    )
    if best is None:
        return Step(before, (*judged, *rest), None, (), judge, before.gap)
    reach = best.trial.gap
    if removed(before.gap, reach) < _ENOUGH and not _anchor(before):
        best, reach = _first_of_two(workers, before, _various(quick), judged, best, judge)
        judged = judged if best in judged else [*judged, best]
    alike = [
        o
        for o in judged
        if o is not best and confirmed(before, o.trial) and best.evidence - o.evidence < CONVINCING
    ]
    return Step(before, (*judged, *rest), best, tuple(alike), judge, reach)


def as_options(judge: EvidenceCriterion, before: Trial, trials: Sequence[Trial]) -> list[Option]:
    """What trials of one effect each have to say for it over the model before, best first."""
    return sorted(
        (Option(t.task.new[0], t, judge.evidence(before, t)) for t in trials),
        key=lambda option: -option.evidence,
    )


def _first_of_two(
    workers: Workers,
    before: Trial,
    quick: Sequence[Trial],
    judged: Sequence[Option],
    best: Option,
    judge: EvidenceCriterion,
) -> tuple[Option, float]:
    """The best of judged, or the better of two simple ones that together would explain far more than it; and
    the gap in reach.

    Two effects hide each other, and what stands for both of them at once, with many parameters, is not
    either.
    """
    known = before.task.effects
    pairs = list(combinations(quick, 2))
    trials = workers.run(
        [Task(known, (*a.task.new, *b.task.new), {**b.values, **a.values}, "quick") for a, b in pairs]
    )
    number = min(range(len(pairs)), key=lambda n: trials[n].squares)
    if trials[number].gap - 1 > _FAR_MORE * (best.trial.gap - 1):
        return best, best.trial.gap
    two = [trial.task.new[0] for trial in pairs[number]]
    single = workers.run(
        [
            Task(known, (effect,), trial.values, "thorough")
            for effect, trial in zip(two, pairs[number], strict=True)
        ]
    )
    either = [option for option in judged if option.effect in two]
    either += as_options(judge, before, [trial for trial in single if confirmed(before, trial)])
    return max(either, key=lambda option: option.evidence, default=best), trials[number].gap


def _various(quick: Sequence[Trial]) -> list[Trial]:
    """The best, but few of each kind: what resembles the best one comes right behind it, and what is missing
    beside it may not.
    """
    chosen: list[Trial] = []
    for trial in quick:
        alike = sum(one.task.new[0].kind == trial.task.new[0].kind for one in chosen)
        if alike < _OF_A_KIND and len(chosen) < _PAIRED and np.isfinite(trial.squares):
            chosen.append(trial)
    return chosen


def _screened(
    workers: Workers, found: Sequence[Effect], before: Trial, done: Callable[[int, int], None]
) -> list[Trial]:
    """All candidates, best first: after a glance at those of single channels and a few steps of the others,
    the best of them quickly.
    """
    known, values, far, anchor = before.task.effects, before.values, before.gap > QUIET, _anchor(before)
    places = Counter(effect.kind for effect in found)
    measuring, others = list[Effect](), list[Effect]()
    for effect in found:
        (measuring if isinstance(effect, MeasurementEffect) and places[effect.kind] > 1 else others).append(
            effect
        )
    glances = sorted(
        workers.run([Task(known, (effect,), values, "glance", anchor=anchor) for effect in measuring]),
        key=_squares,
    )
    tasks = [
        Task(known, (effect,), values, "brief", far, anchor)
        for effect in (*others, *(t.task.new[0] for t in glances[:_GLANCED]))
    ]
    count = [0]

    def one() -> None:
        count[0] += 1
        done(count[0], len(tasks))

    brief = sorted(workers.run(tasks, one), key=_squares)
    best = [trial for trial in brief[:_REFITTED] if np.isfinite(trial.squares)]
    quick = workers.run([Task(known, trial.task.new, trial.values, "quick", anchor=anchor) for trial in best])
    return [*sorted(quick, key=_squares), *brief[len(quick) :], *glances[_GLANCED:]]


def _promising(workers: Workers, before: Trial, quick: Sequence[Trial]) -> list[Trial]:
    """Those that may win: near the best one, and better than nothing on the few lines that were looked at."""
    [present] = workers.run([Task(before.task.effects, (), before.values, "quick", anchor=_anchor(before))])
    best = quick[0]
    judge = EvidenceCriterion(_LEAST_INFLATION * best.gap**2)
    most = _MOST // 2 if _anchor(before) else _MOST  # simulated ones take long
    near = [
        t
        for t in quick[:most]
        if t.gap - 1 <= _NEAR * max(best.gap - 1, 0.05) and judge.evidence(present, t) > 0
    ]
    return near or [best]


def _thoroughly(workers: Workers, promising: Sequence[Trial]) -> list[list[Trial]]:
    """Each promising candidate on all lines, the best of them in their other variants too."""
    tasks, owners = [], []
    for number, trial in enumerate(promising):
        variants = trial.task.new[0].variants() if number < _FORMED and not trial.task.anchor else []
        for effect in (trial.task.new[0], *variants):
            tasks.append(Task(trial.task.known, (effect,), trial.values, "thorough"))
            owners.append(number)
    found = list(zip(owners, workers.run(tasks), strict=True))
    return [
        [t for owner, t in found if owner == number and np.isfinite(t.squares)]
        for number in range(len(promising))
    ]


def inflation(problem: Problem, trial: Trial) -> float:
    """How many times too small the naive variance of the parameters is, for the worst of those that the data
    determine.
    """
    model = with_effects(problem, trial.task.effects, trial.values)
    scale = Scale(model.parameters)
    found = uncertainty(model.targets(), scale, model.initial)
    ratio = (found.std / found.independent_std) ** 2
    known = np.array([status != "not determined" for status in statuses(scale, model.initial, found.std)])
    return float(np.max(ratio, where=known, initial=1.0))


def _squares(trial: Trial) -> float:
    return trial.squares


def _anchor(before: Trial) -> Mapping[str, float]:
    """The values of a model that depends on amplitude; nothing for a linear one."""
    return before.values if any(isinstance(effect, NonlinearEffect) for effect in before.task.effects) else {}
