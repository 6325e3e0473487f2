"""The fit loop, written once: several starts, each through the stages of the study; the best point is kept.

What a fit says about itself afterwards (intervals, what the data do not determine) is in
`identify.fitting.uncertainty`; what is kept of it on disk in `identify.results.fit`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Parameter, Scale
from identify.core.thresholds import QUIET
from identify.fitting.journal import Journal
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Ended, Optimizer, Outcome, Search
from identify.vibration.costs.base import parse_cost

_SAME = 1e-3
"""Relative difference of cost below which two starts are said to have found the same minimum."""
ENOUGH = 3
"""That many starts in the best minimum end the fit early, if the gap is noise."""


class FittedFile(Protocol):
    """A study with its file."""

    @property
    def study(self) -> Any:
        """A study: `cost`, `stages`, `last_resort`, `starts`, `start_factor`, `target_cost` and `seed` are
        read of it.
        """


class Fittable(Protocol):
    """What can be fitted: a study, its parameters, and what its cost compares (`identify.vibration.problem`,
    `identify.motion.problem`).
    """

    @property
    def file(self) -> FittedFile:
        """The study with its file."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, fixed ones too."""

    @property
    def initial(self) -> Array:
        """Where the search starts, (parameters,)."""

    def targets(self, use: str = "fit", names: Sequence[str] | None = None) -> Any:
        """What the study's cost compares, of these measurements or of all."""


@dataclass(frozen=True)
class Start:
    """One start and where it led: values of all parameters before and after, the cost after, and how its last
    stage ended.
    """

    initial: Array
    final: Array
    cost: float
    evaluations: int
    seconds: float
    converged: bool
    sentence: str


@dataclass(frozen=True)
class Fit:
    """The outcome of a fit.  history rows: start, stage, evaluations in the stage, best cost in the stage,
    seconds since the beginning.
    """

    values: Array
    cost: float
    starts: tuple[Start, ...]
    history: Array
    seconds: float

    @property
    def best(self) -> Start:
        """The start that led to the best point."""
        return min(self.starts, key=lambda start: start.cost)

    @property
    def agreeing(self) -> int:
        """How many starts found the best minimum."""
        return agreeing([start.cost for start in self.starts])


@dataclass(frozen=True)
class Stage:
    """One stage: what searches, what it minimises, and which parameters (parameters,) it moves."""

    optimizer: Optimizer
    objective: Objective
    moves: NDArray[np.bool_]


@dataclass
class Progress:
    """What goes along with a fit: `show` is told of every step as (start, starts, stage kind, evaluations,
    best cost in the stage), the journal remembers costs, rows are the history.
    """

    show: Callable[[int, int, str, int, float], None] = lambda start, starts, kind, evaluations, best: None
    journal: Journal = field(default_factory=Journal)
    began: float = field(default_factory=time.perf_counter)
    rows: list[tuple[float, ...]] = field(default_factory=list)


def fit(problem: Fittable, progress: Progress | None = None) -> Fit:
    """Fit a problem as its study says; the same seed gives the same result.

    Raises InputError where the data cannot move a free parameter, or the model has no solution at any start.
    """
    study, progress = problem.file.study, progress or Progress()
    objective = study.cost.objective(problem.targets())
    scale = Scale(problem.parameters)
    check_moves(problem, objective)
    starts: list[Start] = []
    stages = _stages(study.stages, problem, objective)
    for number, x in enumerate(starting_points(problem, scale)):
        starts.append(_run(number, x, stages, objective, scale, problem, progress))
        if _settled(starts, study):
            break
    if study.last_resort and len(starts) > 1 and not _settled(starts, study):
        x = scale.to_x(min(starts, key=lambda start: start.cost).final)
        starts.append(
            _run(
                len(starts),
                x,
                _stages(study.last_resort, problem, objective),
                objective,
                scale,
                problem,
                progress,
            )
        )
    winner = min(starts, key=lambda start: start.cost)
    if not np.isfinite(winner.cost):
        raise InputError(
            "effects", "the model has no solution at any start", "better start values", "set `initial`"
        )
    history = np.array(progress.rows).reshape(-1, 5)
    return Fit(winner.final, winner.cost, tuple(starts), history, time.perf_counter() - progress.began)


