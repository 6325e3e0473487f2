"""From a present model to what is missing: dense fits, units without evidence taken out, what remains by
name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.discovery.evidence import CLOSED
from identify.discovery.sparse import names
from identify.discovery.sparse.dense import springs_and_bodies, springs_and_instruments, with_more
from identify.discovery.sparse.evidence import Support, eliminated, floor_of, inflation, supports
from identify.discovery.sparse.names import Named
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.unknowns import Unit, Unknowns
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_mass import SensorMass
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.model.effects.springs import Springs
from identify.vibration.problem import Problem

_LOOSE, _ROBUST_STEPS, _LOOSE_STEPS, _STEPS, _AGAIN = 0.3, 6, 12, 30, 6
"""Price of the first steps, by logarithmic residuals and by the likelihood; steps of each stage, and
after units left.
"""
_STIFFER, _ARM = 10.0, 0.15
"""A bearing that is about as stiff as they are: ten times its drive in rotation, and that on a lever of
0.15 m.
"""
_FEW = 2
"""Units that explain the data from rigid bearings, so that no other start can do with much less."""
_SEEN = 1.0
"""Units of what is left that an amplitude must move to be kept for a look at its evidence."""


@dataclass(frozen=True)
class Found:
    """A dense fit: its problem and unknowns, where it ended, its gap and objective; effects: what it has
    beyond the study.
    """

    problem: Problem
    unknowns: Unknowns
    effects: tuple[Effect, ...]
    x: Array
    gap: float
    objective: float

    @property
    def values(self) -> dict[str, float]:
        """Of all unknowns, by name."""
        every = self.unknowns.to_values(self.x)
        return {p.name: float(value) for p, value in zip(self.problem.parameters, every, strict=True)}


Say = Callable[[str], None]


def explain(problem: Problem, say: Say = lambda sentence: None) -> tuple[list[Named], dict[str, float]]:
    """What is missing from the model of a problem (few lines suffice), the most important first, and the
    values of all else by name.
    """
    instruments = tuple(springs_and_instruments(problem))
    if problem.nuisances.entries:  # masses may be off by what was stated, and move with all else
        return _said(*pruned(problem, dense_fit(problem, instruments, usual=True), say))
    rigid = dense_fit(problem, instruments, usual=False)
    if rigid.gap < CLOSED:
        few = pruned(problem, rigid, say)
        if few[0].gap < CLOSED and len(few[1]) <= _FEW:
            return _said(*few)
    best = min(rigid, dense_fit(problem, instruments, usual=True), key=_objective)
    if best.gap >= CLOSED:
        best = min(best, dense_fit(problem, tuple(springs_and_bodies(problem)), usual=True), key=_objective)
    say(f"Everything that may be missing in the model at once: gap {best.gap:.2f}.")
    return _said(*pruned(problem, best, say))


def _said(kept: Found, evidence: dict[str, Support], inflated: float) -> tuple[list[Named], dict[str, float]]:
    return named(kept, evidence, inflated), kept.values


def _objective(fit: Found) -> float:
    return fit.objective


def dense_fit(problem: Problem, effects: tuple[Effect, ...], *, usual: bool) -> Found:
    """From bearings that are rigid, which is near where one thing is missing, or as stiff as they usually
    are, where all give way a little: small ones hide each other on the way from rigid.
    """
    model = with_more(problem, effects)
    unknowns = Unknowns(model, len(problem.file.study.effects))
    x = _usual(unknowns) if usual else unknowns.reference
    x = Penalised(unknowns, logarithmic=True, price=_LOOSE).minimise(Point(x), _ROBUST_STEPS).x
    x = Penalised(unknowns, price=_LOOSE).minimise(Point(x), _LOOSE_STEPS).x
    return _settled(model, unknowns, effects, x, Penalised(unknowns), _STEPS)


def _settled(
    model: Problem, unknowns: Unknowns, effects: tuple[Effect, ...], x: Array, fit: Penalised, steps: int
) -> Found:
    x = fit.minimise(Point(x), steps).x
    squares = fit.squares(x)
    return Found(
        model, unknowns, effects, x, float(np.sqrt(squares / fit.count)), fit.value(squares, x, fit.local(x))
    )


def _usual(unknowns: Unknowns) -> Array:
    """The reference with compliances of usual bearings; links are rigid."""
    x, values = unknowns.reference.copy(), {p.name: p.initial for p in unknowns.problem.parameters}
    drives = [value for name, value in values.items() if name.endswith(".rz.stiffness")]
    for number in np.flatnonzero(unknowns.springs):
        body, axis, *_ = unknowns.names[number].split(".")
        if not body.startswith(("base", "joint", "payload")):
            continue
        drive = values.get(f"{body}.rz.stiffness", (max if body == "base" else min)(drives, default=1e6))
        stiffness = _STIFFER * drive / (_ARM**2 if axis.startswith("t") else 1.0)
        x[number] = min(1 / stiffness, unknowns.limits[1][number])
    return x


def pruned(problem: Problem, found: Found, say: Say) -> tuple[Found, dict[str, Support], float]:
    """The fit without units that the data do not ask for, its prices gone; log odds of those that stay,
    by unit; how much the residuals' correlation inflates variances.
    """
    fit = Penalised(found.unknowns)
    local = fit.local(found.x)
    asked, x = found.unknowns, found.x
    seen = [one for one in asked.units if asked.moved(one, x, local.product) > _SEEN * local.gap]
    inflated = 1.0
    while seen:
        found = refitted(problem, found, seen)
        fit = Penalised(found.unknowns, price=0.0)
        if inflated == 1.0:
            inflated = inflation(found.problem, found.unknowns.to_values(found.x))
        support = supports(fit, found.x, inflated)
        loose = sorted(
            (value.log_odds, name) for name, value in support.items() if not value.holds(found.gap)
        )
        if not loose:
            return found, support, inflated
        gone = {name for odds, name in loose if odds < 0} or {loose[0][1]}
        say(f"Without evidence: {', '.join(sorted(gone))}.")
        seen = [unit for unit in found.unknowns.units if unit.name not in gone]
    return refitted(problem, found, []), {}, inflated


def refitted(problem: Problem, found: Found, units: Sequence[Unit]) -> Found:
    """The fit with these units only, no price on any of them."""
    effects = tuple(_of_units(found, units))
    # Priors stay where they were: what was found is where it starts, not their centre.
    model = with_more(problem, effects)
    unknowns = Unknowns(model, len(problem.file.study.effects))
    started = unknowns.to_x(np.array([found.values[p.name] for p in model.parameters]))
    return _settled(model, unknowns, effects, started, Penalised(unknowns, price=0.0), _AGAIN)


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
    fit, values, result = Penalised(found.unknowns, price=0.0), found.values, list[Named]()
    product = fit.product(found.x)
    scale = max(product[-1, -1] / fit.count, 1.0) * inflated
    information = product[:-1, :-1] / scale + np.diag(found.unknowns.precision)
    price = 0.5 * float(np.log(max(fit.count / inflated, 2.0)))
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
            error = found.x[unit.amplitudes].reshape(3, 3)
            weight = eliminated(information, unit.amplitudes, floor_of(unit))
            effect, own, _ = names.of_sensor(int(unit.name), error, weight, price)
        result.append(Named(effect, own, evidence[unit.name].log_odds))
    return sorted(names.of_all_forces(result, _forces(found.problem)), key=lambda one: -one.evidence)


def _forces(problem: Problem) -> int:
    """How many forces the measurements have."""
    return len({(c.node, abs(c.direction)) for m in problem.measurements for c in m.given.inputs})
