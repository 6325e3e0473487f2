"""How well a variant explains its data within what was stated to be uncertain: the likelihood, with errors of
what was told fitted along where the study states them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.parameters import Scale
from identify.core.thresholds import QUIET
from identify.fitting.optimizers.base import Search, minimized
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.setup.edits import Edit
from identify.setup.score import SLIGHT, Score
from identify.setup.stated import Stated
from identify.vibration.costs.frf_least_squares import FrfLeastSquares
from identify.vibration.nuisances.settings import UncertaintySettings
from identify.vibration.problem import Problem, with_uncertainty

_LIKELY = GaussNewton(evaluations=25, tolerance=1e-3)
_FAR = 5.0
"""Standard deviations that none of a few hundred errors has by chance."""


@dataclass(frozen=True)
class Within:
    """The gap, and the largest error of what was told, in its standard deviations."""

    gap: float
    farthest: float

    @property
    def explained(self) -> bool:
        """Whether nothing is left to be explained."""
        return self.gap <= QUIET and self.farthest <= _FAR


def within(score: Score, stated: UncertaintySettings | None) -> Within:
    """From where logarithms led."""
    problem = _uncertain(score.problem, stated)
    objective = FrfLeastSquares().objective(problem.targets())
    scale = Scale(problem.parameters)
    start = problem.initial
    start[: len(score.values)] = score.values
    search = Search(objective, scale, 10 * _LIKELY.evaluations)
    minimized(_LIKELY, search, scale.to_x(start), np.random.default_rng(0))
    found = start if search.best_x is None else scale.to_values(search.best_x)
    errors = found[len(score.values) :]
    return Within(float(search.best_cost), float(np.abs(errors).max(initial=0.0)))


def _uncertain(problem: Problem, stated: UncertaintySettings | None) -> Problem:
    """Where what was stated does not fit a variant, such as of a channel that has another name there, it is
    taken as exact.
    """
    if stated is None:
        return problem
    try:
        return with_uncertainty(problem, stated)
    except (InputError, InputErrors):
        return problem


def times(stated: Stated, factor: float) -> tuple[Edit, ...]:
    """What takes all FRFs of a study times a factor."""
    return tuple(
        Edit(("measurements", number, "correct", "factor"), float(f"{one.correct.factor * factor:.8g}"))
        for number, one in enumerate(stated.study.measurements)
    )


def levelled(stated: Stated, score: Score) -> Score:
    """A variant without the common factor of its measured FRFs, where that is one."""
    if abs(score.level) < SLIGHT:
        return score
    there = stated.changed(times(stated, float(np.exp(-score.level))))
    return replace(score, problem=there.problem(), level=0.0)
