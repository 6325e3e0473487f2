"""Differential evolution (Storn and Price 1997), by pymoo."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pymoo.algorithms.soo.nonconvex.de import DE

from identify.fitting.optimizers.base import Outcome, Search
from identify.fitting.optimizers.population import PopulationOptimizer, drive


class DifferentialEvolution(PopulationOptimizer):
    """Mutation by scaled differences of candidates; few settings, hard to lead astray."""

    ENDS_AT_BUDGET: ClassVar[bool] = True
    kind: Literal["differential-evolution"] = "differential-evolution"
    variant: Literal["DE/rand/1/bin", "DE/best/1/bin"] = Field(
        "DE/best/1/bin", description="whether differences are added to any or the best"
    )
    crossover: float = Field(
        0.9, ge=0, le=1, description="probability that a coordinate comes from the mutant"
    )

    def minimize(self, search: Search, start: NDArray[np.float64], rng: np.random.Generator) -> Outcome:
        """Search from a population around the start."""
        first = self.first_population(search, start, rng)
        return drive(
            DE(pop_size=self.population, sampling=first, variant=self.variant, CR=self.crossover), search, rng
        )
