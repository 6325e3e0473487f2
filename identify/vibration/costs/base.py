"""What a cost is, what it turns into once it meets data, and the registry of all kinds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from identify.core.arrays import Array, Index
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.core.registry import Registry, parse_kind
from identify.fitting.objective import Objective
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget

COSTS = Registry(
    "cost",
    "identify.costs",
    {
        "eigenfrequency": "identify.vibration.costs.eigenfrequency:Eigenfrequency",
        "frf-area": "identify.vibration.costs.frf_area:FrfArea",
        "frf-least-squares": "identify.vibration.costs.frf_least_squares:FrfLeastSquares",
        "normalized-response": "identify.vibration.costs.normalized_response:NormalizedResponse",
    },
    "identify.vibration.costs.base:Cost",
)


class Cost(Settings, ABC):
    """Settings of a cost as written in the config."""

    kind: str = Field(description="which cost")

    @abstractmethod
    def objective(self, targets: Targets) -> Objective:
        """The cost for these data; raises InputError where the data are not of its kind."""

    @property
    def likelihood(self) -> bool:
        """Whether nuisance parameters can be weighed against it, and so are fitted along."""
        return False


CostOfFrf = TypeVar("CostOfFrf", bound=Cost)


class FrfObjective(Objective, Generic[CostOfFrf]):
    """A cost that compares FRFs: the sum over sets of what a subclass makes of one set."""

    def __init__(self, cost: CostOfFrf, targets: Targets) -> None:
        if not targets.frf:
            raise InputError(
                "cost",
                f"{cost.kind} compares FRFs, and no measurement to be fitted has any",
                "`measurements` with `file`",
            )
        self.cost, self.targets = cost, targets.frf

    def costs(self, candidates: Array) -> Array:
        """The sum over measurements, a chunk of the population at a time, so that what they share is computed
        once.
        """
        total = np.full(len(candidates), np.inf)
        with np.errstate(all="ignore"):  # a candidate whose model has no solution costs infinity
            for part in in_chunks(self.targets, candidates):
                total[part] = 0.0
                for target in self.targets:
                    total[part] += self.sums(target, candidates[part])
        return self.finish(np.where(np.isnan(total), np.inf, total))

    def residuals(self, values: Array, free: Index) -> tuple[Array, Array]:
        """Those of all measurements in a row."""
        with np.errstate(
            all="ignore"
        ):  # where the model has no solution they are not finite, which optimizers look for
            parts = [self.parts(target, values, free) for target in self.targets]
        return np.concatenate([r for r, _ in parts]), np.concatenate([j for _, j in parts])

    def finish(self, total: Array) -> Array:
        """The cost (m,) from the sum over measurements (m,)."""
        return total

    @abstractmethod
    def sums(self, target: FrfTarget, candidates: Array) -> Array:
        """(m,): the part of one measurement in the sum."""

    @abstractmethod
    def parts(self, target: FrfTarget, values: Array, free: Index) -> tuple[Array, Array]:
        """Residuals (r,) and derivatives (r, free) of one measurement."""


def in_chunks(targets: Sequence[FrfTarget], candidates: Array) -> list[Index]:
    """Numbers of those of the candidates (m, parameters) that are finite, by as many as the set that needs
    most room for one can take at once.
    """
    possible = np.flatnonzero(np.isfinite(candidates).all(axis=1))
    return [possible[part] for part in max((t.chunks(len(possible)) for t in targets), key=len)]


def real_rows(residual: NDArray[np.complex128], gradient: NDArray[np.complex128]) -> tuple[Array, Array]:
    """Complex residuals (...) and gradients (..., free) as real rows: real parts, then imaginary parts."""
    flat = gradient.reshape(-1, gradient.shape[-1])
    return np.concatenate([residual.real.ravel(), residual.imag.ravel()]), np.concatenate(
        [flat.real, flat.imag]
    )


def parse_cost(data: Any) -> Cost:
    """A cost from its name or mapping in the config; raises ValueError for pydantic to report with its
    key.
    """
    cost: Cost = parse_kind(COSTS, {"kind": data} if isinstance(data, str) else data)
    return cost
