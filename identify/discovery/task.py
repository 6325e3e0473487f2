"""A model to be tried, and how it went."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from identify.fitting.selection import workbench as selection
from identify.model.effects.base import Effect

_NEAR, _LEAST = 5.0, 0.05
"""How many times the best one's gap above noise, or above this, a trial may leave and still win when fitted
thoroughly."""


@dataclass(frozen=True)
class Task:
    """What is to be tried: effects known to the model, further ones, and values to start from by parameter
    name.

    how: `start`: from these values by logarithmic residuals first; `glance`: what is known stays as it is;
    `beside`: one step from these values; `brief`: a few steps on few lines; `astray`: once more, by another
    start; `led`: on from there, with errors of links; `quick`: more of them, with all errors; `likely`: on
    from there to the likelihood; `afresh`: to the likelihood from the study's own values; `thorough`: from
    several starts, on all lines; `nearby`: from these values alone, with the errors they have; `onward`: the
    same on all lines; `settled`: the same to the very end.
    far: the present model is far from the data. anchor: values of the known model where that depends on
    amplitude: quick trials then keep what amplitude does to the FRFs as it is there, because to simulate
    every impact anew takes long.
    """

    known: tuple[Effect, ...]
    new: tuple[Effect, ...]
    values: Mapping[str, float]
    how: Literal[
        "start",
        "glance",
        "beside",
        "brief",
        "astray",
        "led",
        "quick",
        "likely",
        "afresh",
        "thorough",
        "nearby",
        "onward",
        "settled",
    ] = "quick"
    far: bool = False
    anchor: Mapping[str, float] = field(default_factory=dict)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All of them."""
        return (*self.known, *self.new)

    @property
    def has_form(self) -> bool:
        """Whether the form of any of them may be off."""
        return any(effect.has_form for effect in self.effects)


@dataclass(frozen=True)
class Trial:
    """How a task ended: values by name; sums of squared residuals over noise and counts of real numbers, on
    fitted and validation data.

    Data that were not fitted are judged against the prediction with its uncertainty: what the fit leaves
    wide open they may move.  free: number of free parameters; failure: a sentence where the model could not
    be made or solved.
    """

    task: Task
    values: Mapping[str, float]
    squares: float
    count: int
    squares_validation: float = float("nan")
    count_validation: int = 0
    free: int = 0
    failure: str = ""

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
Attempt = selection.Attempt[Effect, Trial]
Step = selection.Step[Effect, Trial]


def squares_of(trial: Trial) -> float:
    """Sum of squared residuals over noise."""
    return trial.squares


def solved(trial: Trial) -> bool:
    """Whether the model had a solution."""
    return bool(np.isfinite(trial.squares))


def near_enough(trials: Sequence[Trial], best: float, times: float = _NEAR) -> list[Trial]:
    """Those on few lines that may come as near as the best gap when fitted thoroughly."""
    return [trial for trial in trials if trial.gap - 1 <= times * max(best - 1, _LEAST)]


def once(trials: Sequence[Trial]) -> list[Trial]:
    """The first trial of each effect."""
    found: dict[str, Trial] = {}
    for trial in trials:
        found.setdefault(trial.task.new[0].model_dump_json(), trial)
    return list(found.values())
