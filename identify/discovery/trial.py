"""One model tried: effects refitted to the data, quickly on a thinned set of lines or thoroughly on all of
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import QUIET
from identify.discovery.evidence import SMALL
from identify.discovery.places.job import Known, PlaceJob
from identify.discovery.places.screen import PlaceFitter
from identify.discovery.softly import (
    LEADING,
    SOFT,
    as_told,
    at_likelihood,
    best_softly,
    led,
    led_by_links,
    led_from_nothing,
    likely,
    minimized,
    on_to_likelihood,
    with_no_errors,
)
from identify.discovery.task import Task, Trial
from identify.discovery.thinned import count_of, free_of, left_out, less_by, thinned
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Optimizer
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.fitting.optimizers.levenberg_marquardt import LevenbergMarquardt
from identify.model.effects.base import Effect
from identify.model.effects.pre_trigger import PRE_TRIGGER, valleys
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, FrfLeastSquaresObjective
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, with_effects
from identify.vibration.softened import SOFTNESS
from identify.vibration.uncertainty import fitted_information, predictive_squares

_BRIEF = GaussNewton(evaluations=5, tolerance=1e-3)
_QUICK = GaussNewton(evaluations=25, tolerance=1e-4)
_NEAREST = 4
"""Starts that are followed for a few steps before one of them is."""
_STEP, _STEPS = GaussNewton(evaluations=2), 3
_SEEN, _SPOILT = 0.03, 1.2
"""Share of the cost by which a start must change it to be followed; how many times the least cost it may
come to."""
_NEARLY, _BETTER = 1.2, 0.99
"""How many times the cost of the best valley another one may leave where residuals count for little, to be
followed to the likelihood; that of a given one, to be a better one."""
_SAME = 1e-3
"""Relative difference of cost within which two starts ended in the same valley."""
_FEW_STEPS = LevenbergMarquardt(steps=6, tolerance=2e-2)
_TO_THE_END = LevenbergMarquardt(steps=30, tolerance=1e-3)
_ONE_STEP = LevenbergMarquardt(steps=1)
_TO_LIKELIHOOD = GaussNewton(evaluations=30, tolerance=1e-4)
_SOFTNESS = {"start": SOFT, "quick": SOFT, "led": LEADING[1]}
_SOFTNESS |= dict.fromkeys(("glance", "brief", "astray"), LEADING[0])
"""By how much less residuals count in each way to try a model with errors of what was told."""
_ON_ALL_LINES = {
    "thorough": GaussNewton(evaluations=30, tolerance=1e-6),
    "onward": GaussNewton(evaluations=12, tolerance=1e-5),
    "settled": GaussNewton(evaluations=30, tolerance=1e-6),
}
"""By what a model is refitted on all lines."""


class TrialRunner:
    """Where models are tried: a problem with all its lines and with few of them."""

    def __init__(self, problem: Problem) -> None:
        self.whole, self.thin = problem, thinned(problem)
        self.kept = self.thin if problem.validated else left_out(self.thin)
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
            return self._thorough(task) if task.how in _ON_ALL_LINES else self._quick(task)
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
        if task.how == "beside":
            values, cost = _descend(problem, starts, _ONE_STEP)
        elif problem.nuisances.entries:
            values, cost = self._softly(problem, starts, task)
        elif task.how == "glance":
            values, cost = _best(problem, starts)
        elif task.how == "start":
            values, cost = _descend(problem, self._robustly(problem, starts, _QUICK)[None], _QUICK)
        elif task.how == "brief":
            values, cost = self._briefly(problem, starts, task)
        else:
            values, cost = _descend(problem, starts, _QUICK)
        count = count_of(problem, "fit")
        if problem.nuisances.entries:
            cost *= _SOFTNESS.get(
                task.how, 1.0
            )  # so that gaps are those of the noise, whatever it counted for
        return Trial(
            task, {**task.values, **_named(problem, values)}, cost**2 * count, count, free=free_of(problem)
        )

    def _softly(self, problem: Problem, starts: Array, task: Task) -> tuple[Array, float]:
        """With errors of what was told fitted along; residuals count for little, so that the errors stay near
        what was stated and what they cannot explain shows.

        A first look starts with what is known afresh and no errors, because those of the present model make
        up for what it lacks; a quick trial of something new goes on from there.
        """
        if task.how == "glance":
            return best_softly(problem, starts, LEADING[0])
        if task.how == "led":
            return led_by_links(problem, problem.initial, LEADING)
        if task.how in ("brief", "astray"):
            start = self._first_start(problem, starts, task)
            return led_by_links(problem, start, LEADING[:1], _FEW_STEPS if task.new else _TO_THE_END)
        if task.how in ("nearby", "likely", "afresh"):
            return self._to_likelihood(problem, task)
        if task.how == "quick" and task.new:
            return led(problem, problem.initial, [SOFT])
        fresh = starts if task.how == "start" else self._afresh(problem, starts)
        robust = self._robustly(as_told(problem), fresh[:, : problem.size], _BRIEF)
        best = best_softly(problem, starts)[0][: problem.size]
        either = with_no_errors(problem, np.array([best, robust]))
        if task.how == "start":
            either = best_softly(problem, either)[0][None]
        near = (led_by_links(problem, one, LEADING)[0] for one in either)
        return min((led(problem, one, [SOFT]) for one in near), key=_cost)

    def _to_likelihood(self, problem: Problem, task: Task) -> tuple[Array, float]:
        """On few lines: from where it is, from where residuals counted for little, or from afresh."""
        if task.how == "nearby":
            return at_likelihood(problem, problem.initial, _TO_LIKELIHOOD)
        if task.how == "likely":
            return on_to_likelihood(problem, problem.initial, _TO_LIKELIHOOD)
        return self._likely_afresh(problem, task)

    def _first_start(self, problem: Problem, starts: Array, task: Task) -> Array:
        """Where a first look starts with errors of what was told: the present model with what is known afresh
        and no errors, because those that it has make up for what it lacks; what is new, beside that; a look
        that went astray, where logarithmic residuals lead, whose valley is wide.

        A resonance of its own is as narrow as its peak: it needs each frequency followed.
        """
        site = problem.measurements[0].system.site
        terms = [{term.quantity for term in effect.terms(problem.robot, site, "")} for effect in task.new]
        told, present = as_told(problem), starts[:, : problem.size]
        if any({"mass", "stiffness"} <= quantities for quantities in terms):
            return with_no_errors(problem, from_each(told, present))
        if task.how == "astray":
            return with_no_errors(problem, self._led_back(told, present, task))
        near = starts if task.new else self._afresh(problem, starts)
        return np.asarray(near[int(np.argmin(_logarithmic(problem).costs(near)))])

    def _led_back(self, told: Problem, present: Array, task: Task) -> Array:
        """Where a few steps by logarithmic residuals lead, without errors of what was told, from the present
        values (m, parameters) or with what is known afresh; two new effects from where each begins, as either
        by itself made up for the other.
        """
        if len(task.new) > 1:
            anew = _anew(told, task)
            told = as_told(self._model("thin", anew))
            present = self._starts(told, anew)
        return self._robustly(told, np.vstack([self._afresh(told, present), present]), _BRIEF)

    def _briefly(self, problem: Problem, starts: Array, task: Task) -> tuple[Array, float]:
        """A few steps from the best of the starts.

        Where the present model is far from the data, also from the best by logarithmic residuals: those see a
        resonance from far, where for the likelihood any other place, or an effect too small to see, is
        better; and with what is known afresh.
        """
        near = [starts]
        if task.far:
            if len(starts) > 1:
                near.append(starts[[int(np.argmin(_logarithmic(problem).costs(starts)))]])
            near.append(self._robustly(problem, self._afresh(problem, starts), _BRIEF)[None])
        return min((_descend(problem, one, _BRIEF) for one in near), key=_cost)

    def _thorough(self, task: Task) -> Trial:
        """From the values given and, as a local minimum looks like a wrong model, from several other starts;
        then on all lines.
        """
        problem = self._model("thin", task)
        if task.how == "thorough" and problem.nuisances.entries:
            return self._thorough_with_errors(problem, task)
        start = retimed(problem, problem.initial)
        if task.how != "thorough":
            if task.how == "settled" and any(p.name not in task.values for p in problem.parameters):
                start = at_likelihood(problem, start, _TO_LIKELIHOOD)[0]  # errors begin, as of a link's form
            return self._on_all_lines(problem, task, [(start, 0.0)], _ON_ALL_LINES[task.how])
        given = start[None]
        ends = [_descend(problem, given, _QUICK)]
        simulated = any(
            effect.of_amplitude for effect in task.effects
        )  # which takes too long for more than one start
        # A new bending link leaves little by its form, which is fitted along where it is settled.
        enough = SMALL if any(effect.has_form for effect in task.new) else QUIET
        for fresh in self._others(problem, given):
            if simulated or min(cost for _, cost in ends) <= enough:
                break
            ends.append(_descend(problem, self._robustly(problem, fresh[None], _QUICK)[None], _QUICK))
        return self._on_all_lines(problem, task, ends, _ON_ALL_LINES["thorough"])

    def _thorough_with_errors(self, problem: Problem, task: Task) -> Trial:
        """The same with errors of what was told, which are led to the likelihood from nothing."""
        ends = [likely(problem, problem.initial, _TO_LIKELIHOOD)]
        if ends[0][1] > QUIET:
            ends.append(self._likely_afresh(problem, task))
        return self._on_all_lines(problem, task, ends, _ON_ALL_LINES["onward"])

    def _likely_afresh(self, problem: Problem, task: Task) -> tuple[Array, float]:
        """From where logarithmic residuals lead from the study's own values, without errors of what was told;
        what is new begins where it is or at any of its starts.

        Where what is new was fitted already, only if that is a better valley than the one it is in while
        residuals count for little.
        """
        told, anew = as_told(problem), _anew(problem, task)
        starts = np.vstack([problem.initial, self._starts(problem, anew)])[:, : problem.size]
        valleys = max(effect.valleys for effect in task.effects)
        nearest = self._nearest(told, self._afresh(told, starts))[:valleys]
        ends = _distinct(_logarithmic(told), [self._robustly(told, end[None], _QUICK) for end in nearest])
        ways = [led_from_nothing(problem, with_no_errors(problem, end)) for end in ends]
        if len(anew.values) < len(task.values):
            most = _BETTER * led(problem, problem.initial, SOFTNESS[-1:])[1]
            ways = [way for way in ways if way[1] < most]
        return _best_way(problem, ways) if ways else _best(problem, problem.initial[None])

    def _nearest(self, problem: Problem, starts: Array) -> Array:
        """Where few steps by logarithmic residuals lead from the best few of starts (m, parameters), the best
        first.
        """
        objective = _logarithmic(problem)
        near = np.argsort(objective.costs(starts))[:_NEAREST]
        ends = np.array([self._robustly(problem, starts[[number]], _BRIEF) for number in near])
        return np.asarray(ends[np.argsort(objective.costs(ends))])

    def _on_all_lines(
        self, problem: Problem, task: Task, ends: Sequence[tuple[Array, float]], optimizer: Optimizer
    ) -> Trial:
        """The best of the ends (values, cost) of some lines, refitted."""
        values = min(ends, key=_cost)[0]
        problem = self._model("whole", replace(task, values=_named(problem, values)))
        if problem.nuisances.entries:
            values, cost = at_likelihood(problem, problem.initial, optimizer)
        else:
            values, cost = _descend(problem, problem.initial[None], optimizer)
        count, found = count_of(problem, "fit"), _named(problem, values)
        squares, validation = self._elsewhere(problem, task, found)
        return Trial(task, found, cost**2 * count, count, squares, validation, free_of(problem))

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
        return _descend(problem, starts, optimizer, _logarithmic(problem))[0]

    def _elsewhere(self, problem: Problem, task: Task, found: Mapping[str, float]) -> tuple[float, int]:
        """Sum of squares and count on data that were not fitted: those for validation, or channels left out
        of one more fit.
        """
        if not self.whole.validated:
            problem = self._model("kept", replace(task, values=found))
            values = _descend(problem, problem.initial[None], _QUICK)[0]
        else:
            values = problem.at(found)
        if not count_of(problem, "validate"):
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
                measurements=tuple(less_by(one, other, simulated, without) for one, other in pairs),
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


def _best(problem: Problem, starts: Array) -> tuple[Array, float]:
    """The best of the starts (m, parameters) as they are, and its cost."""
    costs = likelihood(problem).costs(starts)
    return starts[int(np.argmin(costs))], float(costs.min())


def _distinct(objective: Objective, ends: Sequence[Array]) -> list[Array]:
    """The first of the ends (unknowns,) of each cost: the same cost is the same valley."""
    found: dict[float, Array] = {}
    for end, cost in zip(ends, objective.costs(np.array(ends)), strict=True):
        found.setdefault(next((one for one in found if abs(cost / one - 1) < _SAME), float(cost)), end)
    return list(found.values())


def _best_way(problem: Problem, ways: Sequence[tuple[Array, float]]) -> tuple[Array, float]:
    """The likelihood where some ways (values, cost) lead: the best first, until one passes as noise or the
    next leaves far more.
    """
    least, found = min(map(_cost, ways)), list[tuple[Array, float]]()
    for values, cost in sorted(ways, key=_cost):
        if cost > _NEARLY * least:
            break
        found.append(at_likelihood(problem, values, _TO_LIKELIHOOD))
        if found[-1][1] <= QUIET:
            break
    return min(found, key=_cost)


def _cost(end: tuple[Array, float]) -> float:
    """Of values and their cost."""
    return end[1]


def _descend(
    problem: Problem, starts: Array, optimizer: Optimizer, objective: Objective | None = None
) -> tuple[Array, float]:
    """Down from the best of the starts (m, parameters): values (parameters,) and cost, of the
    likelihood if none is given.
    """
    objective = objective or likelihood(problem)
    best = int(np.argmin(objective.costs(starts))) if len(starts) > 1 else 0
    return minimized(problem, starts[best], optimizer, objective)


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
    return _best(problem, trials)[0]


def from_each(problem: Problem, starts: Array) -> Array:
    """Where logarithmic residuals lead from the starts (m, parameters) that change what they see, and do not
    spoil it; the best.

    A resonator's valley is as narrow as its peak, so that the best of a grid of starts is one that does
    nothing: each takes a step, the better half another one, and so on.
    """
    objective = _logarithmic(problem)
    costs = objective.costs(starts)
    seen = (np.abs(costs / costs.min() - 1) > _SEEN) & (costs < _SPOILT * costs.min())
    tried = [*(starts[seen] if seen.any() else starts[:1])]
    for _ in range(_STEPS):
        ends = sorted((_descend(problem, one[None], _STEP, objective) for one in tried), key=_cost)
        tried = [values for values, _ in ends[: -(-len(ends) // 2)]]
    return ends[0][0]


def _anew(problem: Problem, task: Task) -> Task:
    """The task with no values of what is new."""
    effects = problem.measurements[0].system.effects
    own = {problem.parameters[n].name for effect, numbers in effects if effect in task.new for n in numbers}
    return replace(task, values={name: value for name, value in task.values.items() if name not in own})


def likelihood(problem: Problem) -> Objective:
    """What is fitted, in as few rows as say the same where no errors are fitted along."""
    targets = problem.targets()
    if targets.nuisances:
        return FrfLeastSquares().objective(targets)
    return FrfLeastSquaresObjective(FrfLeastSquares(), targets, shortened=True)


def _logarithmic(problem: Problem) -> Objective:
    return FrfLeastSquares(residual="log").objective(problem.targets())


def _named(problem: Problem, values: Array) -> dict[str, float]:
    return {p.name: float(v) for p, v in zip(problem.parameters, values, strict=True)}