def _stages(optimizers: Sequence[Optimizer], problem: Fittable, objective: Objective) -> list[Stage]:
    """Each optimizer with its own cost or the study's, on its own measurements or all, for its own parameters
    or all.
    """
    stages, names = [], [parameter.name for parameter in problem.parameters]
    for number, one in enumerate(optimizers):
        own = objective
        if one.cost or one.measurements:
            own = (one.cost or problem.file.study.cost).objective(problem.targets(names=one.measurements))
        moves = np.ones(len(names), dtype=bool)
        if one.parameters:
            moves = np.array(
                [any(fnmatchcase(name, pattern) for pattern in one.parameters) for name in names]
            )
            if not any(p.free and moved for p, moved in zip(problem.parameters, moves, strict=True)):
                found = f"no free parameter is called {' or '.join(one.parameters)}"
                raise InputError(
                    f"optimizer.{number}.parameters",
                    found,
                    "names such as " + ", ".join(names[:3]),
                    "`*` stands for any part",
                )
        stages.append(Stage(one, own, moves))
    return stages


def _settled(starts: Sequence[Start], study: Any) -> bool:
    """Whether the best minimum is beyond doubt: at its target, or found by several starts, and no more than
    noise where that is known.

    A local minimum looks exactly like something missing from the model, so a gap above noise is not believed
    early.
    """
    best = min(start.cost for start in starts)
    plausible = best <= QUIET or study.cost != parse_cost("frf-least-squares")
    return best <= study.target_cost or (plausible and agreeing([start.cost for start in starts]) >= ENOUGH)


def agreeing(costs: Sequence[float]) -> int:
    """How many of these costs are those of the best minimum."""
    best = min(costs)
    return sum(bool(np.isfinite(cost) and cost - best <= _SAME * max(best, 1e-12)) for cost in costs)


def _run(
    number: int,
    x: Array,
    stages: Sequence[Stage],
    objective: Objective,
    scale: Scale,
    problem: Fittable,
    progress: Progress,
) -> Start:
    began, initial, evaluations = time.perf_counter(), scale.to_values(x), 0
    outcome, values = Outcome(False, "no stage ran"), initial
    study = problem.file.study
    for position, stage in enumerate(stages):

        def watch(
            count: int, best: float, position: int = position, kind: str = stage.optimizer.kind
        ) -> None:
            progress.rows.append((number, position, count, best, time.perf_counter() - progress.began))
            progress.show(number, study.starts, kind, count, best)

        target = study.target_cost if stage.objective is objective else 0.0
        part = _part(problem, stage, values)
        search = Search(stage.objective, part, stage.optimizer.evaluations, target, watch, progress.journal)
        try:
            outcome = stage.optimizer.minimize(
                search, part.to_x(values), np.random.default_rng([study.seed, number, position])
            )
        except Ended as end:
            outcome = Outcome(end.reached, end.reason)
        values = values if search.best_x is None else part.to_values(search.best_x)
        evaluations += search.evaluations
    cost = float(objective.costs(values[None])[0])
    return Start(
        initial, values, cost, evaluations, time.perf_counter() - began, outcome.converged, outcome.sentence
    )


def _part(problem: Fittable, stage: Stage, values: Array) -> Scale:
    """The parameters that a stage moves; the others are held at their present values (parameters,)."""
    rows = zip(problem.parameters, values.tolist(), stage.moves.tolist(), strict=True)
    return Scale(tuple(replace(p, initial=value, free=p.free and moved) for p, value, moved in rows))


def starting_points(problem: Fittable, scale: Scale) -> list[Array]:
    """The initial values, then a Latin hypercube: within the start factor on log scales, within the bounds on
    linear ones.
    """
    from scipy.stats import qmc  # noqa: PLC0415  importing it takes as long as all else together

    study = problem.file.study
    first = scale.to_x(problem.initial)
    if study.starts == 1:
        return [first]
    lower, upper = scale.bounds()
    log = np.array([parameter.log for parameter in problem.parameters if parameter.free])
    reach = np.log(study.start_factor)
    low, high = (
        np.where(log, np.maximum(lower, first - reach), lower),
        np.where(log, np.minimum(upper, first + reach), upper),
    )
    sampler = qmc.LatinHypercube(len(first), rng=np.random.default_rng([study.seed, 0x5747]))
    return [first, *(low + sampler.random(study.starts - 1) * (high - low))]


def check_moves(problem: Fittable, objective: Objective) -> None:
    """Raise an InputError that names the free parameters to which the cost is blind at the start."""
    scale = Scale(problem.parameters)
    initial = problem.initial
    residuals, slopes = objective.residuals(initial, scale.free)
    if not np.isfinite(residuals).all():
        return
    moves = np.linalg.norm(slopes * scale.slope(scale.to_x(initial)), axis=0)
    still = [
        problem.parameters[n].name
        for n, size in zip(scale.free, moves, strict=True)
        if size <= 1e-12 * moves.max(initial=0.0)
    ]
    if still:
        fix = "set `fixed: true` for it, remove the effect, or measure where it moves"
        raise InputError(
            "effects",
            f"no measured data can move {', '.join(still)}",
            "free parameters that the data depend on",
            fix,
        )
