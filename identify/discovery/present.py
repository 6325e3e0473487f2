"""The present model, fitted from several starts: a local minimum looks exactly like something missing."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.discovery.decimated import decimated
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.unknowns import Unknowns
from identify.discovery.task import Task, Trial
from identify.discovery.trial import retimed
from identify.discovery.workers import Workers
from identify.fitting.fit import ENOUGH, agreeing, starting_points
from identify.vibration.problem import Problem, with_effects
from identify.vibration.records import check_records

_ROBUST, _STEPS = 8, 30
"""Steps of each start, by logarithmic residuals, whose valleys are wide, and by the likelihood."""


def present_model(problem: Problem, workers: Workers) -> Trial:
    """The study's own model on all lines, from the best of its starts on few: as many as the study has, or
    until enough ended in the best minimum.

    Raises InputError where it has no solution.
    """
    known = tuple(problem.file.study.effects)
    values = workers.recall(["present"], lambda: _begun(problem), "the present model")
    [trial] = workers.run([Task(known, (), values, whole=True)], "the present model")
    if not np.isfinite(trial.squares):
        found = f"the present model has no solution ({trial.failure})"
        raise InputError("effects", found, "a model that `identify fit` can fit")
    check_records(problem, problem.at(trial.values), trial.gap)
    return trial


def _begun(problem: Problem) -> dict[str, float]:
    study, scale, thin = problem.file.study, Scale(problem.parameters), decimated(problem)
    ends = list[tuple[float, Penalised, Array]]()
    for point in starting_points(problem.parameters, study.starts, study.start_factor, study.seed):
        ends.append(_led(thin, retimed(thin, scale.to_values(point))))
        if agreeing([gap for gap, *_ in ends]) >= ENOUGH:
            break
    _, fit, x = min(ends, key=lambda end: end[0])
    return fit.unknowns.by_name(fit.minimise(Point(x), _STEPS).x)


def _led(problem: Problem, start: Array) -> tuple[float, Penalised, Array]:
    """The gap where a start (unknowns,) leads with nothing off what was stated, the fit, and x there."""
    effects, names = problem.file.study.effects, [p.name for p in problem.parameters]
    values = dict(zip(names, map(float, start), strict=True))
    unknowns = Unknowns(with_effects(problem, effects, values), len(effects))
    first = Penalised(unknowns, logarithmic=True, price=0.0).led(Point(unknowns.reference), _ROBUST)
    fit = Penalised(unknowns, price=0.0)
    x = fit.led(Point(first.x), _STEPS).x
    return float(np.sqrt(fit.squares(x) / fit.count)), fit, x
