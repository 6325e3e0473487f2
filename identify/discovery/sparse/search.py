"""From a present model to what is missing: dense fits, units without evidence taken out, what remains by
name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import CONVINCING
from identify.discovery.evidence import CLOSED
from identify.discovery.sparse import names
from identify.discovery.sparse.bounded import bounded_step
from identify.discovery.sparse.dense import (
    in_parts,
    relaxations,
    springs_and_bodies,
    springs_and_instruments,
    with_more,
)
from identify.discovery.sparse.dictionary import candidates, gain_of
from identify.discovery.sparse.evidence import (
    Support,
    Weighed,
    eliminated,
    floor_of,
    inflation,
    supports,
    weighed,
)
from identify.discovery.sparse.mounts import moved_mounts
from identify.discovery.sparse.names import Named
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.unknowns import Unit, Unknowns
from identify.discovery.thinned import below
from identify.fitting.selection.workbench import Story
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_mass import SensorMass
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.model.effects.springs import Springs
from identify.vibration.all_springs import all_springs, usual_stiffness
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem, with_uncertainty

_LOOSE, _ROBUST_STEPS, _LOOSE_STEPS, _STEPS, _AGAIN = 0.3, 6, 12, 30, 6
"""Price of the first steps, by logarithmic residuals and by the likelihood; steps of each stage, and
after units left.
"""
_MORE, _MOST_ENTERED, _TRIED, _PAYS = 12, 8, 2, 3
"""Steps after something entered; how often more may enter, and how many are tried at a time; parameters that
each must pay for at least.
"""
_SHARES = ((1.0,), (0.25, 0.5, 1.0))
"""Of the band: all of it at once, and from low to high."""
_FEW = 2
"""Units that explain the data from rigid bearings, so that no other start can do with much less."""
_SEEN = 1.0
"""Units of what is left that an amplitude must move to be kept for a look at its evidence."""


@dataclass(frozen=True)
class Found:
    """A dense fit: the study's problem and that with all effects, its unknowns, where it ended, its gap and
    objective; effects: what it has beyond the study; product (f + 1, f + 1): [J r]'[J r] there.
    """

    study: Problem
    problem: Problem
    unknowns: Unknowns
    effects: tuple[Effect, ...]
    x: Array
    gap: float
    objective: float
    product: Array

    @property
    def values(self) -> dict[str, float]:
        """Of all unknowns, by name."""
        every = self.unknowns.to_values(self.x)
        return {p.name: float(value) for p, value in zip(self.problem.parameters, every, strict=True)}


Say = Callable[[str], None]
Unseen = Callable[[Problem, Sequence[Effect], dict[str, float]], float]
"""The gap on data that are not fitted."""


@dataclass(frozen=True)
class Explained:
    """What is missing, the most important first, the values of all else by name, and the problem that it is
    missing from: with the forms of links uncertain, where that was looked at.
    """

    named: list[Named]
    values: dict[str, float]
    problem: Problem


def explain(problem: Problem, story: Story | None = None, unseen: Unseen | None = None) -> Explained:
    """What is missing from the model of a problem (few lines suffice).

    unseen: the gap of a problem's effects and values on data that are not fitted.
    """
    story, every = story or Story(), tuple(springs_and_instruments(problem))
    say = story.say
    stated = bool(problem.nuisances.entries)  # masses may be off by what was stated, and move with all else
    fits = list[Found]()
    if not stated:
        fits.append(dense_fit(problem, every, usual=False))
        if fits[-1].gap < CLOSED:
            few = pruned(fits[-1], say, unseen)
            if few[0].gap < CLOSED and len(few[1]) <= _FEW:
                return _said(*few)
    fits.append(dense_fit(problem, every, usual=True))
    if _open(fits) and not stated and not story.late:
        fits.append(dense_fit(problem, tuple(springs_and_bodies(problem)), usual=True))
    if _open(fits) and not story.late:
        fits += _structure_first(problem, every, story)
    best = _best(fits, unseen)
    say(f"Everything that may be missing in the model at once: gap {best.gap:.2f}.")
    return _said(*pruned(best, say, unseen))


def _best(fits: Sequence[Found], unseen: Unseen | None) -> Found:
    """The likeliest; where all leave something open, none of them is the truth, and the one that predicts
    unseen data best is kept.
    """
    if unseen is None or not _open(fits):
        return min(fits, key=_objective)
    return min(fits, key=lambda one: unseen(one.study, one.effects, one.values))


def _structure_first(problem: Problem, every: Sequence[Effect], story: Story) -> Iterator[Found]:
    """The structure alone, with the forms of links uncertain, and, where that leaves something open, with
    the instruments: free sensors make up for shapes that are not there yet, and would keep them out.  What
    then still is open stays out of sensors that no fault of an instrument explains.
    """
    stated = bool(problem.nuisances.entries)
    bending = problem if stated else with_uncertainty(problem, FORMS_ALONE)
    structure = tuple(all_springs(problem, shrink=True))
    starts = [dense_fit(bending, structure, usual=True, shares=shares) for shares in _SHARES]
    found = _further(min(starts, key=_objective), story)
    yield found
    if found.gap >= CLOSED:
        instruments = tuple(one for one in every if one not in structure)
        more = _with(found, (*found.effects, *instruments), {})
        yield more if more.gap < CLOSED else _recognised(more)


def _recognised(found: Found) -> Found:
    """The fit without sensors whose errors have no form of their own, such as a gain or exchanged axes."""
    known = weighed(found.unknowns, found.product, 1.0)
    units = [
        one
        for one in found.unknowns.units
        if not isinstance(one.effect, SensorMatrix)
        or not isinstance(_of_sensor(found, one, known)[0], SensorMatrix)
    ]
    return _with(found, tuple(_of_units(found, units)), {})


def _open(fits: Sequence[Found]) -> bool:
    return min(fits, key=_objective).gap >= CLOSED


def _further(found: Found, story: Story) -> Found:
    """The fit with what the dense model has no amplitude for: drives that relax, links that bend by parts,
    and all that the dictionary has, one by one, as long as each pays for its parameters.
    """
    price = 0.5 * float(np.log(found.unknowns.count))
    for _ in range(_MOST_ENTERED):
        if found.gap < CLOSED or story.late:
            break
        trials = sorted(_trials(found), key=lambda one: -one[0])[:_TRIED]
        fitted = [_with(found, one[1], one[2]) for one in trials if one[0] > _PAYS * price]
        best = min(fitted, key=_objective, default=found)
        if found.objective - best.objective < price * max(len(best.x) - len(found.x), _PAYS):
            break
        new = next((one for one in best.effects if one not in found.effects), best.effects[-1])
        story.say(f"With {new.sentence()}: gap {best.gap:.2f}.")
        found = best
    return found


Trial = tuple[float, tuple[Effect, ...], Mapping[str, float]]
"""What a trial would gain at first order, its effects and the values that new ones begin with."""


def _trials(found: Found) -> Iterator[Trial]:
    """Everything that may go on."""
    kinds = {one.kind for one in found.effects}
    more = tuple(relaxations(found.study))
    if more and more[0].kind not in kinds:
        effects = (*found.effects, *more)
        yield _foreseen(found, effects, {}), effects, {}
    if bent := _bent(found):
        effects, values = tuple(in_parts(found.effects, bent)), _parts(found, bent)
        yield _foreseen(found, effects, values), effects, values
    for gain, effects in moved_mounts(found.study, found.unknowns, found.effects, found.x, found.product):
        yield gain, effects, {}
    for one in candidates(found.problem, found.unknowns, found.x, found.product)[:_TRIED]:
        yield one.gain, (*found.effects, one.effect), one.values


def _foreseen(found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> float:
    """What other effects would gain by the quadratic about where they begin, in units of log likelihood with
    a free scale.
    """
    unknowns, x = _begun(found, effects, values)
    fit = Penalised(unknowns, price=0.0)
    local = fit.local(x)
    curvature, slope = fit.quadratic(x, local)
    lower, upper = (side - x for side in unknowns.limits)
    damped = curvature + np.diag(np.where(np.diag(curvature) > 0, 1e-3 * np.diag(curvature), 1.0))
    change = bounded_step(damped, slope, lower, upper)
    fall = float(slope @ change - 0.5 * change @ curvature @ change) * local.gap**2
    return gain_of(2 * fall, local.product[-1, -1], fit.count)


def _bent(found: Found) -> set[str]:
    """Names of the links whose bending moves more than what is left."""
    unknowns = found.unknowns
    return {
        unit.effect.link
        for unit in unknowns.units
        if isinstance(unit.effect, LinkFlexibility)
        and not unit.effect.nonuniform
        and unknowns.moved(unit, found.x, found.product) > _SEEN * found.gap
    }


def _parts(found: Found, bent: set[str]) -> dict[str, float]:
    """Values of parts that are as stiff as the whole."""
    values, more = found.values, dict[str, float]()
    for link in bent:
        for what in ("bending_1", "bending_2", "torsion"):
            for role in ("compliance", "retardation_time"):
                own = values[f"{link}.{what}.{role}"]
                more |= {f"{link}.{what}.part_{n}.{role}": own for n in (1, 2, 3)}
    return more


def _with(found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> Found:
    """The fit gone on with other effects; those that are new begin with `values`, or with nothing."""
    unknowns, x = _begun(found, effects, values)
    steps = _MORE if len(effects) > len(found.effects) else _STEPS
    return _settled(found.study, unknowns, effects, x, Penalised(unknowns), steps)


def _begun(found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> tuple[Unknowns, Array]:
    model = with_more(found.study, effects)
    unknowns = Unknowns(model, len(found.study.file.study.effects))
    known = {**{name: 0.0 for name in _compliances(model)}, **found.values, **values}
    return unknowns, unknowns.to_x(np.array([known.get(p.name, p.initial) for p in model.parameters]))


def _compliances(model: Problem) -> list[str]:
    return [p.name for p in model.parameters if p.name.endswith(".compliance")]


def _said(kept: Found, evidence: dict[str, Support], inflated: float) -> Explained:
    return Explained(named(kept, evidence, inflated), kept.values, kept.study)


def _objective(fit: Found) -> float:
    return fit.objective


def dense_fit(
    problem: Problem, effects: tuple[Effect, ...], *, usual: bool, shares: Sequence[float] = (1.0,)
) -> Found:
    """From bearings that are rigid, which is near where one thing is missing, or as stiff as they usually
    are, where all give way a little: small ones hide each other on the way from rigid.

    shares: of the band, from low to high: lower resonances are in place before higher ones count.
    """
    known, x = len(problem.file.study.effects), np.zeros(0)
    for share in shares:
        unknowns = Unknowns(with_more(below(problem, share), effects), known)
        if not len(x):
            x = _usual(unknowns) if usual else unknowns.reference
            x = Penalised(unknowns, logarithmic=True, price=_LOOSE).minimise(Point(x), _ROBUST_STEPS).x
        x = Penalised(unknowns, price=_LOOSE).minimise(Point(x), _LOOSE_STEPS).x
        if share < 1:
            x = Penalised(unknowns).minimise(Point(x), _LOOSE_STEPS).x
    return _settled(problem, unknowns, effects, x, Penalised(unknowns), _STEPS)


def _settled(
    study: Problem, unknowns: Unknowns, effects: tuple[Effect, ...], x: Array, fit: Penalised, steps: int
) -> Found:
    x = fit.minimise(Point(x), steps).x
    squares, local = fit.squares(x), fit.local(x)
    gap, objective = float(np.sqrt(squares / fit.count)), fit.value(squares, x, local)
    return Found(study, unknowns.problem, unknowns, effects, x, gap, objective, local.product)


def _usual(unknowns: Unknowns) -> Array:
    """The reference with compliances of usual bearings; links are rigid."""
    x, values = unknowns.reference.copy(), {p.name: p.initial for p in unknowns.problem.parameters}
    for number in np.flatnonzero(unknowns.springs):
        body, axis, *_ = unknowns.names[number].split(".")
        if body.startswith(("base", "joint", "payload")):
            x[number] = min(1 / usual_stiffness(body, axis, values), unknowns.limits[1][number])
    return x


def pruned(found: Found, say: Say, unseen: Unseen | None = None) -> tuple[Found, dict[str, Support], float]:
    """The fit without units that the data do not ask for, its prices gone; log odds of those that stay,
    by unit; how much the residuals' correlation inflates variances.

    Where a gap stays, units go the least supported first, a quarter of them at most before all others are
    fitted again: what is weak beside another may be strong without it.  Of all models on the way the
    likeliest is then kept.
    """
    asked, least = found.unknowns, _SEEN * max(found.gap, 1.0)
    seen = [one for one in asked.units if asked.moved(one, found.x, found.product) > least]
    inflated, path = 1.0, list[tuple[Found, dict[str, Support]]]()
    while seen:
        found = refitted(found, seen)
        if inflated == 1.0:
            inflated = inflation(found.problem, found.unknowns.to_values(found.x))
        support = supports(found.unknowns, found.x, weighed(found.unknowns, found.product, inflated))
        path.append((found, support))
        loose = sorted((s.log_odds, name) for name, s in support.items() if not s.holds(found.gap))
        if not loose:
            break
        most = len(loose) if found.gap < CLOSED else max(len(support) // 4, 1)
        gone = {name for odds, name in loose[:most] if odds < 0} or {loose[0][1]}
        say(f"Without evidence: {', '.join(sorted(gone))}.")
        seen = [unit for unit in found.unknowns.units if unit.name not in gone]
    if not seen:
        path.append((refitted(found, []), {}))
    if unseen is not None and path[-1][0].gap >= CLOSED:
        return *_predictive(path, unseen, inflated), inflated
    return *path[-1], inflated


def _predictive(
    path: Sequence[tuple[Found, dict[str, Support]]], unseen: Unseen, inflated: float
) -> tuple[Found, dict[str, Support]]:
    """Of models from large to small the likeliest, by BIC with the inflation of the largest: what is judged
    against a gap that grows as units go would let all of them go.  Of those not less likely, beyond what
    convinces, the one that predicts unseen data best.
    """

    def cost(one: tuple[Found, dict[str, Support]]) -> float:
        count = max(one[0].unknowns.count / inflated, 2.0)
        numbers = sum(len(unit.all) for unit in one[0].unknowns.units)
        return float(count * np.log(max(one[0].gap, 1.0)) + 0.5 * np.log(count) * numbers)

    costs = [cost(one) for one in path]
    likely = [one for one, own in zip(path, costs, strict=True) if own < min(costs) + CONVINCING]
    return min(likely, key=lambda one: unseen(one[0].study, one[0].effects, one[0].values))


def refitted(found: Found, units: Sequence[Unit]) -> Found:
    """The fit with these units only, no price on any of them."""
    effects = tuple(_of_units(found, units))
    # Priors stay where they were: what was found is where it starts, not their centre.
    model = with_more(found.study, effects)
    unknowns = Unknowns(model, len(found.study.file.study.effects))
    started = unknowns.to_x(np.array([found.values[p.name] for p in model.parameters]))
    return _settled(found.study, unknowns, effects, started, Penalised(unknowns, price=0.0), _AGAIN)


def _of_units(found: Found, units: Sequence[Unit]) -> list[Effect]:
    """Dense effects that have these units and no others; axes that stay rigid are left out."""
    kept: list[Effect] = []
    for effect in found.effects:
        own = [unit for unit in units if unit.effect == effect]
        if isinstance(effect, Springs):
            soft = [
                found.unknowns.names[n].split(".")[1]
                for unit in own
                for n in unit.amplitudes
                if found.x[n] > 0
            ]
            axes = [axis for axis in effect.axes if axis in soft]
            if axes:
                kept.append(effect.model_copy(update={"axes": axes}))
        elif isinstance(effect, SensorMatrix):
            points = [point for point in effect.points if str(point) in {unit.name for unit in own}]
            if points:
                kept.append(effect.model_copy(update={"points": points}))
        elif own:
            kept.append(effect)
    return kept


def named(found: Found, evidence: dict[str, Support], inflated: float) -> list[Named]:
    """The units that stayed as effects of the catalogue, the best supported first."""
    values, result = found.values, list[Named]()
    known = weighed(found.unknowns, found.product, inflated)
    for unit in found.unknowns.units:
        mine = {found.unknowns.names[n] for n in unit.all}
        effect, own = unit.effect, {name: value for name, value in values.items() if name in mine}
        if isinstance(effect, Springs | LinkFlexibility):
            effect, own = names.of_springs(effect, unit.name, own)
        elif isinstance(effect, AddedMass):
            effect, own = names.of_body(effect, values)
        elif isinstance(effect, SensorMass):
            effect = SensorMass()
        elif isinstance(effect, SensorMatrix):
            effect, own = _of_sensor(found, unit, known)
        result.append(Named(effect, own, evidence[unit.name].log_odds))
    return sorted(names.of_all_forces(result, _forces(found.problem)), key=lambda one: -one.evidence)


def _of_sensor(found: Found, unit: Unit, known: Weighed) -> tuple[Effect, dict[str, float]]:
    """The simplest fault that a sensor's matrix stands for."""
    error = found.x[unit.amplitudes].reshape(3, 3)
    weight = eliminated(known.information, unit.amplitudes, floor_of(unit))
    effect, own, _ = names.of_sensor(int(unit.name), error, weight, known.price)
    return effect, own


def _forces(problem: Problem) -> int:
    """How many forces the measurements have."""
    return len({(c.node, abs(c.direction)) for m in problem.measurements for c in m.given.inputs})
