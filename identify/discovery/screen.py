"""First looks at candidates, cheaply: what gets further than a glance, and further than a few steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.parameters import Scale
from identify.core.thresholds import MATERIAL, QUIET
from identify.discovery.evidence import (
    CLOSED,
    EvidenceCriterion,
    clearly_nearer,
    closed,
    nearly_closed,
    removed,
)
from identify.discovery.places.job import Known
from identify.discovery.places.look import Looked, candidates_at, look, unknown_laws
from identify.discovery.places.screen import PlaceFit
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.refit_softly import thorough_softly
from identify.discovery.screen_softly import screened_softly
from identify.discovery.task import Attempt, Task, Trial, near_enough, once, solved, squares_of
from identify.discovery.workers import Workers, further
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.springs import Springs
from identify.vibration.problem import Problem, with_effects

_REFITTED, _MOST, _VARIED, _WORTH = 8, 4, 2, 4.0
"""How many candidates are refitted after the first look; get further than quick trials; and of those, are
tried in their other variants; how many times the best one's squares a candidate may leave after a few steps
and still be refitted."""
_WITHIN, _PROMISED = 2.0, 0.75
"""How many times the gap above noise that the best trial leaves, and which share of the present one, a linear
step from where the fits of its places ended must come down to for an effect whose steps may have gone astray
there to be tried: a fit that has settled far above promises nothing any more."""
_MOSTLY, _MANY = 0.8, 4
"""Which part of the gap above noise must be explained for variants with many more parameters than the best
candidate to be tried on all lines; how many more are not many."""
_AT_BOUND = 1e-3
"""Share of the way between its bounds within which a parameter is at one of them."""
_UNEXPLAINED, _EXPLAINED, _LAWLESS = 2.0, 0.1, 0.03
"""How many times the gap above noise that the best place leaves the best effect must leave for a law that no
effect has to be tried there; which gap above noise counts as none for an effect that came as far as its
place, and which for such a law, that spring and damper come near."""
_LINEAR, _FAINT, _HALF = 3.0, 0.1, 0.5
"""Gap below which what is missing acts about linearly; what share of it above noise an effect must then
remove in a quick trial to be worth a thorough one; which share makes a start near enough."""
_LEAST_INFLATION = 5.0
"""The least that correlation of residuals has been seen to count for."""


def attempt(before: Trial, trial: Trial) -> Attempt:
    """A trial of one more effect."""
    return Attempt(trial.task.new[0], trial, trial.free - before.free)


def screened(
    workers: Workers, problem: Problem, found: Sequence[Effect], before: Trial, story: Story
) -> tuple[list[PlaceFit], list[Trial]]:
    """Places and candidates, best first: those at places that explain the gap, by the law that they say, the
    best of them refitted quickly; then the others that have been looked at.

    Where the gap is closed and no place would make it smaller by more than noise models may be wrong by, no
    places and no candidates at them.
    """
    one = story.one_more()
    if workers.with_errors:
        return [], screened_softly(workers, problem, found, before, one)
    anchor, known = anchor_of(before), before.task.effects
    linear = [effect for effect in known if not effect.of_amplitude]
    model = with_effects(problem, linear, before.values)

    # Before the gap is closed anything counts: a linear step does not see what turns as a joint does.
    least = MATERIAL if closed(before) else -np.inf
    asked = Known(known, off_bounds(problem, linear, before), anchor)
    places, looked = look(workers, model, asked, found, one, least)
    if not places:
        left = _without_place(problem, found)
        return [], workers.run([Task(known, (e,), before.values, anchor=anchor) for e in left], one)
    added = known[len(problem.file.study.effects) :]
    return places, _refitted(workers, model, asked, found, (before, added), (places, looked), one)


def _refitted(
    workers: Workers,
    model: Problem,
    asked: Known,
    found: Sequence[Effect],
    present: tuple[Trial, Sequence[Effect]],
    look_at: tuple[Sequence[PlaceFit], Sequence[Looked]],
    one: Callable[[], None],
) -> list[Trial]:
    """What a look at places leaves of the candidates, best first; model has the known linear effects, present
    is the model that they are added to and what was added to that.
    """
    (before, added), (places, looked), known, anchor = present, look_at, asked.effects, asked.anchor

    def tried(ones: Sequence[Looked], how: Literal["quick", "brief"]) -> list[Trial]:
        tasks = [
            Task(known, (o.effect,), {**before.values, **o.values}, how, before.gap > QUIET, anchor)
            for o in ones
        ]
        return workers.run(tasks, one)

    placed = [o for o in looked if not np.isnan(o.gap) and not o.effect.of_amplitude]
    quick = tried(placed[:_REFITTED], "quick")
    quick += tried(_simpler(model, placed[_REFITTED:], places, quick), "quick")
    # A dynamic stiffness per level shows where friction acts, not how strong it is: the impact does.
    others = [o for o in looked if np.isnan(o.gap) and not o.effect.of_amplitude]
    brief = [*_simulated(workers, found, before, anchor, one), *tried(others, "brief")]
    reached = min((trial.gap for trial in (*quick, *brief)), default=np.inf)
    if reached > QUIET or nearly_closed(before):
        arrived = _arrived(model, quick, places)
        seen = [*(o for o in placed[:_REFITTED] if o.effect in arrived), *others]
        seen += [Looked(effect, np.nan) for effect in found if effect.of_amplitude]
        left = _not_seen(found, seen)
        # What is faint hides at many places, which their fits put in any order.
        brief += tried(
            left if nearly_closed(before) else _astray(model, left, places, before, reached), "brief"
        )
    quick += _again(workers, brief, quick)
    if not anchor and _lawless(places, quick):
        laws = tried(candidates_at(workers, model, asked, places, unknown_laws(places), one), "quick")
        laws = clearly_nearer(laws, min((trial.gap for trial in quick), default=np.inf))
        quick += [*laws, *workers.run(in_place_of_springs(model, laws, added), one)]
    rest = [_guessed(before, o, anchor) for o in placed[_REFITTED:]]
    return [*once(likeliest_first(quick)), *sorted(rest, key=squares_of)]


def _lawless(places: Sequence[PlaceFit], quick: Sequence[Trial]) -> bool:
    """Whether the best place explains far more than any effect does, so that a law that none has may act."""
    best = min((trial.gap for trial in quick), default=np.inf)
    return bool(places) and best - 1 > _UNEXPLAINED * max(places[0].fit.gap - 1, _LAWLESS)


def likeliest_first(trials: Sequence[Trial]) -> list[Trial]:
    """By evidence and not by squares alone, or three resonators and a body crowd out what does the same with
    one parameter.
    """
    best = min((trial.gap for trial in trials), default=np.inf)
    return sorted(trials, key=EvidenceCriterion(_LEAST_INFLATION * best**2).score)


def in_place_of_springs(model: Problem, laws: Sequence[Trial], added: Sequence[Effect]) -> list[Task]:
    """Laws beside springs and dampers that an added effect has brought, in place of that effect: it may have
    stood for the law, also on axes that do not give way.
    """
    tasks = []
    for trial in laws:
        [law] = trial.task.new
        if not isinstance(law, MeasuredImpedance) or law.released:
            continue
        for effect in added:
            if isinstance(effect, Springs) and set(law.at) <= set(effect.free_coordinates(model.robot)):
                known = tuple(other for other in trial.task.known if other != effect)
                whole = law.model_copy(update={"released": True})
                tasks.append(replace(trial.task, known=known, new=(whole,), values=trial.values))
    return tasks


def _simulated(
    workers: Workers,
    found: Sequence[Effect],
    before: Trial,
    anchor: Mapping[str, float],
    one: Callable[[], None],
) -> list[Trial]:
    """Effects that depend on amplitude, briefly; from far away too, which takes three times as long, only
    where none explains half of the gap.
    """
    effects = [effect for effect in found if effect.of_amplitude]
    tasks = [Task(before.task.effects, (e,), before.values, "brief", anchor=anchor) for e in effects]
    near = workers.run(tasks, one)
    best = min((trial.gap for trial in near), default=np.inf)
    if before.gap < _LINEAR or removed(before.gap, best) > _HALF:
        return near
    return workers.run([replace(task, far=True) for task in tasks], one)


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


def _simpler(
    problem: Problem, left: Sequence[Looked], places: Sequence[PlaceFit], quick: Sequence[Trial]
) -> list[Looked]:
    """Of those that a first look put behind, effects with fewer parameters than the best one whose place
    explains about as much as it does: what such an effect would leave by its law is judged on a line from
    where the fit of its place ended, and a place with a spring beside it can end far from there.
    """
    best = min(quick, key=squares_of, default=None)
    if best is None:
        return []
    most = _UNEXPLAINED * max(best.gap - 1, _EXPLAINED)
    alike = [
        one
        for one in left
        if min((fit.gap for fit in _fits_of(problem, one.effect, places)), default=np.inf) - 1 <= most
    ]
    sizes = sorted((_size(problem, one.effect), number) for number, one in enumerate(alike))
    return [alike[n] for size, n in sizes if size < _size(problem, best.task.new[0])][:_REFITTED]


def _size(problem: Problem, effect: Effect) -> float:
    """Number of free parameters that an effect would bring; infinite where it cannot be beside what is there,
    as a second spring on a link.
    """
    try:
        beside = with_effects(problem, (*problem.file.study.effects, effect), {})
    except (InputError, InputErrors):
        return np.inf
    return sum(p.free for p in beside.parameters) - sum(p.free for p in problem.parameters)


def _astray(
    model: Problem, unseen: Sequence[Looked], places: Sequence[PlaceFit], before: Trial, reached: float
) -> list[Looked]:
    """Those that may do far better than their places did, by what a linear step from there would leave; near
    the data few of them.
    """
    left = min(_WITHIN * (reached - 1), _PROMISED * (before.gap - 1))
    order = sorted((_foreseen(model, one.effect, places), n) for n, one in enumerate(unseen))
    found = [unseen[n] for gap, n in order if gap - 1 <= left]
    return found[:_REFITTED] if before.gap < _LINEAR else found


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


def _again(workers: Workers, brief: Sequence[Trial], quick: Sequence[Trial]) -> list[Trial]:
    """Trials of a few steps, the best of those that come near the best one tried further."""
    best = min((trial.squares for trial in quick), default=np.inf)
    near = sorted((t for t in brief if t.squares < _WORTH * best), key=squares_of)[:_REFITTED]
    return [*further(workers, near, "quick"), *(trial for trial in brief if trial not in near)]


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
    if before.gap < _LINEAR and removed(present.gap, best.gap) < _FAINT:
        return []
    criterion = EvidenceCriterion(_LEAST_INFLATION * best.gap**2)
    most = _MOST // 2 if anchor else _MOST  # simulated ones take long
    near = [t for t in near_enough(quick[:most], best.gap) if criterion.log_odds(present, t) > 0]
    return near or [best]


def thorough(workers: Workers, trials: Sequence[Trial], present: float = np.inf) -> list[list[Trial]]:
    """Each promising candidate on all lines, the best of them in their other variants too; those with a
    solution.  present: the gap of the present model.

    Where none of them explains most of that, something else is missing beside it, and many more parameters in
    a variant would stand for that.
    """
    if workers.with_errors:
        groups = thorough_softly(workers, trials, present)
        return [[one for one in group if solved(one)] for group in groups]
    ends = workers.run([Task(t.task.known, t.task.new, t.values, "thorough") for t in trials])
    varied = [
        Task(end.task.known, (one,), end.values)
        for trial, end in list(zip(trials, ends, strict=True))[:_VARIED]
        for one in end.task.new[0].variants()
        if not trial.task.anchor
    ]
    best = min(ends, key=squares_of, default=None)
    if best is None:
        return []
    most = np.inf if removed(present, best.gap) >= _MOSTLY else best.free + _MANY
    near = clearly_nearer(near_enough(workers.run(varied), best.gap), best.gap)
    others = further(workers, [trial for trial in near if trial.free <= most], "thorough")
    return [
        [t for t in (end, *(t for t in others if t.task.new[0] in end.task.new[0].variants())) if solved(t)]
        for end in ends
    ]


def anchor_of(before: Trial) -> Mapping[str, float]:
    """The values of a model that depends on amplitude; nothing for a linear one."""
    return before.values if any(effect.of_amplitude for effect in before.task.effects) else {}
