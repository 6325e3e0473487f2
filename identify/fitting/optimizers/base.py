"""What an optimizer is, what it sees of a problem, and the registry of all kinds.

An optimizer holds settings only.  It sees a `Search`: bounds, costs of whole populations, residuals with
gradients; the search counts evaluations, keeps the best point ever seen and ends the run when the budget is
spent or the target is met.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from identify.core.arrays import Array
from identify.core.bounded import ASIDE, aside
from identify.core.interruption import check
from identify.core.parameters import Scale
from identify.core.plugin import PluginError, name_of
from identify.core.registry import Registry, parse_kind
from identify.fitting.memory import Journal
from identify.fitting.objective import Objective, compressed

OPTIMIZERS = Registry(
    "optimizer",
    "identify.optimizers",
    {
        "artificial-bee-colony": "identify.fitting.optimizers.artificial_bee_colony:ArtificialBeeColony",
        "cma-es": "identify.fitting.optimizers.cma_es:CmaEs",
        "differential-evolution": "identify.fitting.optimizers.differential_evolution:DifferentialEvolution",
        "gauss-newton": "identify.fitting.optimizers.gauss_newton:GaussNewton",
        "genetic-algorithm": "identify.fitting.optimizers.genetic_algorithm:GeneticAlgorithm",
        "hybrid": "identify.fitting.optimizers.hybrid:Hybrid",
        "nelder-mead": "identify.fitting.optimizers.nelder_mead:NelderMead",
        "particle-swarm": "identify.fitting.optimizers.particle_swarm:ParticleSwarm",
    },
    "identify.fitting.optimizers.base:Optimizer",
    {"levenberg-marquardt": "gauss-newton"},
)


class Ended(Exception):
    """Raised by a search inside an optimizer when there is nothing more to evaluate; `reason` is a
    sentence.
    """

    def __init__(self, reason: str, *, reached: bool) -> None:
        super().__init__(reason)
        self.reason, self.reached = reason, reached


@dataclass(frozen=True)
class Outcome:
    """How a stage ended: whether the optimizer is content, and why, in a sentence; spent: with its budget."""

    converged: bool
    sentence: str
    spent: bool = False


@dataclass
class Search:
    """One stage of one start: the objective over scaled free parameters, with its budget and the best point
    so far.

    watch is called after every evaluation with the number of evaluations so far and the best cost; journal
    remembers costs, so that an interrupted run can be replayed without computing them again.  far: cost above
    which nobody asks where exactly the minimum is; rival: cost that gradient methods do not go on above, once
    steps as large as the last would not reach it.
    """

    objective: Objective
    scale: Scale
    budget: int
    target_cost: float = 0.0
    watch: Callable[[int, float], None] = lambda evaluations, best: None
    journal: Journal = field(default_factory=Journal)
    whole: Search | None = None
    far: float = np.inf
    rival: float = np.inf
    evaluations: int = 0
    best_x: Array | None = None
    best_cost: float = np.inf
    lower: Array = field(init=False)
    upper: Array = field(init=False)

    def __post_init__(self) -> None:
        self.lower, self.upper = self.scale.bounds()

    def part(self, budget: int) -> Search:
        """A search with a budget of its own within this one: what it evaluates counts here too."""
        return Search(self.objective, self.scale, budget, self.target_cost, journal=self.journal, whole=self)

    def costs(self, x: Array) -> Array:
        """(m,) costs of a population x (m, free) within the bounds; raises Ended when the budget is spent or
        the target met, Interrupted where the user asked for the end.
        """
        check()
        if self.evaluations >= self.budget:
            raise Ended(f"the budget of {self.budget} evaluations is spent", reached=False)
        if not np.isfinite(x).all():
            raise ValueError("it asks for the cost of values that are not numbers")
        x = np.clip(x, self.lower, self.upper)
        costs = self._evaluate(x) if self.whole is None else self.whole.costs(x)
        self.evaluations += len(x)
        best = int(np.argmin(costs))
        if self.best_x is None or costs[best] < self.best_cost:
            self.best_x, self.best_cost = x[best].copy(), float(costs[best])
        self.watch(self.evaluations, self.best_cost)
        if self.best_cost <= self.target_cost:
            raise Ended(f"the cost is at or below its target of {self.target_cost:g}", reached=True)
        return costs

    def _evaluate(self, x: Array) -> Array:
        remembered = self.journal.replay(len(x))
        if remembered is not None:
            return remembered
        found = self.objective.costs(self.scale.to_values(x))
        costs = np.where(np.isnan(found), np.inf, found)  # no number is no solution, and never the best
        self.journal.record(costs)
        return costs

    def compare(self, cost: float, fall: float) -> None:
        """Raise Ended where a cost that may still fall by so much would not come near the rival's."""
        if cost - fall > self.rival:
            raise Ended(f"steps as large as the last would not reach {self.rival:g}", reached=False)

    def residuals(self, x: Array) -> tuple[Array, Array]:
        """Residuals (free + 1,) and their derivatives with respect to x (free + 1, free), compressed; counts
        as one evaluation.
        """
        return compressed(self.product(x))

    def bend(self, x: Array, step: Array) -> Array | None:
        """J'r'' (free,), with the second derivatives r'' of the residuals along a step from x, where
        `product` was last computed, but for unknowns so near a bound that there is nothing on its other side;
        None where the objective does not tell.
        """
        change = aside(x, step, *self.scale.bounds())
        sides = self.scale.to_values(np.array([x + change, x - change]))
        bend = self.objective.bend(self.scale.to_values(x), self.scale.free, sides)
        if bend is None or not np.isfinite(bend).all():
            return None
        return np.asarray(bend * self.scale.slope(x) / ASIDE**2)

    def product(self, x: Array) -> Array:
        """[J r]'[J r] (free + 1, free + 1) of the residuals r and their derivatives J with respect to x, all
        infinite where any number is not finite; counts as one evaluation.
        """
        check()
        self.evaluations += 1
        size = len(x) + 1
        remembered = self.journal.replay(size * size) if self.objective.expensive else None
        if remembered is not None:
            return remembered.reshape(size, size)
        scale = np.append(self.scale.slope(x), 1.0)
        with np.errstate(all="ignore"):
            product = self.objective.product(self.scale.to_values(x), self.scale.free)
            product = product * np.outer(scale, scale)
        if not np.isfinite(product).all():
            product = np.full_like(product, np.inf)
        if self.objective.expensive:
            self.journal.record(product.ravel())
        return product


