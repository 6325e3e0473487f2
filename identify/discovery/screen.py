"""First looks at candidates, cheaply: what gets further than a glance, and which two may hide each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Literal

import numpy as np

from identify.core.parameters import Scale
from identify.core.thresholds import QUIET
from identify.discovery.evidence import CLOSED, MATERIAL, EvidenceCriterion, removed
from identify.discovery.places.job import Known
from identify.discovery.places.look import Looked, candidates_at, look, unknown_laws
from identify.discovery.places.screen import PlaceFit
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.promote import stated_already
from identify.discovery.trial import Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.selection.turn import as_options
from identify.fitting.selection.workbench import Attempt, Option, Step, Story
from identify.model.effects.base import Effect
from identify.vibration.problem import Problem, with_effects

_REFITTED, _MOST, _VARIED, _WORTH = 8, 4, 2, 4.0
"""How many candidates are refitted after the first look; get further than quick trials; and of those, are
tried in their other variants; how many times the best one's squares a candidate may leave after a few steps
and still be refitted."""
_NEARLY = 1.5
"""How many times the squares that the best one leaves a candidate may leave and still win, with errors of
what was told fitted along and residuals that count for little."""
_WITHIN, _PROMISED = 2.0, 0.75
"""How many times the gap above noise that the best trial leaves, and which share of the present one, a linear
step from where the fits of its places ended must come down to for an effect whose steps may have gone astray
there to be tried: a fit that has settled far above promises nothing any more."""
_AT_BOUND = 1e-3
"""Share of the way between its bounds within which a parameter is at one of them."""
_SETTLED = 1.25
"""The gap above which the best effect at the best places may not be all that is missing, or the wrong one."""
_UNEXPLAINED, _EXPLAINED = 2.0, 0.1
"""How many times the gap above noise that the best place leaves the best effect must leave for a law that no
effect has to be tried there, and which gap above noise counts as none."""
_PAIRED, _OF_A_KIND, _FAR_MORE = 9, 2, 0.5
"""How many are tried in pairs; how many of them may be of one kind; what a pair must leave at most of what
the best one leaves."""
_NEAR, _LEAST_INFLATION = 5.0, 5.0
"""How many times the best one's gap above noise a candidate may leave and still win when fitted thoroughly;
the least that correlation of residuals has been seen to count for."""


def attempt(before: Trial, trial: Trial) -> Attempt[Effect, Trial]:
    """A trial of one more effect."""
    return Attempt(trial.task.new[0], trial, trial.free - before.free)


def screened(
    workers: Workers, problem: Problem, found: Sequence[Effect], before: Trial, story: Story
) -> tuple[list[PlaceFit], list[Trial]]:
    """Places and candidates, best first: those at places that explain the gap, by the law that they say, the
    best of them refitted quickly; then the others that have been looked at.

    None where the gap is closed and no place would make it smaller than noise models may be wrong.
    """
    if problem.nuisances.entries:
        return [], screened_softly(workers, problem, found, before, story)
    anchor, known = anchor_of(before), before.task.effects
    linear = [effect for effect in known if not effect.of_amplitude]
    model = with_effects(problem, linear, before.values)
    count = [0]

    def one() -> None:
        count[0] += 1
        story.done(count[0], 0)

    least = MATERIAL if before.gap < CLOSED else -np.inf
    asked = Known(known, off_bounds(problem, linear, before), anchor)
    places, looked = look(workers, model, asked, found, one, least)
    if not places and least == MATERIAL:
        left = _without_place(problem, found)
        return [], workers.run([Task(known, (e,), before.values, anchor=anchor) for e in left], one)
    return places, _refitted(workers, model, asked, found, before, (places, looked), one)


def _refitted(
    workers: Workers,
    model: Problem,
    asked: Known,
    found: Sequence[Effect],
    before: Trial,
    look_at: tuple[Sequence[PlaceFit], Sequence[Looked]],
    one: Callable[[], None],
) -> list[Trial]:
    """What a look at places leaves of the candidates, best first; model has the known linear effects."""
    (places, looked), known, anchor = look_at, before.task.effects, asked.anchor

    def tried(ones: Sequence[Looked], how: Literal["quick", "brief"]) -> list[Trial]:
        tasks = [
            Task(known, (o.effect,), {**before.values, **o.values}, how, before.gap > QUIET, anchor)
            for o in ones
        ]
        return workers.run(tasks, one)

    placed = [o for o in looked if not np.isnan(o.gap) and not o.effect.of_amplitude]
    quick = tried(placed[:_REFITTED], "quick")
    # A dynamic stiffness per level shows where friction acts, not how strong it is: the impact does.
    others = [Looked(effect, np.nan) for effect in found if effect.of_amplitude]
    others += [o for o in looked if np.isnan(o.gap)]
    brief = tried(others, "brief")
    reached = min((trial.gap for trial in (*quick, *brief)), default=np.inf)
    if reached > _SETTLED:
        arrived = _arrived(model, quick, places)
        unseen = _not_seen(found, [*(o for o in placed[:_REFITTED] if o.effect in arrived), *others])
        left = min(_WITHIN * (reached - 1), _PROMISED * (before.gap - 1))
        brief += tried([o for o in unseen if _foreseen(model, o.effect, places) - 1 <= left], "brief")
    quick += _again(workers, brief, quick)
    best = min((trial.gap for trial in quick), default=np.inf)
    if places and not anchor and best - 1 > _UNEXPLAINED * max(places[0].fit.gap - 1, _EXPLAINED):
        quick += tried(candidates_at(workers, model, asked, places, unknown_laws(places), one), "quick")
    rest = [_guessed(before, o, anchor) for o in placed[_REFITTED:]]
    return [*sorted(quick, key=squares_of), *sorted(rest, key=squares_of)]


def off_bounds(problem: Problem, effects: Sequence[Effect], before: Trial) -> Mapping[str, float]:
    """The present values, but where a wrong model has driven them to a bound, those that the effects start
    with: on a logarithmic scale nothing pulls a damper of nearly nothing back.
    """
    if before.gap < CLOSED:
        return before.values
    first = with_effects(problem, effects, {}).parameters
    scale = Scale(first)
    x = scale.to_x(np.array([before.values[p.name] for p in first]))
    lower, upper = scale.bounds()
    room = np.minimum(x - lower, upper - x) / (upper - lower)
    free = (first[number] for number in scale.free)
    return {**before.values, **{p.name: p.initial for p, r in zip(free, room, strict=True) if r < _AT_BOUND}}


def _without_place(problem: Problem, found: Sequence[Effect]) -> list[Effect]:
    """The effects that no look at places can rule out."""
    return [effect for effect in found if not effect.places(problem.robot, problem.points)]


def _not_seen(found: Sequence[Effect], seen: Sequence[Looked]) -> list[Looked]:
    """The other effects of the structure: the steps at their places may have gone astray."""
    known = {one.effect.model_dump_json() for one in seen}
    left = [effect for effect in found if not effect.of_measurement]
    return [Looked(effect, np.nan) for effect in left if effect.model_dump_json() not in known]


def _arrived(problem: Problem, quick: Sequence[Trial], places: Sequence[PlaceFit]) -> list[Effect]:
    """Effects of trials that came about as far as their place says: others may have begun in a wrong
    valley.
    """
    found = []
    for trial in quick:
        effect = trial.task.new[0]
        least = min((fit.gap for fit in _fits_of(problem, effect, places)), default=np.inf)
        if trial.gap - 1 <= _UNEXPLAINED * max(least - 1, _EXPLAINED):
            found.append(effect)
    return found


def _foreseen(problem: Problem, effect: Effect, places: Sequence[PlaceFit]) -> float:
    """The least gap that one more linear step would leave at a place of the effect; 0 where none was
    fitted.
    """
    fits = _fits_of(problem, effect, places)
    return min((fit.gap_before - fit.fall_foreseen for fit in fits), default=0.0)


def _fits_of(problem: Problem, effect: Effect, places: Sequence[PlaceFit]) -> list[SemiParametricFit]:
    """Of the places of an effect."""
    own = effect.places(problem.robot, problem.points)
    return [one.fit for one in places if one.place in own]


def screened_softly(
    workers: Workers, problem: Problem, found: Sequence[Effect], before: Trial, story: Story
) -> list[Trial]:
    """Candidates, best first, where errors of what was told are stated and fitted along: a glance at those of
    single channels, a few steps of the others with residuals that count for little, the best of them again.
    """
    known, count = before.task.effects, [0]

    def one() -> None:
        count[0] += 1
        story.done(count[0], 0)

    left = [effect for effect in found if not stated_already(problem.nuisances, effect)]
    [present] = workers.run([Task(known, (), before.values, "quick")], one)
    measuring = [effect for effect in left if effect.of_measurement]
    glances = workers.run([Task(known, (e,), present.values, "glance") for e in measuring], one)
    near = sorted(glances, key=squares_of)[:_REFITTED]
    others = [effect for effect in left if not effect.of_measurement]
    tasks = [Task(known, (e,), present.values, "brief") for e in (*others, *(t.task.new[0] for t in near))]
    brief = sorted(workers.run(tasks, one), key=squares_of)
    best = [trial for trial in brief[:_REFITTED] if np.isfinite(trial.squares)]
    quick = workers.run([Task(known, trial.task.new, trial.values, "quick") for trial in best], one)
    return [*sorted(quick, key=squares_of), *brief[len(quick) :]]


def promising_softly(screened: Sequence[Trial]) -> list[Trial]:
    """Those that may win where errors were fitted along: what leaves far more than the best one does not."""
    best = min((trial.squares for trial in screened), default=np.inf)
    near = [trial for trial in screened if trial.task.how == "quick" and trial.squares <= _NEARLY * best]
    return near[:_MOST]


def _again(workers: Workers, brief: Sequence[Trial], quick: Sequence[Trial]) -> list[Trial]:
    """Trials of a few steps, those that come near the best one tried further."""
    best = min((trial.squares for trial in quick), default=np.inf)
    near = [trial for trial in brief if trial.squares < _WORTH * best]
    further = (
        workers.run([replace(t.task, values=t.values, how="quick", far=False) for t in near]) if near else []
    )
    return [*further, *(trial for trial in brief if trial not in near)]


def _guessed(before: Trial, one: Looked, anchor: Mapping[str, float]) -> Trial:
    """What the first look says of a candidate, as a trial."""
    task = Task(before.task.effects, (one.effect,), {**before.values, **one.values}, "quick", anchor=anchor)
    return Trial(task, task.values, one.gap**2 * before.count, before.count, free=before.free)


def promising(workers: Workers, before: Trial, quick: Sequence[Trial]) -> list[Trial]:
    """Those that may win: near the best one, and better than nothing on the few lines that were looked at."""
    anchor = anchor_of(before)
    [present] = workers.run([Task(before.task.effects, (), before.values, "quick", anchor=anchor)])
    if not quick:
        return []
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
