"""Genetic algorithm, by pymoo: tournament selection, simulated binary crossover, polynomial mutation (Kobe
uses one, section 4.1).
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pymoo.algorithms.soo.nonconvex.ga import GA

from identify.fitting.optimizers.base import Outcome, Search
from identify.fitting.optimizers.population import PopulationOptimizer, drive


class GeneticAlgorithm(PopulationOptimizer):
    """Real-coded genetic algorithm; it stops only at its budget or the target cost."""

    ENDS_AT_BUDGET: ClassVar[bool] = True
    kind: Literal["genetic-algorithm"] = "genetic-algorithm"
    population: int = Field(100, ge=4, description="candidates per generation")

    def minimize(self, search: Search, start: NDArray[np.float64], rng: np.random.Generator) -> Outcome:
        """Search from a population around the start."""
        return drive(
            GA(pop_size=self.population, sampling=self.first_population(search, start, rng)), search, rng
        )
