"""How trials are fitted where errors of what was told are stated: residuals count for little at first, so
that the errors stay near what was stated (`identify.vibration.softened`).
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.discovery.evidence import FAR
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Ended, Optimizer, Search
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.costs.of_links import LinksObjective, of_links
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.nuisance import NOTHING
from identify.vibration.problem import Problem
from identify.vibration.softened import SOFT_STAGE, SOFTNESS

LEADING, SOFT = SOFTNESS[:2], SOFTNESS[2]
"""By how much less residuals count in a first look, then on the way from there, and in quick trials: noise of
half a per cent counts as one of 50, 15 and 5 %."""
_COARSE = 1e-2
"""Relative change of a sum of squares that tells nothing of a model which is far from the data."""


def as_told(problem: Problem) -> Problem:
    """The problem without errors of what was told: its unknowns are its parameters alone."""
    told = [
        replace(m, target=replace(m.target, nuisances=None)) if isinstance(m.target, FrfTarget) else m
        for m in problem.measurements
    ]
    parameters = problem.of_effects
    return replace(problem, parameters=parameters, measurements=tuple(told), nuisances=NOTHING)


def with_no_errors(problem: Problem, values: Array) -> Array:
    """(..., unknowns): values (..., parameters) of a problem as it was told, and errors of nothing."""
    errors = np.zeros((*values.shape[:-1], len(problem.nuisances.entries)))
    return np.concatenate([values, errors], axis=-1)


def best_softly(problem: Problem, starts: Array, softness: float = SOFT) -> tuple[Array, float]:
    """The best of the starts (m, unknowns) as they are, and its cost, with residuals that count for less."""
    costs = _soft(problem, softness).costs(starts)
    return starts[int(np.argmin(costs))], float(costs.min())


def led(
    problem: Problem, start: Array, path: Sequence[float], optimizer: Optimizer = SOFT_STAGE
) -> tuple[Array, float]:
    """From start (unknowns,) along a path of residuals that count for ever more; values and last cost."""
    cost = np.inf
    for softness in path:
        start, cost = minimized(problem, start, optimizer, _soft(problem, softness))
    return start, cost


def led_by_links(
    problem: Problem, start: Array, path: Sequence[float], optimizer: Optimizer = SOFT_STAGE
) -> tuple[Array, float]:
    """The same while residuals count for so little that only errors of links show: all others at nothing."""
    targets = problem.targets()
    if not of_links(targets):
        return led(problem, start, path, optimizer)
    links = {one.name for one in problem.nuisances.entries if one.group == "link"}
    moving = [not p.nuisance or p.name in links for p in problem.parameters]
    values = np.where(moving, start, 0.0)
    # What does not move stays where its initial value is.
    every = zip(problem.parameters, values.tolist(), moving, strict=True)
    parameters = tuple(p.at(value, free=p.free and moves) for p, value, moves in every)
    held, cost = replace(problem, parameters=parameters), np.inf
    for softness in path:
        values, cost = minimized(held, values, optimizer, LinksObjective(targets, softness))
    return values, cost


def likely(problem: Problem, start: Array, optimizer: Optimizer) -> tuple[Array, float]:
    """From start (unknowns,), errors from nothing, to the greatest likelihood; values and cost."""
    return at_likelihood(problem, led_from_nothing(problem, start)[0], optimizer)


def led_from_nothing(problem: Problem, start: Array) -> tuple[Array, float]:
    """From start (unknowns,), errors from nothing, along the whole path; values and last cost."""
    values = start.copy()
    values[problem.size :] = 0.0
    return led(problem, values, SOFTNESS)


def on_to_likelihood(problem: Problem, start: Array, optimizer: Optimizer) -> tuple[Array, float]:
    """From where residuals counted for little, start (unknowns,), with the errors there."""
    return at_likelihood(problem, led(problem, start, SOFTNESS[2:])[0], optimizer)


def at_likelihood(problem: Problem, start: Array, optimizer: Optimizer) -> tuple[Array, float]:
    """From start (unknowns,), with the errors there, which are near; values and cost.

    Coarsely while the model is far from the data, where errors creep on to make up for what it lacks.
    """
    objective = FrfLeastSquares().objective(problem.targets())
    if float(objective.costs(start[None])[0]) > FAR:
        coarse = optimizer.model_copy(update={"tolerance": _COARSE})
        start, cost = minimized(problem, start, coarse, objective)
        if cost > FAR:
            return start, cost
    return minimized(problem, start, optimizer, objective)


def minimized(
    problem: Problem, start: Array, optimizer: Optimizer, objective: Objective
) -> tuple[Array, float]:
    """From start (unknowns,): values and cost."""
    scale = Scale(problem.parameters)
    search = Search(objective, scale, 10 * optimizer.evaluations)
    with contextlib.suppress(Ended):  # the budget is spent: what was found counts
        optimizer.minimize(search, scale.to_x(start), np.random.default_rng(0))
    if search.best_x is None:
        return start, float("inf")
    return scale.to_values(search.best_x), search.best_cost


def _soft(problem: Problem, softness: float) -> PosteriorObjective:
    return PosteriorObjective(FrfLeastSquares(), problem.targets(), softness)
