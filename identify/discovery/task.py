"""A model to be fitted, and how it went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.fitting.selection import workbench as selection
from identify.model.effects.base import Effect

FEW_STEPS = 3
"""Of a fit once the time that was given is over."""


@dataclass(frozen=True)
class Task:
    """What is to be fitted: effects known to the model, further ones, and values to start from by parameter
    name; parameters of the further ones without a value begin at the best of their grid.

    whole: on all lines, and judged by data that are not fitted; else on few.  steps: how many at most; rival:
    gap of what the model is compared with, which a fit that would not come near does not go on for.
    """

    known: tuple[Effect, ...]
    new: tuple[Effect, ...]
    values: Mapping[str, float]
    whole: bool = False
    steps: int = 30
    rival: float = np.inf

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All of them."""
        return (*self.known, *self.new)


@dataclass(frozen=True)
class Trial:
    """How a task ended: values by name; sums of squared residuals over noise and counts of real numbers, on
    fitted and validation data.

    Data that were not fitted are judged against the prediction with its uncertainty: what the fit leaves
    wide open they may move.  free: number of free parameters; failure: a sentence where the model could not
    be made or solved; errors: how much of the squares are those of nuisance parameters, in their standard
    deviations.
    """

    task: Task
    values: Mapping[str, float]
    squares: float
    count: int
    squares_validation: float = float("nan")
    count_validation: int = 0
    free: int = 0
    failure: str = ""
    errors: float = 0.0

    @property
    def gap(self) -> float:
        """RMS residual over noise on the fitted data."""
        return float(np.sqrt(self.squares / max(self.count, 1)))

    @property
    def gap_validation(self) -> float:
        """The same on validation data; NaN without."""
        return (
            float(np.sqrt(self.squares_validation / self.count_validation))
            if self.count_validation
            else float("nan")
        )

    @property
    def gap_everywhere(self) -> float:
        """The same on all of them."""
        if not self.count_validation:
            return self.gap
        squares, count = self.squares + self.squares_validation, self.count + self.count_validation
        return float(np.sqrt(squares / count))


Option = selection.Option[Effect, Trial]
Step = selection.Step[Effect, Trial]
