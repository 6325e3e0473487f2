"""Gauss-Newton with exact gradients and bounds: scipy's trust-region reflective least squares (Branch,
Coleman and Li 1999).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy
from pydantic import Field

from identify.core.arrays import Array
from identify.fitting.optimizers.base import Optimizer, Outcome, Search


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
        """Needs the cost's residuals; draws nothing from rng.

        Where nuisances are among the parameters, steps are measured in their standard deviations: the data
        may know far less of some of them than what was stated.
        """
        last: list[tuple[Array, tuple[Array, Array]]] = []

        def at(x: Array) -> tuple[Array, Array]:
            if not last or not np.array_equal(last[0][0], x):
                last[:] = [(x.copy(), search.residuals(x))]
            return last[0][1]

        def step(intermediate_result: scipy.optimize.OptimizeResult) -> None:
            search.costs(intermediate_result.x[None])

        inside = np.clip(start, *_shrunk(search.lower, search.upper))
        residuals = at(inside)[0]
        search.costs(inside[None])
        if not np.isfinite(residuals).all():
            return Outcome(False, "the model has no solution at the start")
        result = scipy.optimize.least_squares(
            lambda x: at(x)[0],
            inside,
            lambda x: at(x)[1],
            bounds=(search.lower, search.upper),
            x_scale=np.ones(len(inside)) if search.scale.errors else "jac",
            ftol=self.tolerance,
            xtol=self.tolerance,
            gtol=1e-12,
            max_nfev=self.evaluations,
            callback=step,
        )
        search.costs(result.x[None])
        return Outcome(bool(result.success), str(result.message).replace("`", "").rstrip("."))


def _shrunk(lower: Array, upper: Array) -> tuple[Array, Array]:
    """The method starts strictly inside the bounds, where there are any."""
    margin = 1e-6 * np.where(np.isfinite(upper - lower), upper - lower, 0.0)
    return lower + margin, upper - margin
