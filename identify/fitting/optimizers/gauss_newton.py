"""Gauss-Newton with exact gradients and bounds, damped by how well the last step was foreseen.

Damping follows Nielsen (Damping parameter in Marquardt's method, IMM-REP-1999-05, eq. 2.4).  A step is the
least of the damped quadratic model within the bounds and a distance, what meets one of these being held there
and the rest solved again.  A trust region that is rounded off towards the bounds (Branch, Coleman and Li
1999) creeps where most of the residual is noise: 30 to 400 evaluations for what takes 10 to 20 here.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.fitting.optimizers.base import Optimizer, Outcome, Search

_FARTHEST = 1.0
"""How far a step goes along each unknown: by e for what is fitted on a logarithmic scale, beyond which FRFs
are nowhere near what their derivatives say.
"""
_FIRST, _LEAST, _MOST = 1e-2, 1e-12, 1e12
"""Damping over the curvature along each unknown."""


class GaussNewton(Optimizer):
    """Minimises the sum of squared residuals of the cost; steps are damped as in Levenberg-Marquardt, so it
    never moves uphill.
    """

    kind: Literal["gauss-newton"] = "gauss-newton"
    evaluations: int = Field(400, ge=1, description="budget of evaluations, per start; a step takes two")
    tolerance: float = Field(
        1e-10, gt=0, description="relative change of the sum of squares, or of x, below which it is done"
    )

    def minimize(self, search: Search, start: Array, rng: np.random.Generator) -> Outcome:
        """Needs the product of the cost's residuals; draws nothing from rng.

        Where nuisances are among the parameters, steps are measured in their standard deviations: the data
        may know far less of some of them than what was stated.
        """
        x = np.clip(start, search.lower, search.upper)
        cost, product = float(search.costs(x[None])[0]), search.product(x)
        if not np.isfinite(product).all():
            return Outcome(False, "the model has no solution at the start")
        scale, damping, growth, tried = np.zeros(len(x)), _FIRST, 2.0, 1
        while damping < _MOST and product[-1, -1] > 0:
            if tried >= self.evaluations:
                return Outcome(False, f"the budget of {self.evaluations} evaluations is spent")
            tried += 1
            curvature, slope = product[:-1, :-1], product[:-1, -1]
            scale = np.ones(len(x)) if search.scale.errors else np.maximum(scale, np.sqrt(np.diag(curvature)))
            damped = curvature + damping * np.diag(np.where(scale > 0, scale, 1.0) ** 2)
            lower, upper = np.maximum(search.lower - x, -_FARTHEST), np.minimum(search.upper - x, _FARTHEST)
            step = _within(damped, slope, lower, upper)
            foreseen = -float(step @ (2 * slope + curvature @ step)) / product[-1, -1]
            if np.linalg.norm(step) <= self.tolerance * np.linalg.norm(x):
                break
            if foreseen <= 0:  # what is held at bounds, one after the other, may be the wrong of them
                damping, growth = damping * growth, 2 * growth
                continue
            costs = float(search.costs((x + step)[None])[0])
            fall = 1 - (costs / cost) ** 2
            there = search.product(x + step) if fall > 0 else product
            if fall > 0 and np.isfinite(there).all():
                x, cost, product = x + step, costs, there
                damping = max(damping * max(1 / 3, 1 - (2 * fall / foreseen - 1) ** 3), _LEAST)
                growth = 2.0
            else:
                fall, damping, growth = 0.0, damping * growth, 2 * growth
            if max(fall, foreseen) < self.tolerance:
                break
        return Outcome(True, f"no step lowers the sum of squares by more than {self.tolerance:g} of itself")


def _within(curvature: Array, slope: Array, lower: Array, upper: Array) -> Array:
    """The step (n,) that minimises slope' s + s' curvature s / 2 between bounds (n,) around zero, found by
    holding what would leave them.
    """
    step, free = np.zeros(len(slope)), np.ones(len(slope), dtype=bool)
    size = np.sqrt(np.diag(curvature))
    while free.any():
        pull = slope[free] + curvature[np.ix_(free, ~free)] @ step[~free]
        scaled = curvature[np.ix_(free, free)] / np.outer(size[free], size[free])
        step[free] = -np.linalg.solve(scaled, pull / size[free]) / size[free]
        beyond = free & ((step < lower) | (step > upper))
        if not beyond.any():
            break
        step[beyond] = np.clip(step, lower, upper)[beyond]
        free &= ~beyond
    return step
