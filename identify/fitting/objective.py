"""What is minimised: a cost that has met its data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from identify.core.arrays import Array, Index


class Objective(ABC):
    """A cost that has met its data: a function of parameter values alone."""

    expensive: ClassVar[bool] = False
    """Whether residuals take so long that an interrupted run remembers them (`identify.fitting.journal`)."""

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
