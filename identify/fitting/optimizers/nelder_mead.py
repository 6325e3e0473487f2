"""Nelder-Mead simplex search (Computer Journal 7, 1965), by scipy; UMONS uses it on eigenfrequencies.

A simplex may collapse where the cost has kinks, so the search starts again from its best point with a new,
smaller or larger simplex until a restart gains nothing.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy
from pydantic import Field

from identify.core.arrays import Array
from identify.fitting.optimizers.base import Optimizer, Outcome, Search


class NelderMead(Optimizer):
    """Derivative-free local search; good for few parameters and costs with kinks."""

    kind: Literal["nelder-mead"] = "nelder-mead"
    evaluations: int = Field(5000, ge=1, description="budget of cost evaluations, per start")
    size: float = Field(
        0.3, gt=0, description="edge of the first simplex on the search scale (0.3: 35 % on a log scale)"
    )
    tolerance: float = Field(
        1e-6, gt=0, description="spread of cost and x below which it is done, and least gain of a restart"
    )

    def minimize(self, search: Search, start: Array, rng: np.random.Generator) -> Outcome:
        """Restarts with simplices of random orientation drawn from rng."""
        best, size = np.clip(start, search.lower, search.upper), self.size
        while True:
            before = search.best_cost
            result = scipy.optimize.minimize(
                lambda x: float(search.costs(np.clip(x, search.lower, search.upper)[None])[0]),
                best,
                method="Nelder-Mead",
                bounds=list(zip(search.lower, search.upper, strict=True)),
                options={
                    "initial_simplex": _simplex(best, size, search, rng),
                    "xatol": self.tolerance,
                    "fatol": self.tolerance,
                    "maxfev": self.evaluations,
                    "adaptive": len(best) > 5,
                },
            )
            best = search.best_x if search.best_x is not None else best
            if before - search.best_cost <= self.tolerance * max(1.0, abs(search.best_cost)):
                return Outcome(bool(result.success), "a restart from the best point gained nothing")
            size = self.size * float(rng.uniform(0.2, 1.0))


def _simplex(centre: Array, size: float, search: Search, rng: np.random.Generator) -> Array:
    """centre and one further corner per coordinate, in random orthogonal directions, inside the bounds."""
    directions, _ = np.linalg.qr(rng.normal(size=(len(centre), len(centre))))
    return np.clip(np.vstack([centre, centre + size * directions]), search.lower, search.upper)
