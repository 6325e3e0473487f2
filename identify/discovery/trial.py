"""One model refitted: on few lines, or on all of them and judged by data that are not fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.parameters import Scale
from identify.discovery.decimated import count_of, decimated, free_of, left_out, without_amplitude
from identify.discovery.places.job import Known, PlaceJob
from identify.discovery.places.screen import PlaceFitter
from identify.discovery.task import Task, Trial
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Search, minimized
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.model.effects.pre_trigger import PRE_TRIGGER, valleys
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, FrfLeastSquaresObjective
from identify.vibration.costs.target import FrfTarget
from identify.vibration.elsewhere import predictive_squares
from identify.vibration.plan import FAR
from identify.vibration.problem import Problem, with_effects
from identify.vibration.uncertainty import fitted_information

_REDUCED = 12
"""Steps of a fit to the channels that are kept beside those left out."""
_FEW_LINES, _ALL_LINES = 1e-4, 1e-6
"""Relative change of a sum of squares at which a fit ends."""


class TrialRunner:
    """Where models are fitted: a problem with all its lines and with few of them."""

    def __init__(self, problem: Problem) -> None:
        self.whole, self.thin = problem, decimated(problem)
        self.kept = self.thin if problem.validated else left_out(self.thin)
        self._fitter: tuple[Known, PlaceFitter] | None = None
        lines = [m.target.data.frequency_hz for m in problem.measurements if isinstance(m.target, FrfTarget)]
        self._band = (max(min(float(f.min()) for f in lines), 1e-3), max(float(f.max()) for f in lines))

    def run(self, task: Task) -> Trial:
        """The trial of a task; a model that cannot be made or solved is a trial with an infinite sum of
        squares.
        """
        try:
            return self._run(task)
        except (InputError, InputErrors, np.linalg.LinAlgError) as error:
            return Trial(task, task.values, np.inf, 1, np.inf, 1, failure=str(error))

    def place(self, known: Known, job: PlaceJob) -> Any:
        """The outcome of work on a place, on few lines."""
        if self._fitter is None or self._fitter[0] != known:
            model = without_amplitude(self.thin, known.effects, known.values)
            self._fitter = known, PlaceFitter(model)
        return job.run(self._fitter[1], self._band)

    def _run(self, task: Task) -> Trial:
        if not task.whole:
            problem, values, cost = self._on_few_lines(task)
        else:
            problem = with_effects(self.whole, task.effects, task.values)
            if any(p.name not in task.values for p in problem.parameters if p.free):
                thin, values, _ = self._on_few_lines(task)
                problem = with_effects(self.whole, task.effects, _named(thin, values))
            values, cost = fitted(problem, retimed(problem, problem.initial), task.steps, _ALL_LINES)
        count, found = count_of(problem, "fit"), {**task.values, **_named(problem, values)}
        squares, validation = self._elsewhere(problem, task, found) if task.whole else (float("nan"), 0)
        errors = sum(found[one.name] ** 2 for one in problem.nuisances.entries)
        free = free_of(problem)
        return Trial(task, found, cost**2 * count, count, squares, validation, free, errors=errors)

    def _on_few_lines(self, task: Task) -> tuple[Problem, Array, float]:
        problem = with_effects(self.thin, task.effects, task.values)
        start = best_of(problem, self._starts(problem, task))
        return problem, *fitted(problem, start, task.steps, _FEW_LINES, task.rival)

    def _elsewhere(self, problem: Problem, task: Task, found: Mapping[str, float]) -> tuple[float, int]:
        """Sum of squares and count on data that were not fitted: those for validation, or channels left out
        of one more fit.
        """
        if not self.whole.validated:
            problem = with_effects(self.kept, task.effects, found)
            values = fitted(problem, problem.initial, _REDUCED, _FEW_LINES)[0]
        else:
            values = problem.at(found)
        if not count_of(problem, "validate"):
            return float("nan"), 0
        return predictive_squares(problem, fitted_information(problem, values), values)

    def _starts(self, problem: Problem, task: Task) -> Array:
        """(m, parameters): what has a value begins there, what is new goes over its grid, effect by
        effect.
        """
        system, parameters, found = problem.measurements[0].system, problem.parameters, []
        for number, (effect, own) in enumerate(system.effects):
            new = [n for n in own if parameters[n].free and parameters[n].name not in task.values]
            if new and effect in task.new:
                every = effect.terms(problem.robot, system.site, f"effects.{number}")
                terms = [replace(every[n - own[0]], parameter=parameters[n]) for n in new]
                grid = effect.initial_values(terms, self._band)
                found.append(np.repeat(problem.initial[None], len(grid), axis=0))
                found[-1][:, new] = grid
        return np.concatenate(found) if found else problem.initial[None]


def best_of(problem: Problem, starts: Array) -> Array:
    """The best of the starts (m, parameters) as they are."""
    if len(starts) == 1:
        return np.asarray(starts[0])
    return np.asarray(starts[int(np.argmin(likelihood(problem).costs(starts)))])


def fitted(
    problem: Problem, start: Array, steps: int, tolerance: float, rival: float = np.inf
) -> tuple[Array, float]:
    """From start (unknowns,), after so many steps at most, to the greatest likelihood near it; values and
    cost.  rival: as `Search` has it.
    """
    optimizer = GaussNewton(evaluations=steps, tolerance=tolerance)
    return minimum(problem, start, optimizer, likelihood(problem), rival)


def minimum(
    problem: Problem, start: Array, optimizer: GaussNewton, objective: Objective, rival: float = np.inf
) -> tuple[Array, float]:
    """From start (unknowns,): values and cost."""
    scale = Scale(problem.parameters)
    far = FAR if problem.nuisances.entries else np.inf
    search = Search(objective, scale, 10 * optimizer.evaluations, far=far, rival=rival)
    minimized(optimizer, search, scale.to_x(start), np.random.default_rng(0))
    if search.best_x is None:
        return start, float("inf")
    return scale.to_values(search.best_x), search.best_cost


def retimed(problem: Problem, values: Array) -> Array:
    """Values (parameters,) with the pre-trigger in the best of its valleys, if it is free, and acts: where
    impacts are simulated it is held.
    """
    known = enumerate(problem.parameters)
    number = next((n for n, p in known if p.name == PRE_TRIGGER and p.free), None)
    if number is None or problem.targets().simulated:
        return values
    times = valleys(problem.parameters[number].lower, problem.parameters[number].upper)
    trials = np.repeat(values[None], len(times) + 1, axis=0)
    trials[1:, number] = times
    return best_of(problem, trials)


def likelihood(problem: Problem) -> Objective:
    """What is fitted, in as few rows as say the same where no errors are fitted along."""
    targets = problem.targets()
    if targets.stated:
        return FrfLeastSquares().objective(targets)
    return FrfLeastSquaresObjective(FrfLeastSquares(), targets, shortened=True)


def _named(problem: Problem, values: Array) -> dict[str, float]:
    return {p.name: float(v) for p, v in zip(problem.parameters, values, strict=True)}
