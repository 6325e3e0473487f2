"""What all population methods share: where the first population lies, and driving a pymoo algorithm by ask
and tell.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from pydantic import Field
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination

from identify.core.arrays import Array
from identify.fitting.optimizers.base import Optimizer, Outcome, Search

WORST = 1e100
"""What a candidate without a solution costs where a library cannot take infinity."""


class PopulationOptimizer(Optimizer):
    """Settings common to all population methods."""

    evaluations: int = Field(20_000, ge=1, description="budget of cost evaluations of this stage, per start")
    population: int = Field(50, ge=4, description="candidates per generation")
    spread: float = Field(
        5.0,
        gt=1,
        description="the first population lies within this factor of the start (log) or a fifth of the range",
    )

    def first_population(self, search: Search, start: Array, rng: np.random.Generator) -> Array:
        """(population, free): the start and uniform draws around it, on the search scale, within the
        bounds.
        """
        reach = np.log(self.spread)
        draws = start + rng.uniform(-reach, reach, size=(self.population - 1, len(start)))
        return np.clip(np.vstack([start, draws]), search.lower, search.upper)


def drive(algorithm: Any, search: Search, rng: np.random.Generator) -> Outcome:
    """Run a pymoo algorithm until it stops by itself; a search that has ended raises through it.

    pymoo is told the costs of whole populations; infinite costs are shown to it as WORST.
    """
    problem = Problem(n_var=len(search.lower), n_obj=1, xl=search.lower, xu=search.upper)
    algorithm.setup(problem, termination=NoTermination(), seed=int(rng.integers(2**31)), verbose=False)
    with global_generator(rng):
        while algorithm.has_next():
            asked = algorithm.ask()
            if asked is None or not len(asked):
                break
            x = np.clip(asked.get("X").astype(float), search.lower, search.upper)
            costs = np.nan_to_num(search.costs(x), posinf=WORST)
            asked.set("F", costs[:, None])
            asked.set("G", np.zeros((len(x), 0)))
            asked.set("H", np.zeros((len(x), 0)))
            for individual in asked:
                individual.evaluated.update({"F", "G", "H"})
            algorithm.tell(infills=asked)
    return Outcome(True, "the population has converged")


@contextmanager
def global_generator(rng: np.random.Generator) -> Iterator[None]:
    """Seed NumPy's global generator, which some libraries draw from, from ours; give it back as it was."""
    before = np.random.get_state()
    np.random.seed(int(rng.integers(2**31)))
    try:
        yield
    finally:
        np.random.set_state(before)
