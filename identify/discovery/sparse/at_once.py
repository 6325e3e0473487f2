"""What is missing, found at once: the dense fits, and what they name refitted exactly on all lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from identify.core.text import listed
from identify.core.thresholds import MATERIAL
from identify.discovery.decimated import decimated, without_amplitude
from identify.discovery.evidence import closed
from identify.discovery.sparse.evidence import believable
from identify.discovery.sparse.names import Named
from identify.discovery.sparse.search import explain, promising
from identify.discovery.state import Added, State
from identify.discovery.task import FEW_STEPS, Task
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect, parse_effect
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem, uncertain_as, with_effects, with_uncertainty
from identify.vibration.uncertainty import gap


@dataclass(frozen=True)
class _Told:
    """What the dense fits say, as JSON has it: effects with values and evidence; values of all else;
    whether the forms of links are uncertain.
    """

    named: Sequence[Mapping[str, Any]]
    values: Mapping[str, float]
    bending: bool


def at_once(workers: Workers, state: State, story: Story) -> State:
    """With what a dense model names beside the state, refitted; the state itself where nothing is open, and
    no nuisance parameter is beyond belief, or where nothing has evidence.
    """
    if closed(state.model) and believable(state.problem, state.model.values) and not _pays(workers, state):
        return state
    told = _Told(*workers.recall(state.key("at once"), lambda: _explained(state, story), "dense fits"))
    named = [Named(parse_effect(one["effect"]), one["values"], one["odds"]) for one in told.named]
    if not named:
        return state
    problem = state.problem
    if told.bending and problem.file.study.uncertainty is None:
        problem = with_uncertainty(problem, FORMS_ALONE)
        workers.turn_to(problem)
    own = {name: value for one in named for name, value in one.values.items()}
    new = tuple(one.effect for one in named)
    values = _within(problem, (*state.effects, *new), {**state.model.values, **told.values, **own})
    steps = FEW_STEPS if story.late else Task.steps
    [model] = workers.run([Task(state.effects, new, values, whole=True, steps=steps)])
    story.say(f"With {listed([one.sentence() for one in new])}, refitted on all lines: gap {model.gap:.2f}.")
    added = (Added(one.effect, one.evidence) for one in named)
    return State(problem, model, (*added, *state.added))


def _pays(workers: Workers, state: State) -> bool:
    """Whether something pays beside a model that leaves nothing open by its gap, but is above noise by more
    than estimators get wrong: a resonator of few lines hides in it.
    """
    if state.model.gap < 1 + MATERIAL:
        return False
    values = state.model.values
    return bool(workers.recall(state.key("pays"), lambda: promising(_thin(state), values), "dense fits"))


def _explained(state: State, story: Story) -> list[Any]:
    """What the dense fits say, as JSON has it."""
    unseen = partial(_unseen, state.problem, state) if state.problem.validated else None
    found = explain(_thin(state), story, unseen)
    named = [
        {
            "effect": one.effect.model_dump(mode="json"),
            "values": dict(one.values),
            "odds": one.evidence,
        }
        for one in found.named
    ]
    bending = found.problem.file.study.uncertainty == FORMS_ALONE
    return [named, found.values, bending and any(one.effect.has_form for one in found.named)]


def _unseen(
    study: Problem, state: State, found: Problem, effects: Sequence[Effect], values: Mapping[str, float]
) -> float:
    """The gap that effects and values leave on the study's data for validation, with what was found to be
    uncertain.
    """
    study = uncertain_as(study, found)
    model = with_effects(study, [*state.effects, *effects], {**state.model.values, **values})
    return gap(model.targets("validate"), model.initial)


def _thin(state: State) -> Problem:
    """The problem on few lines and without what depends on amplitude, from the study's own values: those of
    the present model have compensated for what is missing.
    """
    thin = without_amplitude(decimated(state.problem), state.effects, state.model.values)
    return with_effects(thin, thin.file.study.effects, state.problem.starts)


def _within(problem: Problem, effects: Sequence[Effect], values: dict[str, float]) -> dict[str, float]:
    """The values within the bounds of the effects' parameters."""
    found = dict(values)
    for p in with_effects(problem, effects, {}).parameters:
        if p.name in found and not p.nuisance:
            found[p.name] = min(max(found[p.name], p.lower), p.upper)
    return found
