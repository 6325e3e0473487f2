"""Gauss-Newton with exact gradients and bounds, damped by how well the last step was foreseen.

Damping follows Nielsen (Damping parameter in Marquardt's method, IMM-REP-1999-05, eq. 2.4).  A step is the
least of the damped quadratic model within the bounds and a distance.  A trust region that is rounded off
towards the bounds (Branch, Coleman and Li 1999) creeps where most of the residual is noise: 30 to 400
evaluations for what takes 10 to 20 here.

Where the objective tells how residuals bend along a step, the step is also tried with what follows that bend
(geodesic acceleration, Transtrum and Sethna, arXiv:1201.5885): in the narrow, bent valleys of errors
that compensate for each other it takes a third as many steps.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.bounded import bounded_step
from identify.fitting.optimizers.base import Optimizer, Outcome, Search

_FARTHEST = 1.0
"""How far a step goes along each unknown: by e for what is fitted on a logarithmic scale, beyond which FRFs
are nowhere near what their derivatives say.
"""
_FIRST, _LEAST, _MOST = 1e-2, 1e-12, 1e12
"""Damping over the curvature along each unknown."""
_STILL = 1e-10
"""A step along every unknown, on the scale of the search, after which nothing has moved: where data are
matched exactly, squares fall by a part of themselves for ever.
"""
_COARSE = 1e-2
"""Tolerance at costs that the search calls far: what is missing moves the minimum by far more."""


class GaussNewton(Optimizer):
    """Minimises the sum of squared residuals of the cost; steps are damped as in Levenberg-Marquardt, so it
    never moves uphill.
    """

    kind: Literal["gauss-newton"] = "gauss-newton"
    evaluations: int = Field(
        400, ge=1, description="budget of evaluations, per start; a step takes two or three"
    )
    tolerance: float = Field(
        1e-10, gt=0, description="relative change of the sum of squares below which it is done"
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
        tolerance = self.tolerance
        while damping < _MOST and product[-1, -1] > 0:
            if tried >= self.evaluations:
                return Outcome(False, f"the budget of {self.evaluations} evaluations is spent")
            tried += 1
            tolerance = max(self.tolerance, _COARSE) if cost > search.far else self.tolerance
            curvature, slope = product[:-1, :-1], product[:-1, -1]
            scale = _steepest(search, scale, curvature)
            damped = curvature + damping * np.diag(np.where(scale > 0, scale, 1.0) ** 2)
            lower, upper = np.maximum(search.lower - x, -_FARTHEST), np.minimum(search.upper - x, _FARTHEST)
            step = bounded_step(damped, -slope, lower, upper)
            foreseen = -float(step @ (2 * slope + curvature @ step)) / product[-1, -1]
            if np.abs(step).max(initial=0.0) <= _STILL:
                break
            step, costs = _followed(search, x, step, damped, (lower, upper))
            fall = 1 - (costs / cost) ** 2
            if max(fall, foreseen) < tolerance:
                break
            # After the last step nothing needs derivatives.
            there = search.product(x + step) if fall > 0 and tried < self.evaluations else product
            if fall > 0 and np.isfinite(there).all():
                search.compare(costs, (self.evaluations - tried) * (cost - costs))
                x, cost, product = x + step, costs, there
                damping = max(damping * max(1 / 3, 1 - (2 * fall / foreseen - 1) ** 3), _LEAST)
                growth = 2.0
            else:
                damping, growth = damping * growth, 2 * growth
        return Outcome(True, f"no step lowers the sum of squares by more than {tolerance:g} of itself")


def _steepest(search: Search, scale: Array, curvature: Array) -> Array:
    """The largest slopes so far along each unknown (n,); ones where errors are measured by themselves."""
    return np.ones(len(scale)) if search.scale.errors else np.maximum(scale, np.sqrt(np.diag(curvature)))


def _followed(
    search: Search, x: Array, step: Array, damped: Array, bounds: tuple[Array, Array]
) -> tuple[Array, float]:
    """The better of a step from x and the same with what follows the bend of the residuals, and its cost."""
    bend, steps = search.bend(x, step), step[None]
    if bend is not None:
        lower, upper = (bound - step for bound in bounds)
        steps = np.array([step, step + bounded_step(damped, -bend / 2, lower, upper)])
    costs = search.costs(x + steps)
    best = int(np.argmin(costs))
    return steps[best], float(costs[best])
