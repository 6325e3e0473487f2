"""Covariance matrix adaptation evolution strategy (Hansen and Ostermeier 2001), by pymoo."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES

from identify.fitting.optimizers.base import Outcome, Search
from identify.fitting.optimizers.population import PopulationOptimizer, drive


class CmaEs(PopulationOptimizer):
    """Learns the shape of the valley; the first step size follows from `spread`."""

    kind: Literal["cma-es"] = "cma-es"
    population: int = Field(20, ge=4, description="candidates per generation")
    restarts: int = Field(0, ge=0, description="restarts with a doubled population when it has stalled")

    def minimize(self, search: Search, start: NDArray[np.float64], rng: np.random.Generator) -> Outcome:
        """Search from the start; it stops by itself when step or progress vanish."""
        span = float(np.mean(search.upper - search.lower))
        first = np.clip(start, search.lower, search.upper)
        sigma = min(0.3, np.log(self.spread) / 2 / span)
        return drive(
            CMAES(x0=first, sigma=sigma, pop_size=self.population, restarts=self.restarts), search, rng
        )
