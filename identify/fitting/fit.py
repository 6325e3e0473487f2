"""The fit loop, written once: several starts, each through the stages of the plan; the best point is kept.

What a fit says about itself afterwards (intervals, what the data do not determine) is in
`identify.fitting.uncertainty`; what is kept of it on disk in `identify.results.fit`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Parameter, Scale
from identify.fitting.memory import Journal
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Outcome, Search, minimized
from identify.fitting.plan import FitPlan, Stage
from identify.fitting.processes import Processes

_SAME = 1e-3
"""Relative difference of cost below which two starts are said to have found the same minimum."""
ENOUGH = 3
"""That many starts in the best minimum end the fit early, if the gap is noise."""


@dataclass(frozen=True)
class Start:
    """One start and where it led: values of all parameters before and after, the cost after, and how its last
    stage ended: converged, or as its optimizer always does; spent: with its budget.
    """

    initial: Array
    final: Array
    cost: float
    evaluations: int
    seconds: float
    converged: bool
    sentence: str
    spent: bool = False


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
    def end_note(self) -> list[str]:
        """A note on how the best start ended, where a reader must know; empty otherwise."""
        if not self.best.converged:
            return [f"the best start did not converge: {self.best.sentence}"]
        if not self.best.spent:
            return []
        return [
            f"{self.best.sentence}; this optimizer ends in no other way, so a better minimum may exist: add a"
            " last stage `gauss-newton`, or a larger budget, to find out"
        ]

    @property
    def agreeing(self) -> int:
        """How many starts found the best minimum."""
        return agreeing([start.cost for start in self.starts])


@dataclass(frozen=True)
class Led:
    """Where a stage, by its number, led from values (parameters,): values after it and how it ended; rows:
    evaluations, best cost and seconds since its start began, for the history; records: of the journal.
    """

    position: int
    before: Array
    after: Array
    outcome: Outcome
    evaluations: int
    rows: tuple[tuple[int, float, float], ...]
    records: tuple[bytes, ...] = ()


@dataclass
class Progress:
    """What goes along with a fit: `show` is told of every step as (start, starts, stage kind, evaluations,
    best cost in the stage, NaN where that is not the cost of the result), the journal remembers costs, rows
    are the history; led: where stages, by number, led from where; `ended` is told when all starts have.
    """

    show: Callable[[int, int, str, int, float], None] = lambda start, starts, kind, evaluations, best: None
    journal: Journal = field(default_factory=Journal)
    began: float = field(default_factory=time.perf_counter)
    rows: list[tuple[float, ...]] = field(default_factory=list)
    led: list[Led] = field(default_factory=list)
    ended: Callable[[], None] = lambda: None


def fit(plan: FitPlan, progress: Progress | None = None, workers: Processes | None = None) -> Fit:
    """Fit as the plan says; the same plan gives the same result, by however many workers, which run starts
    side by side.

    Raises InputError where the data cannot move a free parameter, or the model has no solution at any start.
    """
    progress = progress or Progress()
    scale = Scale(plan.parameters)
    check_moves(plan.parameters, plan.objective)
    starts: list[Start] = []
    for start in _every(plan, progress, workers):
        starts.append(start)
        if _settled(starts, plan):
            break
    if plan.last_resort and len(starts) > 1 and not _settled(starts, plan):
        x = scale.to_x(min(starts, key=lambda start: start.cost).final)
        starts.append(_run(len(starts), x, plan.last_resort, plan, progress))
    winner = min(starts, key=lambda start: start.cost)
    if not np.isfinite(winner.cost):
        raise InputError(
            "effects", "the model has no solution at any start", "better start values", "set `initial`"
        )
    progress.ended()
    history = np.array(progress.rows).reshape(-1, 5)
    return Fit(winner.final, winner.cost, tuple(starts), history, time.perf_counter() - progress.began)


def _every(plan: FitPlan, progress: Progress, workers: Processes | None) -> Iterator[Start]:
    """The starts in order; workers run as many as they are side by side, once an interrupted run has caught
    up.
    """
    points = list(enumerate(starting_points(plan.parameters, plan.starts, plan.start_factor, plan.seed)))
    while points:
        if workers is None or not progress.journal.exhausted:
            together, ahead = points[:1], None
        else:
            together = points[: workers.count]
            ahead = _Ahead(plan, workers, together, list(progress.led))
        for number, x in together:
            yield _run(number, x, plan.stages, plan, progress, ahead)
        points = points[len(together) :]


class _Ahead:
    """Some starts, by number and x (free,), side by side: stage by stage, so that none is run that an earlier
    one of them begins as well, each when the first of them comes to it, so that a run that is killed has all
    stages of that one; known: where stages of earlier starts led.
    """

    def __init__(
        self, plan: FitPlan, workers: Processes, starts: Sequence[tuple[int, Array]], known: list[Led]
    ) -> None:
        self._plan, self._workers, self._known = plan, workers, known
        self._values = {number: Scale(plan.parameters).to_values(x) for number, x in starts}
        self._found: list[dict[int, Led]] = []

    def led(self, number: int, position: int, values: Array) -> Led | None:
        """Where a stage of a start led; None where it was not run from these very values (parameters,)."""
        while len(self._found) <= position:
            self._found.append(self._next(len(self._found)))
        found = self._found[position].get(number)
        return found if found is not None and np.array_equal(found.before, values) else None

    def _next(self, position: int) -> dict[int, Led]:
        """The next stage of those starts that are not spared it."""
        stage, plan = self._plan.stages[position], self._plan
        begun = [one.before for one in self._known if one.position == position]
        own, which = list[int](), dict[int, int]()
        for number, before in self._values.items():
            alike = _alike(stage, before, begun, plan)
            which[number] = len(begun) if alike is None else alike
            if alike is None:
                begun.append(before)
                own.append(number)
        jobs = [(number, position, self._values[number]) for number in own]
        found = dict(zip(own, self._workers.ordered(plan, _job, jobs), strict=True))
        self._known += found.values()
        there = [one for one in self._known if one.position == position]
        self._values = {number: there[at].after for number, at in which.items()}
        return found


def _job(plan: FitPlan, asked: tuple[int, int, Array]) -> Led:
    """A stage from values (parameters,), by the numbers of its start and its own."""
    number, position, values = asked
    progress = Progress(journal=Journal(made=[]))
    return _stage((number, position), plan.stages[position], values, plan, progress, progress.began)


def _settled(starts: Sequence[Start], plan: FitPlan) -> bool:
    """Whether the best minimum is beyond doubt: at its target, or found by several starts and believed.

    A local minimum looks exactly like something missing from the model, so a gap above noise is not believed
    early where the noise is known.
    """
    best = min(start.cost for start in starts)
    found = agreeing([start.cost for start in starts])
    return best <= plan.target_cost or (best <= plan.believed_cost and found >= ENOUGH)


def agreeing(costs: Sequence[float]) -> int:
    """How many of these costs are those of the best minimum."""
    best = min(costs)
    return sum(bool(np.isfinite(cost) and cost - best <= _SAME * max(best, 1e-12)) for cost in costs)


def _run(
    number: int,
    x: Array,
    stages: Sequence[Stage],
    plan: FitPlan,
    progress: Progress,
    ahead: _Ahead | None = None,
) -> Start:
    """One start, from x (free,) through these stages; ahead: runs it beside others."""
    began, initial, evaluations = time.perf_counter(), Scale(plan.parameters).to_values(x), 0
    outcome, values, spent = Outcome(False, "no stage ran"), initial, 0.0
    for position, stage in enumerate(stages):
        known = _led(position, stage, values, plan, progress)
        if known is None:
            known = None if ahead is None else ahead.led(number, position, values)
            if known is None:
                known = _stage((number, position), stage, values, plan, progress, began)
            else:
                _taken(number, stage, known, plan, progress)
            evaluations += known.evaluations
            spent = max([spent, *(row[2] for row in known.rows)])
            progress.led.append(known)
        values, outcome = known.after, known.outcome
    cost = float(plan.objective.at(values).costs(values[None])[0])
    seconds = max(time.perf_counter() - began, spent)
    return Start(
        initial, values, cost, evaluations, seconds, outcome.converged, outcome.sentence, outcome.spent
    )


def _stage(
    at: tuple[int, int], stage: Stage, values: Array, plan: FitPlan, progress: Progress, began: float
) -> Led:
    """A stage, by the numbers of its start and its own, from values (parameters,)."""
    number, position = at
    rows, made = list[tuple[int, float, float]](), progress.journal.made
    before = 0 if made is None else len(made)

    def watch(count: int, best: float) -> None:
        now = time.perf_counter()
        rows.append((count, best, now - began))
        progress.rows.append((number, position, count, best, now - progress.began))
        progress.show(number, plan.starts, stage.optimizer.kind, count, _shown(stage, plan, best))

    own = stage.objective is plan.objective
    target, far = (plan.target_cost, plan.far) if own else (0.0, np.inf)
    part = _part(plan.parameters, stage, values)
    objective = stage.objective.at(values)
    search = Search(objective, part, stage.optimizer.evaluations, target, watch, progress.journal, far=far)
    rng = np.random.default_rng([plan.seed, number, position])
    outcome = minimized(stage.optimizer, search, part.to_x(values), rng)
    after = values if search.best_x is None else part.to_values(search.best_x)
    records = () if made is None else tuple(made[before:])
    return Led(position, values, after, outcome, search.evaluations, tuple(rows), records)


def _taken(number: int, stage: Stage, led: Led, plan: FitPlan, progress: Progress) -> None:
    """A stage that a worker ran counts as if it had been run here and now."""
    progress.journal.take(led.records)
    since = time.perf_counter() - progress.began
    for count, best, _ in led.rows:
        progress.rows.append((number, led.position, count, best, since))
    for count, best, _ in led.rows[-1:]:
        progress.show(number, plan.starts, stage.optimizer.kind, count, _shown(stage, plan, best))


def _shown(stage: Stage, plan: FitPlan, best: float) -> float:
    """The best cost of a stage, NaN where that is not the cost of the result."""
    return best if stage.objective is plan.objective else np.nan


def _led(position: int, stage: Stage, values: Array, plan: FitPlan, progress: Progress) -> Led | None:
    """Where a stage led that began at these values in an earlier start; None where none did."""
    there = [one for one in progress.led if one.position == position]
    alike = _alike(stage, values, [one.before for one in there], plan)
    return None if alike is None else there[alike]


def _alike(stage: Stage, values: Array, begun: Sequence[Array], plan: FitPlan) -> int | None:
    """The number of the first values (parameters,) from which a stage leads where it leads from these."""
    if not plan.alike or stage.optimizer.kind != "gauss-newton":
        return None
    scale = Scale(plan.parameters)
    x = scale.to_x(values)
    apart = (np.abs(scale.to_x(before) - x).max(initial=0.0) for before in begun)
    return next((number for number, far in enumerate(apart) if far <= plan.alike), None)


def _part(parameters: Sequence[Parameter], stage: Stage, values: Array) -> Scale:
    """The parameters that a stage moves; the others are held at their present values (parameters,)."""
    rows = zip(parameters, values.tolist(), stage.moves.tolist(), strict=True)
    return Scale(tuple(p.at(value, free=p.free and moved) for p, value, moved in rows))


def starting_points(parameters: tuple[Parameter, ...], starts: int, factor: float, seed: int) -> list[Array]:
    """The initial values, then a Latin hypercube: within the factor on log scales, within the bounds on
    linear ones, nuisances as they are; each (free,) on the search scale.
    """
    scale = Scale(parameters)
    first = scale.to_x(np.array([parameter.initial for parameter in parameters]))
    if starts == 1:
        return [first]
    lower, upper = scale.bounds()
    log = np.array([parameter.log for parameter in parameters if parameter.free])
    drawn = np.array([not parameter.nuisance for parameter in parameters if parameter.free])
    reach = np.log(factor)
    low, high = (
        np.where(log, np.maximum(lower, first - reach), lower),
        np.where(log, np.minimum(upper, first + reach), upper),
    )
    rng = np.random.default_rng([seed, 0x5747]).spawn(1)[0]
    cube = latin_hypercube(starts - 1, int(drawn.sum()), rng)
    points = np.tile(first, (starts - 1, 1))
    points[:, drawn] = low[drawn] + cube * (high - low)[drawn]
    return [first, *points]


def latin_hypercube(count: int, size: int, rng: np.random.Generator) -> Array:
    """Points (count, size) in the unit cube, one in each of `count` slices along each axis: those of
    scipy.stats.qmc.LatinHypercube with the parent of this generator, bit for bit; that takes half a second to
    import.
    """
    within = rng.uniform(size=(count, size))
    slices = np.tile(np.arange(1, count + 1), (size, 1))
    for row in slices:
        rng.shuffle(row)
    return np.asarray((slices.T - within) / count)


def check_moves(parameters: tuple[Parameter, ...], objective: Objective) -> None:
    """Raise an InputError that names the free parameters to which the cost is blind at the start."""
    if names := unmoving(parameters, objective):
        fix = "set `fixed: true` for it, remove the effect, or measure where it moves"
        raise InputError(
            "effects",
            f"no measured data can move {', '.join(names)}",
            "free parameters that the data depend on",
            fix,
        )


def unmoving(parameters: tuple[Parameter, ...], objective: Objective) -> list[str]:
    """Names of the free parameters to which the cost is blind at the start."""
    scale = Scale(parameters)
    initial = np.array([parameter.initial for parameter in parameters])
    squares = np.diag(objective.product(initial, scale.free))
    if not np.isfinite(squares[-1]):
        return []
    moves = np.sqrt(squares[:-1]) * scale.slope(scale.to_x(initial))
    least = 1e-12 * moves.max(initial=0.0)
    return [parameters[n].name for n, size in zip(scale.free, moves, strict=True) if size <= least]
