"""How far data that were not fitted are from what a fit predicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.core.thresholds import CLOSED
from identify.fitting.optimizers.base import Search, minimized
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.fitting.uncertainty import Uncertainty
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.costs.information import information
from identify.vibration.problem import Problem
from identify.vibration.uncertainty import gap

_STEPS, _SETTLED = 8, 0.01
"""Steps at most that a prediction takes to what new data ask for; share of their count that one more would
take off, below which it has arrived."""
_JOINT = GaussNewton(evaluations=20, tolerance=1e-4)
"""How all data are fitted together: a gap is told to two digits."""


def gap_elsewhere(problem: Problem, trusted: Uncertainty, values: Array) -> float:
    """`gap` on data that were not fitted.

    Where nuisance parameters are uncertain, how far these data are from what the fit predicts, in units
    of that prediction's own uncertainty and noise together: sum r' (1 + J C J')^-1 r over the count, C the
    covariance of all unknowns.
    """
    targets = problem.targets("validate")
    if trusted.joint is None or not targets.frf or any(one.noise is None for one in targets.frf):
        return gap(targets, values)
    squares, count = predictive_squares(problem, trusted.joint.information, values)
    return float(np.sqrt(squares / count))


def predictive_squares(problem: Problem, known: Array, values: Array) -> tuple[float, int]:
    """That sum, and its count; known (u, u): information of the fit about all free unknowns, on the search
    scale.

    It is the least of r' r plus what it costs the fit to move its unknowns there.  Where the fit leaves a
    combination of them wide open, FRFs are not linear over that width: a few Gauss-Newton steps are taken.
    Nor is what the fit costs a parabola then, and stated errors go far along a valley that bends: where the
    sum is more than noise, all data are fitted together, if the fit's own are as near as noise.
    """
    scale, targets = Scale(problem.parameters), problem.targets("validate").frf
    lower, upper = scale.bounds()
    start = scale.to_x(values)

    def look(x: Array) -> tuple[float, float, Array, int]:
        found = information(targets, scale.to_values(x), scale.free)
        own, score = found.on_scale(scale.slope(x))
        gradient = score + known @ (x - start)
        step = np.asarray(np.linalg.solve(known + own, gradient), dtype=float)
        squares = float(found.product[-1, -1] + (x - start) @ known @ (x - start))
        return squares, squares - float(gradient @ step), step, found.count

    x, (squares, foreseen, step, count) = start, look(start)
    for _ in range(_STEPS):
        if squares - foreseen < _SETTLED * count:
            break
        other = np.clip(x - step, lower, upper)
        there = look(other)
        if there[0] < squares:
            x, (squares, foreseen, step, count) = other, there
        else:
            step = step / 4
    if foreseen > CLOSED**2 * count and problem.nuisances.entries and problem.targets().frf:
        foreseen = min(foreseen, _together(problem, values, scale.to_values(x)))
    return foreseen, count


def _together(problem: Problem, values: Array, start: Array) -> float:
    """By how much the sum of squares is larger than the fit's at values (unknowns,) where data that were not
    fitted are fitted along, from start (unknowns,); infinity where the fit's is more than noise.
    """
    fit, more = problem.targets(), problem.targets("validate").frf
    everything = replace(fit, frf=(*fit.frf, *more))
    one, both = (PosteriorObjective(FrfLeastSquares(), targets) for targets in (fit, everything))
    before = float(one.costs(values[None])[0])
    if before >= CLOSED:
        return np.inf
    scale = Scale(problem.parameters)
    search = Search(both, scale, 10 * _JOINT.evaluations)
    start = min((values, start), key=lambda some: float(both.costs(some[None])[0]))
    minimized(_JOINT, search, scale.to_x(start), np.random.default_rng(0))
    # A fit that had not ended gains, too.
    return max(search.best_cost**2 * both.count - before**2 * one.count, 0.0)
