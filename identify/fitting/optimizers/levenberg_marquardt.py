"""Levenberg-Marquardt with its damping chosen by trying: where gradients cost far more than costs, and the
way is long and bent.

Each step is the best of a ladder of damped Gauss-Newton steps (Marquardt, J. SIAM 11 (1963) 431-441, who
takes the first that goes down).  Damping is the same for all unknowns, because all are of order one:
logarithms of parameters, and errors of what was told in their standard deviations.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.fitting.optimizers.base import Optimizer, Outcome, Search

_LADDER, _FURTHER = 10.0 ** np.arange(-2, 5), 10.0 ** np.arange(5, 8)
"""Dampings that are tried, and those where none of them leads down: close to a model that no more moves as
one part of it should.
"""


class LevenbergMarquardt(Optimizer):
    """Minimises the sum of squared residuals of the cost within bounds; never moves uphill."""

    kind: Literal["levenberg-marquardt"] = "levenberg-marquardt"
    evaluations: int = Field(
        1000, ge=1, description="budget of evaluations, per start; a step takes eight, or eleven"
    )
    steps: int = Field(100, ge=1, description="steps at most")
    tolerance: float = Field(
        1e-10, gt=0, description="relative fall of the sum of squares in a step below which it is done"
    )

    def minimize(self, search: Search, start: Array, rng: np.random.Generator) -> Outcome:
        """Needs the product of the cost's residuals; draws nothing from rng."""
        x = np.clip(start, search.lower, search.upper)
        cost = float(search.costs(x[None])[0])
        for _ in range(self.steps):
            product = search.product(x)
            if not np.isfinite(product).all():
                return Outcome(False, "the model has no solution at the start")
            curvature, axes = np.linalg.eigh(product[:-1, :-1])
            pull = axes.T @ product[:-1, -1]
            for ladder in (_LADDER, _FURTHER):
                damped = np.maximum(curvature, 0.0) + ladder[:, None]
                trials = np.clip(x - (pull / damped) @ axes.T, search.lower, search.upper)
                costs = search.costs(trials)
                best = int(np.argmin(costs))
                if costs[best] < cost:
                    break
            else:
                return Outcome(True, "no damped step lowers the cost")
            fall, x, cost = 1 - (costs[best] / cost) ** 2, trials[best], float(costs[best])
            if fall < self.tolerance:
                return Outcome(True, f"the sum of squares fell by less than {self.tolerance:g} of itself")
        return Outcome(False, f"{self.steps} steps are spent")
