"""One model tried: effects refitted to the data, quickly on a thinned set of lines or thoroughly on all of
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import QUIET
from identify.discovery.places.job import Known, PlaceJob
from identify.discovery.places.screen import PlaceFitter
from identify.discovery.softly import LEADING, SOFT, best_softly, led, likely, minimized, without_errors
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Optimizer
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.fitting.optimizers.levenberg_marquardt import LevenbergMarquardt
from identify.model.effects.base import Effect
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, FrfLeastSquaresObjective
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Given, Measurement, Problem, with_effects
from identify.vibration.uncertainty import fitted_information, predictive_squares

_LINES, _FEWEST = 84, 21
"""Frequency lines that quick trials see of all fitted measurements together, and of each at least, spread
evenly over the band.
"""
_MANY, _PLENTY = 12, 100
"""Response channels of which the first look takes a third, if it then has so many numbers for each parameter.
"""
_BRIEF = GaussNewton(evaluations=5, tolerance=1e-3)
_QUICK = GaussNewton(evaluations=25, tolerance=1e-4)
_FOLLOWED = GaussNewton(evaluations=4, tolerance=1e-2)
_SEEN = 0.03
"""Share of the cost by which a start must change it to be followed."""
_FEW_STEPS = LevenbergMarquardt(steps=6, tolerance=2e-2)
_TO_LIKELIHOOD = LevenbergMarquardt(steps=15, tolerance=1e-4)
_ON_ALL_LINES = LevenbergMarquardt(steps=10, tolerance=1e-6)
_THOROUGH = GaussNewton(evaluations=30, tolerance=1e-6)


@dataclass(frozen=True)
class Task:
    """What is to be tried: effects known to the model, further ones, and values to start from by parameter
    name.

    how: `start`: from these values by logarithmic residuals first; `glance`: what is known stays as it is;
    `brief`: a few steps on few lines; `led`: on from there, with errors of what was told; `quick`: more of
    them; `thorough`: from several starts, on all lines; `nearby`: from these values alone, with the
    errors they have; `onward`: the same on all lines.
    far: the present model is far from the data. anchor: values of the known model where that depends on
    amplitude: quick trials then keep what amplitude does to the FRFs as it is there, because to simulate
    every impact anew takes long.
    """

    known: tuple[Effect, ...]
    new: tuple[Effect, ...]
    values: Mapping[str, float]
    how: Literal["start", "glance", "brief", "led", "quick", "thorough", "nearby", "onward"] = "quick"
    far: bool = False
    anchor: Mapping[str, float] = field(default_factory=dict)

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


class TrialRunner:
    """Where models are tried: a problem with all its lines and with few of them."""

    def __init__(self, problem: Problem) -> None:
        self.whole, self.thin = problem, thinned(problem)
        self._validated = any(m.settings.use == "validate" for m in problem.measurements)
        self.kept = self.thin if self._validated else left_out(self.thin)
        self._corrected: tuple[tuple[tuple[Effect, ...], Mapping[str, float]], Problem] | None = None
        self._fitter: tuple[Any, PlaceFitter] | None = None
        self._initial = {p.name: p.initial for p in problem.parameters}
        lines = [m.target.data.frequency_hz for m in problem.measurements if isinstance(m.target, FrfTarget)]
        self._band = (max(min(float(f.min()) for f in lines), 1e-3), max(float(f.max()) for f in lines))

    def run(self, task: Task) -> Trial:
        """The trial of a task; a model that cannot be made or solved is a trial with an infinite sum of
        squares.
        """
        try:
            return self._thorough(task) if task.how in ("thorough", "onward") else self._quick(task)
        except (InputError, InputErrors, np.linalg.LinAlgError) as error:
            return Trial(task, task.values, np.inf, 1, np.inf, 1, failure=str(error))

    def place(self, known: Known, job: PlaceJob) -> Any:
        """The outcome of work on a place, on few lines."""
        model = known.effects, known.anchor
        if self._fitter is None or self._fitter[0] != model:
            task = Task(known.effects, (), known.values, anchor=known.anchor)
            self._fitter = model, PlaceFitter(self._model("thin", task))
        return job.run(self._fitter[1], self._band)

    def _quick(self, task: Task) -> Trial:
        problem = self._model("thin", task)
        starts = self._starts(problem, task)
        if problem.nuisances.entries:
            values, cost = self._softly(problem, starts, task)
        elif task.how == "glance":
            values, cost = _best(problem, starts)
        elif task.how == "start":
            values, cost = _descend(problem, self._robustly(problem, starts, _QUICK)[None], _QUICK)
        elif task.how == "brief":
            values, cost = self._briefly(problem, starts, task)
        else:
            values, cost = _best(problem, _descend(_fewer_channels(problem, task), starts, _QUICK)[0][None])
        count = _count(problem, "fit")
        return Trial(
            task, {**task.values, **_named(problem, values)}, cost**2 * count, count, free=_free(problem)
        )

    def _softly(self, problem: Problem, starts: Array, task: Task) -> tuple[Array, float]:
        """With errors of what was told fitted along; residuals count for little, so that the errors stay near
        what was stated and what they cannot explain shows.

        A first look starts with what is known afresh and no errors, because those of the present model make
        up for what it lacks; a quick trial of something new goes on from there.
        """
        if task.how == "glance":
            return best_softly(problem, starts, LEADING[0])
        if task.how == "nearby":
            return minimized(problem, problem.initial, _TO_LIKELIHOOD, likelihood(problem))
        if task.how == "brief":
            few = _fewer_channels(problem, task)
            return led(few, self._first_start(few, starts, task), LEADING[:1], _FEW_STEPS)
        if task.how == "led":
            return led(_fewer_channels(problem, task), problem.initial, LEADING)
        if task.how == "quick" and task.new:
            return led(problem, problem.initial, [SOFT])
        held = without_errors(problem)
        fresh = starts if task.how == "start" else self._afresh(problem, starts)
        robust = _descend(held, fresh, _BRIEF, _logarithmic(held))[0]
        either = np.array([best_softly(problem, starts)[0], robust])
        either[:, problem.size :] = 0.0
        if task.how == "start":
            either = best_softly(problem, either)[0][None]
        return min((led(problem, one, (*LEADING, SOFT)) for one in either), key=lambda end: end[1])

    def _first_start(self, few: Problem, starts: Array, task: Task) -> Array:
        """Where a first look starts with errors of what was told: with what is known afresh and no errors,
        because those of the present model make up for what it lacks.

        A resonance of its own is as narrow as its peak: it needs the present values beside it, and each
        frequency followed.
        """
        site = few.measurements[0].system.site
        terms = [{term.quantity for term in effect.terms(few.robot, site, "")} for effect in task.new]
        if any({"mass", "stiffness"} <= quantities for quantities in terms):
            starts = starts.copy()
            starts[:, few.size :] = 0.0
            return from_each(without_errors(few), starts, _FOLLOWED)
        fresh = self._afresh(few, starts)
        best = int(np.argmin(_logarithmic(few).costs(fresh)))
        return np.asarray(fresh[best])

    def _briefly(self, problem: Problem, starts: Array, task: Task) -> tuple[Array, float]:
        """A few steps from the best of the starts, on some of the channels.

        Where the present model is far from the data, also from the best by logarithmic residuals: those see a
        resonance from far, where for the likelihood any other place, or an effect too small to see, is
        better; and with what is known afresh.
        """
        few = _fewer_channels(problem, task)
        ends = [_descend(few, starts, _BRIEF)]
        if task.far:
            log = FrfLeastSquares(residual="log").objective(few.targets())
            ends.append(_descend(few, starts[int(np.argmin(log.costs(starts)))][None], _BRIEF))
            ends.append(_descend(few, self._robustly(few, self._afresh(few, starts), _BRIEF)[None], _BRIEF))
        return _best(problem, np.array([values for values, _ in ends]))

    def _thorough(self, task: Task) -> Trial:
        """From the values given and, as a local minimum looks like a wrong model, from several other starts;
        then on all lines.
        """
        problem = self._model("thin", task)
        if task.how == "onward":
            return self._on_all_lines(problem, task, [(problem.initial, 0.0)], _ON_ALL_LINES)
        if problem.nuisances.entries:
            return self._thorough_with_errors(problem, task)
        given = problem.initial[None]
        ends = [_descend(problem, given, _QUICK)]
        simulated = any(
            effect.of_amplitude for effect in task.effects
        )  # which takes too long for more than one start
        for fresh in self._others(problem, given):
            if simulated or min(cost for _, cost in ends) <= QUIET:
                break
            ends.append(_descend(problem, self._robustly(problem, fresh[None], _QUICK)[None], _QUICK))
        return self._on_all_lines(problem, task, ends, _THOROUGH)

    def _thorough_with_errors(self, problem: Problem, task: Task) -> Trial:
        """The same with errors of what was told, which are led to the likelihood from nothing."""
        held, ends = without_errors(problem), list[tuple[Array, float]]()
        for start in (problem.initial, *self._afresh(problem, problem.initial[None])):
            robust = start if not ends else _descend(held, start[None], _QUICK, _logarithmic(held))[0]
            ends.append(likely(problem, robust, _TO_LIKELIHOOD))
            if min(cost for _, cost in ends) <= QUIET:
                break
        return self._on_all_lines(problem, task, ends, _ON_ALL_LINES)

    def _on_all_lines(
        self, problem: Problem, task: Task, ends: Sequence[tuple[Array, float]], optimizer: Optimizer
    ) -> Trial:
        """The best of the ends (values, cost) of some lines, refitted."""
        values = min(ends, key=lambda end: end[1])[0]
        problem = self._model("whole", replace(task, values=_named(problem, values)))
        values, cost = _descend(problem, problem.initial[None], optimizer)
        count, found = _count(problem, "fit"), _named(problem, values)
        squares, validation = self._elsewhere(problem, task, found)
        return Trial(task, found, cost**2 * count, count, squares, validation, _free(problem))

    def _others(self, problem: Problem, given: Array) -> Iterator[Array]:
        """Further starts (parameters,): the study's own values beside the found ones; all parameters at their
        defaults.
        """
        yield self._afresh(problem, given)[0]
        yield with_effects(problem, problem.file.study.effects, {}).initial

    def _afresh(self, problem: Problem, starts: Array) -> Array:
        """Starts (m, parameters) with the study's own start values for all that the study knows."""
        fresh = starts.copy()
        for number, p in enumerate(problem.parameters):
            fresh[:, number] = self._initial.get(p.name, starts[:, number])
        return fresh

    def _robustly(self, problem: Problem, starts: Array, optimizer: Optimizer) -> Array:
        """Where logarithmic residuals, whose valley is wide, lead from the best of the starts (m,
        parameters).
        """
        return _descend(
            problem, starts, optimizer, FrfLeastSquares(residual="log").objective(problem.targets())
        )[0]

    def _elsewhere(self, problem: Problem, task: Task, found: Mapping[str, float]) -> tuple[float, int]:
        """Sum of squares and count on data that were not fitted: those for validation, or channels left out
        of one more fit.
        """
        if not self._validated:
            problem = self._model("kept", replace(task, values=found))
            values = _descend(problem, problem.initial[None], _QUICK)[0]
        else:
            values = problem.at(found)
        if not _count(problem, "validate"):
            return float("nan"), 0
        return predictive_squares(problem, fitted_information(problem, values), values)

    def _model(self, lines: str, task: Task) -> Problem:
        """The problem with the effects of a task; the known ones are kept assembled, because many tasks share
        them.
        """
        if lines == "thin" and task.anchor:
            return self._anchored(task)
        problem: Problem = getattr(self, lines)
        if tuple(problem.file.study.effects) != task.known:
            problem = with_effects(problem, task.known, {})
            setattr(self, lines, problem)
        return with_effects(problem, task.effects, task.values)

    def _anchored(self, task: Task) -> Problem:
        """The problem without the known effects that depend on amplitude, their part at the anchor taken off
        the data.
        """
        linear = [effect for effect in task.known if not effect.of_amplitude]
        if self._corrected is None or self._corrected[0] != (task.known, task.anchor):
            simulated, without = (
                with_effects(self.thin, effects, task.anchor) for effects in (task.known, linear)
            )
            pairs = zip(simulated.measurements, without.measurements, strict=True)
            corrected = replace(
                without,
                measurements=tuple(_corrected(one, other, simulated, without) for one, other in pairs),
            )
            self._corrected = (task.known, task.anchor), with_effects(corrected, linear, {})
        return with_effects(self._corrected[1], [*linear, *task.new], task.values)

    def _starts(self, problem: Problem, task: Task) -> Array:
        """(m, parameters): what is known stays where it is, what is new goes over its grid, effect by
        effect.
        """
        system, parameters, found = problem.measurements[0].system, problem.parameters, []
        for number, (effect, own) in enumerate(system.effects):
            new = [n for n in own if parameters[n].free and parameters[n].name not in task.values]
            if new:
                every = effect.terms(problem.robot, system.site, f"effects.{number}")
                terms = [replace(every[n - own[0]], parameter=parameters[n]) for n in new]
                grid = effect.initial_values(terms, self._band)
                found.append(np.repeat(problem.initial[None], len(grid), axis=0))
                found[-1][:, new] = grid
        return np.concatenate(found) if found else problem.initial[None]


