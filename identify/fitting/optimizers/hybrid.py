"""A global search, then Gauss-Newton from its best points: for problems with many minima and costs with exact
gradients.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationInfo, field_validator

from identify.fitting.optimizers.base import Ended, Outcome, Search, parse_optimizer
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.fitting.optimizers.population import PopulationOptimizer


class Hybrid(PopulationOptimizer):
    """Alternates: a share of the budget for the global method, then Gauss-Newton from the best point, until a
    round gains nothing.
    """

    kind: Literal["hybrid"] = "hybrid"
    evaluations: int = Field(
        16_000, ge=1, description="budget of cost evaluations, per start; each round has an equal share"
    )
    rounds: int = Field(3, ge=1, description="at most this many rounds; the spread doubles in each")
    method: str = Field("differential-evolution", description="kind of the global method")

    @field_validator("method")
    @classmethod
    def _population_method(cls, kind: str, info: ValidationInfo) -> str:
        if kind == "hybrid" or not isinstance(parse_optimizer(kind), PopulationOptimizer):
            raise ValueError(f"{kind!r} is not a population method")
        return kind

    def minimize(self, search: Search, start: NDArray[np.float64], rng: np.random.Generator) -> Outcome:
        """Search from a population around the start."""
        outcome, best = Outcome(False, "the budget is spent"), start
        for number in range(self.rounds):
            before = search.best_cost
            outcome = self._round(search, best, rng, self.spread * 2**number)
            best = start if search.best_x is None else search.best_x
            if search.best_cost > before * (1 - 1e-3):
                break
        return outcome

    def _round(
        self, search: Search, start: NDArray[np.float64], rng: np.random.Generator, spread: float
    ) -> Outcome:
        optimizer = parse_optimizer({"kind": self.method, "population": self.population, "spread": spread})
        inner = search.part(max(1, self.evaluations // (self.rounds + 1)))
        try:
            optimizer.minimize(inner, start, rng)
        except Ended as end:
            if end.reached:
                raise
        found = start if inner.best_x is None else inner.best_x
        return GaussNewton().minimize(search, found, rng)