class Optimizer(BaseModel, ABC):
    """Settings of an optimizer as written in the config; what it works on is its stage's
    (`identify.fitting.plan`).
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    ENDS_AT_BUDGET: ClassVar[bool] = False
    """Whether it has no other end than its budget: then a spent budget is the end that was asked for."""
    kind: str = Field(description="which optimizer")
    evaluations: int = Field(1000, ge=1, description="budget of cost evaluations of this stage, per start")

    @abstractmethod
    def minimize(self, search: Search, start: Array, rng: np.random.Generator) -> Outcome:
        """Search from x = start (free,); the best point is left in `search`.  All chance comes from `rng`."""


def minimized(optimizer: Optimizer, search: Search, start: Array, rng: np.random.Generator) -> Outcome:
    """How an optimizer ended; PluginError where one of a third party does not say it."""
    try:
        outcome = optimizer.minimize(search, start, rng)
    except Ended as end:
        return Outcome(end.reached or optimizer.ENDS_AT_BUDGET, end.reason, spent=not end.reached)
    if not isinstance(outcome, Outcome):
        raise PluginError(name_of(optimizer), f"`minimize` gives {outcome!r}", "an Outcome")
    return outcome


def parse_optimizer(data: Any) -> Optimizer:
    """An optimizer from its name or mapping in the config; raises ValueError for pydantic to report with its
    key.
    """
    optimizer: Optimizer = parse_kind(OPTIMIZERS, {"kind": data} if isinstance(data, str) else data)
    return optimizer
