"""What is minimised: a cost that has met its data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from identify.core.arrays import Array, Index


class Objective(ABC):
    """A cost that has met its data: a function of parameter values alone."""

    expensive: ClassVar[bool] = False
    """Whether residuals take so long that an interrupted run remembers them (`identify.fitting.memory`)."""

    def at(self, values: Array) -> Objective:
        """What a stage that begins at these values (parameters,) minimises: itself, unless it is an
        approximation there, or remembers what was computed before, which no stage may depend on.
        """
        return self

    @abstractmethod
    def costs(self, candidates: Array) -> Array:
        """(m,) costs of a whole population (m, parameters) at once; 0 is perfect, inf where a model has no
        solution.
        """

    @abstractmethod
    def residuals(self, values: Array, free: Index) -> tuple[Array, Array]:
        """Residuals (r,) and their derivatives (r, free) at values (parameters,), for gradient methods; zero
        residuals mean zero cost.
        """

    def product(self, values: Array, free: Index) -> Array:
        """[J r]'[J r] (free + 1, free + 1) of the residuals r and their derivatives J."""
        residuals, slopes = self.residuals(values, free)
        product = np.empty((len(free) + 1, len(free) + 1))
        with np.errstate(all="ignore"):  # where the model has no solution it is not finite
            product[:-1, :-1] = slopes.T @ slopes
            product[-1, :-1] = product[:-1, -1] = residuals @ slopes
            product[-1, -1] = residuals @ residuals
        return product

    def bend(self, values: Array, free: Index, sides: Array) -> Array | None:
        """J'(r(a) - 2 r + r(b)) (free,) for values a and b (2, parameters) on either side of those where
        `product` was last computed; None where that would take long.
        """
        return None


class ProductObjective(Objective):
    """An objective that knows the product of its residuals without having them."""

    @abstractmethod
    def product(self, values: Array, free: Index) -> Array:
        """[J r]'[J r] (free + 1, free + 1) at values (parameters,)."""

    def residuals(self, values: Array, free: Index) -> tuple[Array, Array]:
        """In as few rows as say the same, because there are many columns."""
        return compressed(self.product(values, free))


def compressed(product: Array) -> tuple[Array, Array]:
    """Residuals r (n,) and slopes J (n, n - 1) with the same r'r, J'r and J'J, from the product [J r]'[J r]
    (n, n) of any number of rows: all that least squares use of thousands of them.

    Infinite residuals without slopes where any number is not finite.
    """
    size = len(product)
    if not np.isfinite(product).all():
        return np.full(size, np.inf), np.zeros((size, size - 1))
    scale = np.sqrt(np.maximum(np.diag(product), np.finfo(float).tiny))
    squares, directions = np.linalg.eigh(product / np.outer(scale, scale))
    rows = np.sqrt(np.maximum(squares, 0.0))[:, None] * directions.T * scale
    return rows[:, -1], rows[:, :-1]
