"""Other forms of what was found: simpler and richer variants, the same on the links beside it, a law with
relaxation times in place of a spring, a strut in place of springs in any direction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import islice

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import CLOSED, MATERIAL
from identify.discovery.decimated import decimated
from identify.discovery.evidence import EvidenceCriterion, closed, variance_inflation
from identify.discovery.misalignment import misaligned_task
from identify.discovery.neighbours import moved, neighbours
from identify.discovery.state import Added, Rival, State, convincing, likelier
from identify.discovery.strut import strut_task
from identify.discovery.task import Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.model.effects.joint_relaxation import JointRelaxation
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.springs import Springs
from identify.vibration.problem import Problem

_LOOKED, _WHOLE = 3, 2
"""The most important effects that have other forms, which are looked at; how many of these are taken to all
lines.
"""
_STEPS = 10
"""On few lines, of the same effect in another place, all else being near where it was."""
_RIVAL = float(np.log(0.01))
"""Log odds above which something else in an effect's place is reported: a probability of 1 %."""


def in_other_forms(workers: Workers, state: State, story: Story) -> State:
    """What was found by a direction that is free along one of its own; what sits on a link on those beside
    it; and as long as something is open, in the form each that the data ask for most.
    """
    state = state if story.late else _turned(workers, state)
    while not story.late:
        better = _exchanged(workers, state, _places if closed(state.model) else _forms)
        if better is None:
            break
        fell = state.model.gap - better.model.gap >= MATERIAL
        state = _turned(workers, better)
        story.say(f"In other forms: {state.added[0].effect.sentence()}, gap {state.model.gap:.2f}.")
        if not (fell or closed(state.model)):
            break  # where much is open there is always another form, with overwhelming odds
    return state if story.late else _beside_rivals(workers, state)


def _exchanged(
    workers: Workers, state: State, others: Callable[[State, Effect], Iterator[Task]]
) -> State | None:
    """The state with the form that the data ask for most; None where they ask for none."""
    pairs = [(effect, task) for effect, tasks in _looked(state, others) for task in tasks]
    if not pairs:
        return None
    present = Task(state.effects, (), state.model.values)
    [before, *trials] = workers.run([present, *(task for _, task in pairs)], "other forms")
    criterion = EvidenceCriterion(before.gap**2)
    # On few lines of the fitted data alone these say which to refit, and not what other data say of them.
    likely = [one for _, one in _likely(criterion, before, trials)]
    found = convincing(workers, state, likely, _WHOLE)
    if found is None:
        return None
    model, gain = found
    old = next(effect for effect, task in pairs if task.new == model.task.new)
    return state.exchanged(old, model.task.new[0], model, gain)


def _looked(
    state: State, others: Callable[[State, Effect], Iterator[Task]]
) -> list[tuple[Effect, list[Task]]]:
    """The most important effects that have other forms, with these."""
    every = ((one.effect, list(others(state, one.effect))) for one in state.added)
    return list(islice((pair for pair in every if pair[1]), _LOOKED))


def _likely(
    criterion: EvidenceCriterion, before: Trial, trials: Sequence[Trial]
) -> list[tuple[float, Trial]]:
    """Those whose probability beside a model is 1 % at least, with their log odds, the likeliest first."""
    pairs = [(criterion.log_odds(before, one), one) for one in trials]
    return sorted((pair for pair in pairs if pair[0] > _RIVAL), key=lambda pair: -pair[0])


def _beside_rivals(workers: Workers, state: State) -> State:
    """With what the data cannot tell well from the most important effects, in their places."""
    criterion, added = EvidenceCriterion(variance_inflation(state.problem, state.model)), list[Added]()
    present, places = Task(state.effects, (), state.model.values), _looked(state, _places)
    for one in state.added:
        tasks = next((tasks for effect, tasks in places if effect == one.effect), [])
        [before, *trials] = workers.run([present, *tasks], "other forms") if tasks else [state.model]
        near = _likely(criterion, before, trials)
        rivals = tuple(Rival(trial.task.new[0], trial, odds) for odds, trial in near)
        added.append(replace(one, rivals=rivals))
    return replace(state, added=tuple(added))


def _forms(state: State, effect: Effect) -> Iterator[Task]:
    known, values = state.without(effect), state.model.values
    for form in (*effect.variants(), *_laws(state.problem, effect)):
        yield Task(known, (form,), {**values, **_starts(form, values)})
    yield from _places(state, effect)


def _places(state: State, effect: Effect) -> Iterator[Task]:
    """The same along other axes and on the links beside it, and what it is at its limits."""
    known, values = state.without(effect), state.model.values
    rival = CLOSED if closed(state.model) else np.inf
    for limit in effect.limits():
        yield Task(known, (limit,), values, steps=_STEPS, rival=rival)
    own = Trial(Task(known, (effect,), values), values, 0.0, 1)
    for other in neighbours(state.problem, effect):
        with suppress(InputError, InputErrors):  # where another effect has that place
            yield Task(known, (other,), moved(state.problem, own, other), steps=_STEPS, rival=rival)


def _starts(form: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """Where the branches of a law begin beside springs of known stiffness."""
    if not isinstance(form, MeasuredImpedance):
        return {}
    return form.starts_beside({name: values[f"{name}.stiffness"] for name in form.at})


def _laws(problem: Problem, effect: Effect) -> Iterator[Effect]:
    """A spring that relaxes, on all of its coordinates and on each alone."""
    if isinstance(effect, JointRelaxation):
        names = [f"joint{number}.rz" for number in effect.joints]
    elif isinstance(effect, Springs) and effect.kind in ("joint-compliance", "base-compliance"):
        names = effect.free_coordinates(problem.robot)
    else:
        return
    for at in (names, *([name] for name in names if len(names) > 1)):
        for branches in (1, 2):
            released = not isinstance(effect, JointRelaxation)
            yield MeasuredImpedance(at=at, released=released, branches=branches)


def _turned(workers: Workers, state: State) -> State:
    """With struts in place of springs in any direction, and laws about axes of their own direction, where
    the data ask for that.
    """
    for one in state.added:
        values = state.model.values
        own = Trial(
            Task(state.without(one.effect), (one.effect,), values),
            values,
            state.model.squares,
            state.model.count,
            free=state.model.free,
        )
        [task] = workers.each(_turned_task, [own])
        if task is None:
            continue
        [model] = workers.run([task])
        gain = likelier(state, model)
        if np.isfinite(model.squares) and gain > 0:
            state = state.exchanged(one.effect, model.task.new[0], model, gain)
    return state


def _turned_task(problem: Problem, trial: Trial) -> Task | None:
    """None, too, where the search for a direction fails: one effect ends no search."""
    try:
        return strut_task(decimated(problem), trial) or misaligned_task(decimated(problem), trial)
    except np.linalg.LinAlgError:
        return None
