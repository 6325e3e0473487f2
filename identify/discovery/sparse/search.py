"""From a present model to what is missing: dense fits, units without evidence taken out, what remains by
name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.discovery.evidence import CLOSED
from identify.discovery.sparse import names
from identify.discovery.sparse.bounded import bounded_step
from identify.discovery.sparse.dense import (
    bodies,
    in_parts,
    instruments,
    relaxations,
)
from identify.discovery.sparse.dictionary import Beside, candidates, gain_of
from identify.discovery.sparse.evidence import (
    Weighed,
    eliminated,
    floor_of,
    price,
    weighed,
)
from identify.discovery.sparse.fit import Found, begun, dense_fit, gone_on, of_units
from identify.discovery.sparse.mounts import moved_mounts
from identify.discovery.sparse.names import Named
from identify.discovery.sparse.objective import Penalised
from identify.discovery.sparse.prune import SEEN, Say, Unseen, costs_of_dropping, pruned
from identify.discovery.sparse.unknowns import Unit
from identify.fitting.selection.workbench import Story
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_mass import SensorMass
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.model.effects.springs import Springs
from identify.vibration.all_springs import all_springs
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem, with_uncertainty

_MOST_ENTERED, _TRIED, _PAYS = 8, 2, 3
"""How often more may enter, how many are tried at a time, and parameters that each must pay for at least."""
_WIDENED = (0.25, 0.5, 1.0)
"""Shares of the band, from low to high."""
_FEW = 2
"""Units that explain the data from rigid bearings, so that no other start can do with much less."""


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
    story = story or Story()
    say, stated = story.say, bool(problem.nuisances.entries)  # masses may be off by what was stated
    bending = problem if stated else with_uncertainty(problem, FORMS_ALONE)
    structure = tuple(all_springs(problem, shrink=True))
    if not stated:
        few = pruned(_further(dense_fit(problem, structure, usual=False), story, 1), say, unseen)
        if story.late or (few[0].gap < CLOSED and len(few[1]) <= _FEW):
            return _said(*few, unseen, say)
    fits = [_further(dense_fit(bending, structure, usual=True), story)]
    if _open(fits) and not story.late:
        fits.append(dense_fit(problem, (*structure, *instruments(problem)), usual=True))
    if _open(fits) and not story.late:
        other = dense_fit(bending, structure, usual=True, shares=_WIDENED)
        fits.append(_further(other, story) if other.objective < fits[0].objective else other)
    best = _best(fits, unseen)
    say(f"Everything that may be missing in the model at once: gap {best.gap:.2f}.")
    return _said(*pruned(best, say, unseen), unseen, say)


def _best(fits: Sequence[Found], unseen: Unseen | None) -> Found:
    """The likeliest; where all leave something open, none of them is the truth, and the one that predicts
    unseen data best is kept.
    """
    if unseen is None or not _open(fits):
        return min(fits, key=_objective)
    return min(fits, key=lambda one: unseen(one.study, one.effects, one.values))


def _recognised(found: Found) -> Found:
    """The fit without sensors whose errors have no form of their own, such as a gain or exchanged axes."""
    known = weighed(found.unknowns, found.product, 1.0)
    units = [
        one
        for one in found.unknowns.units
        if not isinstance(one.effect, SensorMatrix)
        or not isinstance(_of_sensor(found, one, known)[0], SensorMatrix)
    ]
    return gone_on(found, tuple(of_units(found, units)), {})


def _open(fits: Sequence[Found]) -> bool:
    return min(fits, key=_objective).gap >= CLOSED


def _further(found: Found, story: Story, most: int = _MOST_ENTERED) -> Found:
    """The fit with what the springs have no amplitude for, as long as each pays for its parameters: the
    instruments or the bodies all at once, drives that relax, links that bend by parts, and all that the
    dictionary has, one by one.
    """
    each_costs = price(found.unknowns.count)
    for _ in range(most):
        if found.gap < CLOSED or story.late:
            break
        fitted = [_tried(found, one) for one in _worth(list(_trials(found)), _PAYS * each_costs)]
        best = min(fitted, key=lambda fit: fit.objective + each_costs * len(fit.x), default=found)
        if found.objective - best.objective < each_costs * max(len(best.x) - len(found.x), _PAYS):
            break
        new = [one for one in best.effects if one not in found.effects] or [best.effects[-1]]
        story.say(f"With {new[0].sentence()}{' and more' * (len(new) > 1)}: gap {best.gap:.2f}.")
        found = best
    return found


def _worth(trials: Sequence[Trial], least: float) -> list[Trial]:
    """Those that gain most, and what gains most for each of its parameters: by first order large effects
    gain less than they do, and what says the same with few parameters would not be seen behind many.
    """
    most = sorted((one for one in trials if one[0] > least), key=lambda one: -one[0])
    sized = [one for one in most if one[2] and one not in most[:_TRIED]]
    return [*most[:_TRIED], *sorted(sized, key=lambda one: -one[0] / len(one[2]))[:1]]


def _tried(found: Found, trial: Trial) -> Found:
    """The fit gone on with a trial; where free sensors leave something open, with those alone whose errors
    have the form of a fault: others make up for shapes that are not there yet, and would keep them out.
    """
    more = gone_on(found, trial[1], trial[2])
    free = any(isinstance(one, SensorMatrix) for one in trial[1] if one not in found.effects)
    return more if more.gap < CLOSED or not free else _recognised(more)


Trial = tuple[float, tuple[Effect, ...], Mapping[str, float]]
"""What a trial would gain at first order, its effects and the values that new ones begin with."""


def _trials(found: Found) -> Iterator[Trial]:
    """Everything that may go on."""
    for some in (instruments(found.study), relaxations(found.study), _bodies(found)):
        if not _has(found, some):
            effects = (*found.effects, *(one for one in some if one not in found.effects))
            yield _foreseen(found, effects, {}), effects, {}
    if bent := _bent(found):
        effects, values = tuple(in_parts(found.effects, bent)), _parts(found, bent)
        yield _foreseen(found, effects, values), effects, values
    beside = Beside.of(found.unknowns, found.x, found.product)
    for gain, effects in moved_mounts(found.study, found.effects, beside):
        yield gain, effects, {}
    for one in candidates(found.problem, beside):
        yield one.gain, (*found.effects, one.effect), one.values


def _has(found: Found, some: Sequence[Effect]) -> bool:
    """Whether a fit has effects of these kinds, or there are none."""
    kinds = {one.kind for one in found.effects}
    return all(one.kind in kinds for one in some)


def _bodies(found: Found) -> Sequence[Effect]:
    """Not beside masses that are uncertain by themselves, nor free sensors, which take up any scale of the
    masses.
    """
    free = any(isinstance(one, SensorMatrix) for one in found.effects)
    masses = found.study.file.study.uncertainty not in (None, FORMS_ALONE)
    return () if free or masses else bodies(found.study)


def _foreseen(found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> float:
    """What other effects would gain by the quadratic about where they begin, in units of log likelihood with
    a free scale.
    """
    unknowns, x = begun(found, effects, values)
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
        and unknowns.moved(unit, found.x, found.product) > SEEN * found.gap
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


def _said(
    kept: Found, evidence: dict[str, float], inflated: float, unseen: Unseen | None, say: Say
) -> Explained:
    worth = {}
    if unseen is not None and kept.gap >= CLOSED:
        worth = costs_of_dropping(kept, inflated, unseen)
        say("Effects are ranked by what leaving each out costs on data that are not fitted.")
    return Explained(named(kept, evidence, inflated, worth), kept.values, kept.study)


def _objective(fit: Found) -> float:
    return fit.objective


def named(
    found: Found, evidence: Mapping[str, float], inflated: float, worth: Mapping[str, float]
) -> list[Named]:
    """The units that stayed as effects of the catalogue: those first that predictions need most, where a gap
    stays, else the best supported.
    """
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
        result.append(Named(effect, own, evidence[unit.name], worth.get(unit.name, 0.0)))
    found_all = names.of_all_forces(result, _forces(found.problem))
    return sorted(found_all, key=lambda one: (-one.worth, -one.evidence))


def _of_sensor(found: Found, unit: Unit, known: Weighed) -> tuple[Effect, dict[str, float]]:
    """The simplest fault that a sensor's matrix stands for."""
    error = found.x[unit.amplitudes].reshape(3, 3)
    weight = eliminated(known.information, unit.amplitudes, floor_of(unit))
    effect, own, _ = names.of_sensor(int(unit.name), error, weight, known.price)
    return effect, own


def _forces(problem: Problem) -> int:
    """How many forces the measurements have."""
    return len({(c.node, abs(c.direction)) for m in problem.measurements for c in m.given.inputs})
