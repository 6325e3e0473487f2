"""Artificial bee colony (Karaboga, TR06, Erciyes University 2005; Karaboga and Basturk, J. Global Optim. 39,
2007).
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Index
from identify.fitting.optimizers.base import Outcome, Search
from identify.fitting.optimizers.population import PopulationOptimizer


class ArtificialBeeColony(PopulationOptimizer):
    """Employed bees search around each source, onlookers around the good ones, scouts replace exhausted ones;
    stops at its budget.
    """

    ENDS_AT_BUDGET: ClassVar[bool] = True
    kind: Literal["artificial-bee-colony"] = "artificial-bee-colony"
    limit: int | None = Field(
        None,
        ge=1,
        description="failed trials after which a source is given up; default: population x parameters / 2",
    )

    def minimize(self, search: Search, start: Array, rng: np.random.Generator) -> Outcome:
        """Search from sources around the start; raises through the search when that has ended."""
        sources = self.first_population(search, start, rng)
        costs, failures = search.costs(sources), np.zeros(len(sources), dtype=int)
        limit = self.limit or len(sources) * len(start) // 2
        while True:
            self._visit(search, sources, costs, failures, np.arange(len(sources)), rng)
            self._visit(search, sources, costs, failures, _onlookers(costs, rng), rng)
            tired = int(np.argmax(failures))
            if failures[tired] > limit and tired != int(np.argmin(costs)):
                sources[tired] = self.first_population(search, start, rng)[-1]
                costs[tired], failures[tired] = search.costs(sources[tired : tired + 1])[0], 0

    @staticmethod
    def _visit(
        search: Search, sources: Array, costs: Array, failures: Index, picked: Index, rng: np.random.Generator
    ) -> None:
        """Try one neighbour of each picked source, v_j = x_j + phi (x_j - partner_j) in one coordinate; keep
        the better of the two.
        """
        count, size = len(picked), sources.shape[1]
        coordinate = rng.integers(size, size=count)
        partner = (picked + rng.integers(1, len(sources), size=count)) % len(sources)
        trials, rows = sources[picked].copy(), np.arange(count)
        step = rng.uniform(-1, 1, size=count) * (trials[rows, coordinate] - sources[partner, coordinate])
        trials[rows, coordinate] += step
        trials = np.clip(trials, search.lower, search.upper)
        for source, trial, cost in zip(picked, trials, search.costs(trials), strict=True):
            better = cost < costs[source]
            failures[source] = 0 if better else failures[source] + 1
            if better:
                sources[source], costs[source] = trial, cost


def _onlookers(costs: Array, rng: np.random.Generator) -> Index:
    """As many picks as sources, in proportion to fitness 1/(1 + cost)."""
    fitness = 1.0 / (1.0 + np.where(np.isfinite(costs), costs - costs.min(), np.inf))
    return rng.choice(len(costs), size=len(costs), p=fitness / fitness.sum())
