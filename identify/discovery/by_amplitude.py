"""What depends on the strength of the impacts: every refit simulates them, so that only what can act where a
torque would explain most is tried.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.core.plugin import left_out_where_broken
from identify.core.thresholds import CLOSED, QUIET
from identify.discovery.amplitude import level_gap, torque_gaps
from identify.discovery.evidence import above_noise, closed
from identify.discovery.state import Added, State, convincing
from identify.discovery.task import Task
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import EFFECTS, Effect
from identify.vibration.nuisances.settings import IMPACTS_ALONE
from identify.vibration.problem import Problem, with_effects, with_uncertainty

_NEAREST, _WHOLE = 2, 2
"""Coordinates at which effects are tried; how many of these are taken to all lines."""


def by_amplitude(workers: Workers, state: State, story: Story) -> State:
    """With an effect that depends on amplitude, where impacts of different strength disagree and the data ask
    for it.
    """
    if closed(state.model) or any(effect.of_amplitude for effect in state.effects):
        return state
    if not level_gap(state.problem) > QUIET:
        return state
    effects = list(_candidates(state))
    quick = workers.run([Task(state.effects, (one,), state.model.values) for one in effects])
    quick = sorted((one for one in quick if np.isfinite(one.squares)), key=lambda one: one.squares)
    found = convincing(workers, state, quick, _WHOLE)
    if found is None:
        return state
    model, gain = found
    state = State(state.problem, model, (*state.added, Added(model.task.new[0], gain)))
    story.say(f"With {model.task.new[0].sentence()}: gap {model.gap:.2f}.")
    return _with_impacts(workers, state) if above_noise(model.gap) else state


def _candidates(state: State) -> Iterator[Effect]:
    """At the coordinates where any torque would explain most."""
    problem = with_effects(state.problem, state.effects, state.model.values)
    gaps = torque_gaps(problem.targets().frf, problem.initial)
    every = list(_of_amplitude(problem))
    there = {name for effect in every for name in effect.coordinates(problem.robot)}
    near = [name for name in sorted(gaps, key=lambda one: gaps[one]) if name in there]
    for name in near[:_NEAREST]:
        yield from (effect for effect in every if name in effect.coordinates(problem.robot))


def _of_amplitude(problem: Problem) -> Iterator[Effect]:
    for kind in EFFECTS.usable().values():
        if kind.of_amplitude:
            with left_out_where_broken():
                yield from kind.instances(problem.robot, problem.points)


def _with_impacts(workers: Workers, state: State) -> State:
    """With strengths and duration of the impacts fitted along, where nothing else was said to be uncertain
    and that closes the gap: an effect of amplitude acts by how strong they were.
    """
    if state.problem.file.study.uncertainty is not None:
        return state
    problem = with_uncertainty(state.problem, IMPACTS_ALONE)
    workers.turn_to(problem)
    [model] = workers.run([Task(state.effects, (), state.model.values, whole=True)])
    if model.gap < CLOSED:
        return State(problem, model, state.added)
    workers.turn_to(state.problem)
    return state
