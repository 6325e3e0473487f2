"""Particle swarm (Kennedy and Eberhart 1995), by pyswarms, as in the fast-chirp work.

pyswarms draws from NumPy's global generator and configures logging on import, so both are guarded around it.
"""

from __future__ import annotations

import logging.config
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal
from unittest import mock

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.fitting.optimizers.base import Outcome, Search
from identify.fitting.optimizers.population import WORST, PopulationOptimizer, global_generator


class ParticleSwarm(PopulationOptimizer):
    """Global-best swarm with constriction coefficients (Clerc and Kennedy 2002); it stops at its budget or
    when it has stalled.
    """

    kind: Literal["particle-swarm"] = "particle-swarm"
    inertia: float = Field(0.729, gt=0, lt=1, description="share of its velocity that a particle keeps")
    cognitive: float = Field(1.494, ge=0, description="pull towards its own best point")
    social: float = Field(1.494, ge=0, description="pull towards the swarm's best point")
    patience: int = Field(
        60, ge=1, description="iterations with a relative gain of less than 1e-9 after which it stops"
    )

    def minimize(self, search: Search, start: Array, rng: np.random.Generator) -> Outcome:
        """Search from a swarm around the start; particles stay at the bounds they hit."""

        def costs(x: Array) -> Array:
            return np.nan_to_num(search.costs(np.clip(x, search.lower, search.upper)), posinf=WORST)

        with _quiet(), global_generator(rng):
            from pyswarms.single import GlobalBestPSO  # noqa: PLC0415  importing it configures logging

            swarm = GlobalBestPSO(
                self.population,
                len(start),
                {"c1": self.cognitive, "c2": self.social, "w": self.inertia},
                bounds=(search.lower - 1e-9, search.upper + 1e-9),
                bh_strategy="nearest",
                ftol=1e-9,
                ftol_iter=self.patience,
                init_pos=self.first_population(search, start, rng),
            )
            swarm.optimize(costs, self.evaluations // self.population + 1, verbose=False)
        return Outcome(True, f"the swarm gained nothing for {self.patience} iterations")


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence pyswarms and keep it from touching the logging of the process."""
    disabled = logging.root.manager.disable
    try:
        with mock.patch("logging.config.dictConfig"):
            logging.disable(logging.CRITICAL)
            yield
    finally:
        logging.disable(disabled)
