"""How well a variant explains its data within what was stated to be uncertain: the likelihood, with nuisance
parameters fitted along where the study states them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
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
from identify.vibration.nuisances.stated import times_as_large
from identify.vibration.problem import Problem, with_uncertainty

_LIKELY = GaussNewton(evaluations=20, tolerance=1e-2)
"""What stated uncertainty explains is found in five to twenty steps; what it does not creeps, and is left."""
_LARGER = 1.5
"""How many times as large as stated all errors together may be."""


@dataclass(frozen=True)
class Within:
    """The gap, and how many times as large as stated the nuisance parameters are together; most: the gap
    that a fit was to come down to, where it was given up on the way because it would not.
    """

    gap: float
    errors: float
    most: float = np.inf

    @property
    def explained(self) -> bool:
        """Whether nothing is left to be explained."""
        return self.gap <= QUIET and self.errors <= _LARGER

    @property
    def worst(self) -> float:
        """The worse of both: RMS of residuals over noise, or of errors over what was stated."""
        return max(self.gap, self.errors)


def within(score: Score, stated: UncertaintySettings | None, most: float = np.inf) -> Within:
    """From where logarithms led; found once for each score, which is of one study; given up where the gap
    would stay above `most`.
    """
    found: Within | None = score.asked.get("within")
    if found is None or found.most < most:
        found = score.asked["within"] = _within(score, stated, most)
    return found


def within_as_stated(score: Score, stated: UncertaintySettings | None) -> Within:
    """The same of a study as it is stated: from its start values too, where logarithms led to what does not
    explain the data, because in a band of noise or without a resonance they lead astray.
    """
    found = within(score, stated)
    if not found.explained:
        from_starts = _within(replace(score, values=score.problem.initial), stated, found.worst)
        found = score.asked["within"] = min(found, from_starts, key=lambda one: one.worst)
    return found


def _within(score: Score, stated: UncertaintySettings | None, most: float) -> Within:
    problem = _uncertain(score.problem, stated)
    objective = FrfLeastSquares().objective(problem.targets())
    scale = Scale(problem.parameters)
    start = problem.initial
    start[: len(score.values)] = score.values
    search = Search(objective, scale, 10 * _LIKELY.evaluations, rival=most)
    outcome = minimized(_LIKELY, search, scale.to_x(start), np.random.default_rng(0))
    if outcome.spent:
        return Within(float(search.best_cost), np.inf, most)
    x = scale.to_x(start) if search.best_x is None else search.best_x
    return Within(float(search.best_cost), _errors(search, x, len(problem.nuisances.parameters)))


def _errors(search: Search, x: Array, count: int) -> float:
    """How many times as large as stated the errors are, which are the last `count` of x (free,)."""
    if not count:
        return 1.0
    known = search.part(1).product(x)[:-1, :-1]
    if not np.isfinite(known).all():
        return np.inf
    size = np.sqrt(np.maximum(np.diag(known), np.finfo(float).tiny))
    spread = np.sqrt(np.abs(np.diag(np.linalg.pinv(known / np.outer(size, size), hermitian=True)))) / size
    return times_as_large(x[-count:], spread[-count:])


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
    return score.once("levelled", lambda: _levelled(stated, score))


def _levelled(stated: Stated, score: Score) -> Score:
    there = stated.changed(times(stated, float(np.exp(-score.level))))
    return replace(score, problem=there.problem(), level=0.0, asked={})
