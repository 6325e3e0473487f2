"""The plan of the fit of a study of vibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.thresholds import QUIET
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Optimizer
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.fitting.plan import FitPlan, Stage, make_stages
from identify.vibration.costs.eliminated import EliminatedObjective
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.problem import Problem
from identify.vibration.study import VibrationStage

_TOLERANCE = 1e-6
"""Relative change of the sum of squares below which a fit with nuisance parameters has converged."""
_TEMPERATURES = (1e4, 900.0, 100.0, 9.0)
"""With noise far below the errors the valley of the likelihood is narrow and bent.  Squares divided by these,
in turn, leave the errors near what was stated at first, and the minimum moves on (continuation).
"""
_LEADING = GaussNewton(evaluations=15, tolerance=1e-3)
"""How each of them is minimised: roughly, but not so roughly that a stage ends where tempered data hardly
matter and impacts that make a joint slip are not yet found.
"""
_ROUNDS = 2
"""How often errors are linearised anew under an optimizer that searches the parameters alone."""
FAR = 5.0
"""The gap above which nuisance parameters are not followed to their end: they creep on to make up for what
the model lacks.
"""
_ALIKE = 1e-3
"""Values, on the search scale, that differ by less lead to the same minimum, where a stage takes long."""


def fit_plan(problem: Problem) -> FitPlan:
    """The plan of a study: each stage with its own cost or the study's, on its own measurements or on all.

    The cost of FRF least squares is a gap, so a minimum above noise is not believed early.  Raises InputError
    where a stage names what there is not, or a cost has not the data it compares.
    """
    study, likelihood = problem.file.study, problem.file.study.cost.likelihood
    # Against another cost than the likelihood nuisance parameters cannot be weighed: it is fitted as
    # published, with them held at nothing, and the intervals carry them (`identify.vibration.intervals`).
    parameters = tuple(
        p.at(p.initial, free=p.free and (likelihood or not p.nuisance)) for p in problem.parameters
    )
    objective = study.cost.objective(problem.targets())

    def of(stage: VibrationStage) -> Objective:
        if stage.cost is None and stage.measurements is None:
            return objective
        return (stage.cost or study.cost).objective(problem.targets(names=stage.measurements))

    stages = [make_stages(some, parameters, of) for some in (study.stages, study.last_resort)]
    with_errors = likelihood and bool(problem.nuisances.entries)
    if with_errors:
        stages = [_with_errors(some, problem, objective) for some in stages]
    return FitPlan(
        parameters,
        objective,
        stages[0],
        stages[1],
        study.starts,
        study.start_factor,
        study.target_cost,
        QUIET if likelihood else np.inf,
        study.seed,
        _ALIKE if with_errors else 0.0,
        FAR if with_errors else np.inf,
    )


def _with_errors(stages: tuple[Stage, ...], problem: Problem, objective: Objective) -> tuple[Stage, ...]:
    """The stages where nuisance parameters are fitted along: by Gauss-Newton on the study's cost.  Others
    on that cost search the parameters with errors eliminated, all other stages hold them as they are.

    A stage of Gauss-Newton ends the fit, whatever the study says; others lead to the first one.
    """
    if not stages:
        return stages
    errors = np.array([parameter.nuisance for parameter in problem.parameters])

    def moves_errors(stage: Stage) -> bool:
        return isinstance(stage.optimizer, GaussNewton) and stage.objective is objective

    held = list[Stage]()
    for stage in stages:
        if moves_errors(stage):
            held.append(replace(stage, optimizer=_tolerant(stage.optimizer)))
        elif stage.objective is objective and isinstance(objective, PosteriorObjective):
            held += _eliminating(stage, objective, errors, problem.initial)
        else:
            held.append(replace(stage, moves=stage.moves & ~errors))
    if not moves_errors(stages[-1]):
        moves = np.any([stage.moves for stage in stages], axis=0) | errors
        held.append(Stage(_tolerant(GaussNewton()), objective, moves))
    first = next(number for number, stage in enumerate(held) if moves_errors(stage))
    targets, moves = problem.targets(), held[first].moves | errors
    leading = [
        Stage(_LEADING, PosteriorObjective(FrfLeastSquares(), targets, temperature), moves)
        for temperature in _TEMPERATURES
    ]
    return (*held[:first], *leading, *held[first:])


def _eliminating(
    stage: Stage, objective: PosteriorObjective, errors: NDArray[np.bool_], initial: Array
) -> list[Stage]:
    """The stage with errors held, which leads from afar to where they can be linearised; errors where they
    are best; both again, with errors eliminated.
    """
    held = replace(stage, moves=stage.moves & ~errors)
    eliminated = replace(held, objective=EliminatedObjective(objective, initial))
    best = Stage(_LEADING, objective, errors)
    return [held, best, *[eliminated, best] * _ROUNDS]


def _tolerant(optimizer: Optimizer) -> Optimizer:
    """With a tolerance that is enough for so many unknowns, unless the study states one."""
    if "tolerance" in optimizer.model_fields_set:
        return optimizer
    return optimizer.model_copy(update={"tolerance": _TOLERANCE})