def thinned(problem: Problem) -> Problem:
    """The same problem with few frequency lines in every measurement that is fitted, and no other
    measurement.
    """

    fitted = [m for m in problem.measurements if m.settings.use == "fit"]
    wanted = max(_FEWEST, _LINES // len(fitted))

    def fewer(m: Measurement) -> Measurement:
        if not isinstance(m.target, FrfTarget):
            return m
        lines = (
            np.arange(len(m.target.data.frequency_hz))
            % max(1, round(len(m.target.data.frequency_hz) / wanted))
            == 0
        )
        data, noise = m.target.data.lines(lines), None if m.target.noise is None else m.target.noise[lines]
        given: Given = replace(m.given, data=data, noise=noise)
        return replace(m, given=given, target=replace(m.target, data=data, noise=noise))

    return replace(problem, measurements=tuple(fewer(m) for m in fitted))


def narrowed(problem: Problem) -> Problem:
    """The same problem with a third of the response channels of every set that has many; all where the
    measurement has effects too.
    """

    def fewer(m: Measurement) -> Measurement:
        t = m.target
        if not isinstance(t, FrfTarget) or t.readings or len(t.data.outputs) < _MANY:
            return m
        chosen = np.flatnonzero(_third(len(t.data.outputs)))
        data, noise = (
            t.data.pairs(chosen.tolist(), list(range(len(t.data.inputs)))),
            None if t.noise is None else t.noise[:, chosen],
        )
        placed = t.nuisances and t.nuisances.of_outputs(chosen)
        return replace(m, target=replace(t, data=data, noise=noise, out=t.out[chosen], nuisances=placed))

    return replace(problem, measurements=tuple(fewer(m) for m in problem.measurements))


def _fewer_channels(problem: Problem, task: Task) -> Problem:
    """A third of the channels, where these have plenty of numbers for each parameter and no effect changes
    single ones of them.
    """
    few = narrowed(problem)
    single = any(effect.of_measurement for effect in task.effects)
    return few if not single and _count(few, "fit") > _PLENTY * _free(problem) else problem


def _third(channels: int) -> NDArray[np.bool_]:
    """Which of so many channels, in threes of directions, belong to a third that has all directions."""
    number = np.arange(channels)
    return np.asarray((number + number // 3) % 3 == 1)


def _corrected(one: Measurement, other: Measurement, simulated: Problem, without: Problem) -> Measurement:
    """A measurement less what the effects that `simulated` has and `without` has not do to its FRFs, at their
    present values.
    """
    if not isinstance(one.target, FrfTarget) or not isinstance(other.target, FrfTarget):
        return other
    part = one.target.predict(simulated.initial) - other.target.predict(without.initial)
    data = replace(other.target.data, frf=other.target.data.frf - part)
    return replace(other, given=replace(other.given, data=data))


def left_out(problem: Problem) -> Problem:
    """The same problem with a third of the response channels of every fitted measurement set aside for
    validation.
    """

    def part(m: Measurement, aside: bool) -> Measurement:
        assert isinstance(m.target, FrfTarget)
        chosen = np.flatnonzero(_third(len(m.target.data.outputs)) == aside).tolist()
        data = m.target.data.pairs(chosen, list(range(len(m.target.data.inputs))))
        noise = None if m.target.noise is None else m.target.noise[:, chosen]
        use: Literal["fit", "validate"] = "validate" if aside else "fit"
        given = replace(m.given, data=data, noise=noise, settings=m.settings.model_copy(update={"use": use}))
        return replace(m, given=given)

    split = [
        part(m, aside)
        for m in problem.measurements
        if isinstance(m.target, FrfTarget) and m.settings.use == "fit" and len(m.target.data.outputs) > 2
        for aside in (False, True)
    ]
    whole = replace(problem, measurements=tuple(split) or problem.measurements)
    return with_effects(whole, problem.file.study.effects, {})


def _best(problem: Problem, starts: Array) -> tuple[Array, float]:
    """The best of the starts (m, parameters) as they are, and its cost."""
    costs = likelihood(problem).costs(starts)
    return starts[int(np.argmin(costs))], float(costs.min())


def _descend(
    problem: Problem, starts: Array, optimizer: Optimizer, objective: Objective | None = None
) -> tuple[Array, float]:
    """Down from the best of the starts (m, parameters): values (parameters,) and cost, of the
    likelihood if none is given.
    """
    objective = objective or likelihood(problem)
    best = int(np.argmin(objective.costs(starts))) if len(starts) > 1 else 0
    return minimized(problem, starts[best], optimizer, objective)


def from_each(problem: Problem, starts: Array, optimizer: GaussNewton) -> Array:
    """Where logarithmic residuals lead from the starts (m, parameters) that change what they see; the best.

    A resonator's valley is as narrow as its peak, so that the best of a grid of starts is one that does
    nothing.
    """
    objective = _logarithmic(problem)
    costs = objective.costs(starts)
    seen = np.abs(costs / costs.min() - 1) > _SEEN
    tried = starts[seen] if seen.any() else starts[:1]
    ends = [_descend(problem, one[None], optimizer, objective) for one in tried]
    return min(ends, key=lambda end: end[1])[0]


def likelihood(problem: Problem) -> Objective:
    """What is fitted, in as few rows as say the same where no errors are fitted along."""
    targets = problem.targets()
    if targets.nuisances:
        return FrfLeastSquares().objective(targets)
    return FrfLeastSquaresObjective(FrfLeastSquares(), targets, shortened=True)


def _logarithmic(problem: Problem) -> Objective:
    return FrfLeastSquares(residual="log").objective(problem.targets())


def _squares(problem: Problem, values: Array, use: str) -> float:
    """Sum of squared residuals over noise."""
    cost = float(FrfLeastSquares().objective(problem.targets(use)).costs(values[None])[0])
    return cost**2 * _count(problem, use)


def _count(problem: Problem, use: str) -> int:
    """How many real numbers were measured."""
    return sum(2 * target.measured.size for target in problem.targets(use).frf)


def _free(problem: Problem) -> int:
    found = sum(effect.settings_found for effect in problem.file.study.effects)
    return found + sum(p.free for p in problem.parameters[: problem.size])


def _named(problem: Problem, values: Array) -> dict[str, float]:
    return {p.name: float(v) for p, v in zip(problem.parameters, values, strict=True)}
