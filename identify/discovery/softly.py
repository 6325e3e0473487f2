"""How trials are fitted where errors of what was told are stated: residuals count for little at first, so
that the errors stay near what was stated (`identify.vibration.softened`).
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Ended, Search
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.problem import Problem
from identify.vibration.softened import SOFT_STAGE, softened

_SOFT = 10.0
"""By how much less residuals count in a first look: noise of half a per cent then counts as one of 5 %."""
_BRIEF = GaussNewton(evaluations=5, tolerance=1e-2)
_LEADING = (100.0, 30.0, _SOFT)


def without_errors(problem: Problem) -> Problem:
    """The problem with errors of what was told held as they are."""
    held = tuple(replace(p, free=p.free and not p.nuisance) for p in problem.parameters)
    return replace(problem, parameters=held)


def best_softly(problem: Problem, starts: Array) -> tuple[Array, float]:
    """The best of the starts (m, unknowns) as they are, and its cost, with residuals that count for less."""
    costs = _soft(problem, _SOFT).costs(starts)
    return starts[int(np.argmin(costs))], float(costs.min())


def descend_softly(problem: Problem, start: Array, *, thorough: bool) -> Array:
    """From start (unknowns,) to the least of that cost; else a few steps towards it."""
    if not thorough:
        return minimized(problem, start, _BRIEF, _soft(problem, _SOFT))[0]
    for softness in _LEADING:
        start = minimized(problem, start, SOFT_STAGE, _soft(problem, softness))[0]
    return start


def led(problem: Problem, start: Array) -> Array:
    """A few steps from start (unknowns,) where residuals count for next to nothing, then for little."""
    for softness in _LEADING[:-1]:
        start = minimized(problem, start, _BRIEF, _soft(problem, softness))[0]
    return start


def cost_led(problem: Problem, end: Array) -> float:
    """The cost of such an end (unknowns,), where residuals count for as little as there."""
    return float(_soft(problem, _LEADING[-2]).costs(end[None])[0])


def likely(problem: Problem, start: Array, optimizer: GaussNewton) -> tuple[Array, float]:
    """From start (unknowns,), errors from nothing, to the greatest likelihood; values and cost."""
    values = start.copy()
    values[problem.size :] = 0.0
    for objective in softened(problem.targets()):
        values = minimized(problem, values, SOFT_STAGE, objective)[0]
    return minimized(problem, values, optimizer, FrfLeastSquares().objective(problem.targets()))


def minimized(
    problem: Problem, start: Array, optimizer: GaussNewton, objective: Objective
) -> tuple[Array, float]:
    """Gauss-Newton from start (unknowns,): values and cost."""
    scale = Scale(problem.parameters)
    search = Search(objective, scale, 10 * optimizer.evaluations)
    with contextlib.suppress(Ended):  # the budget is spent: what was found counts
        optimizer.minimize(search, scale.to_x(start), np.random.default_rng(0))
    if search.best_x is None:
        return start, float("inf")
    return scale.to_values(search.best_x), search.best_cost


def _soft(problem: Problem, softness: float) -> PosteriorObjective:
    return PosteriorObjective(FrfLeastSquares(), problem.targets(), softness)
