"""From a present model to what is missing: dense fits, units without evidence taken out, what remains by
name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identify.core.thresholds import CLOSED, MATERIAL
from identify.discovery.sparse.dense import (
    bodies,
    exchanged,
    in_parts,
    instruments,
    of_all,
    relaxations,
)
from identify.discovery.sparse.dictionary import Beside, candidates
from identify.discovery.sparse.evidence import (
    PAYS,
    believable,
    fault_of,
    price,
    weighed,
)
from identify.discovery.sparse.fit import (
    STEPS,
    Found,
    afresh,
    dense_fit,
    gone_on,
    of_units,
    settled,
    standing,
)
from identify.discovery.sparse.mounts import moved_mounts
from identify.discovery.sparse.named import named
from identify.discovery.sparse.names import Named
from identify.discovery.sparse.prune import SEEN, Pruned, Unseen, pruned
from identify.discovery.sparse.quadratic import Quadratic
from identify.discovery.sparse.unknowns import Unit
from identify.fitting.selection.workbench import Story
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.model.effects.springs import Springs
from identify.vibration.all_springs import all_springs
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem, with_uncertainty

_MOST_ENTERED, _TRIED = 8, 3
"""How often more may enter, and how many are tried at a time."""
_GLANCED, _SETTLED = 4, 3
"""Steps of every trial, and how many of them, the best, are fitted to their end."""
_FAR = 3 * CLOSED
"""Gap from which a fit with links as stated is not pruned."""
_WIDENED = (0.25, 0.5, 1.0)
"""Shares of the band, from low to high."""


@dataclass(frozen=True)
class Explained:
    """What is missing, the most important first, the values of all else by name, and the problem that it is
    missing from: with the forms of links uncertain, where that was looked at.
    """

    named: list[Named]
    values: dict[str, float]
    problem: Problem


def explain(
    problem: Problem, story: Story | None = None, unseen: Unseen | None = None, *, doubted: bool = False
) -> Explained:
    """What is missing from the model of a problem (few lines suffice).

    unseen: the gap of a problem's effects and values on data that are not fitted; doubted: whether something
    is looked for even where the gap on the fitted data leaves nothing open.
    """
    story = story or Story()
    stated = bool(problem.nuisances.entries)  # masses may be off by what was stated
    structure = _structure(problem)
    bending = problem if stated else with_uncertainty(problem, FORMS_ALONE)
    told = _with_links_as_told(problem, bending, structure, story, unseen, doubted=doubted)
    likeliest = max(told, key=_evidence, default=None)
    if likeliest is None or not (story.late or likeliest.simple):
        closed = [one for one in told if one.closed]
        story.doing("fitting everything that may be missing at once")
        usual = dense_fit(bending, structure, usual=True, until=story.until)
        fits = _further(usual, story, 1 if closed else _MOST_ENTERED)
        if not (closed and _open(fits)):
            fits += _others(problem, bending, structure, story, fits[0]) if _open(fits) else []
            best = [form for one in _best(fits, unseen) for form in (one, *_by_parts(one, story))]
            story.say(f"Everything that may be missing in the model at once: gap {best[0].gap:.2f}.")
            closed += [_aligned(one, story, unseen) for one in best]
        likeliest = max(closed, key=_evidence)
    known = likeliest.found
    return Explained(named(known, likeliest.evidence, likeliest.inflated), known.values, known.study)


def _structure(problem: Problem) -> tuple[Effect, ...]:
    """What every dense fit has; a delay turns every phase: without it springs are led to turn them, too."""
    return (*all_springs(problem, shrink=True), *of_all(problem))


def promising(problem: Problem, values: Mapping[str, float]) -> bool:
    """Whether anything alone would lower the gap by more than estimators get wrong, to first order, beside
    the problem's model near its data, at values by name.
    """
    found = standing(problem, _structure(problem), values)
    springs, count = Quadratic.about(found, found.effects, {}), found.unknowns.count
    gains = [(springs.gain([unit]), len(unit.all)) for unit in springs.units]
    gains += [(trial.gain, trial.size) for trial in _trials(found)]
    return any(gain > count * MATERIAL + price(count) * size for gain, size in gains)


def _with_links_as_told(
    problem: Problem,
    bending: Problem,
    structure: tuple[Effect, ...],
    story: Story,
    unseen: Unseen | None,
    *,
    doubted: bool,
) -> list[Pruned]:
    """From rigid bearings, with what no spring stands for in two rounds; where links bend by parts, gone on
    with their forms uncertain in the second.
    """
    story.doing("fitting with rigid bearings and links that may give way")
    fit = dense_fit(problem, structure, usual=False, until=story.until)
    fits = _further(fit, story, 1, doubted=doubted)
    if _open(fits) and any(isinstance(one, LinkFlexibility) and one.nonuniform for one in fits[0].effects):
        fits = [gone_on(replace(fits[0], study=bending), fits[0].effects, {}, STEPS)]
    elif _open(fits):
        fits = _further(fits[0], story, 1)
    # Prices hold a fit a little open, never by so much: what is far off is another start's to explain.
    models = [(one, _aligned(one, story, unseen)) for one in fits if one.gap < _FAR or story.late]
    again = [one for one, model in models if _may_stand_for_others(one, model, structure)]
    for one in again:
        if not story.late:
            fit = afresh(one)
            models.append((fit, _aligned(fit, story, unseen)))
    return [model for _, model in models]


def _aligned(found: Found, story: Story, unseen: Unseen | None) -> Pruned:
    """The fit without units that have no evidence.  Where that explains the data, axes of bearings that stay
    are turned, and what only stood for that goes: none is softest exactly along those of its joint's frame.
    """
    model = pruned(found, story.say, unseen)
    pays = PAYS * price(found.unknowns.count)
    for trial in _coupled(model.found) if model.closed else ():
        if trial.gain > pays and not story.late:
            turned = pruned(gone_on(model.found, trial.effects, {}), story.say, unseen)
            model = max(model, turned, key=_evidence)
    return model


def _may_stand_for_others(found: Found, model: Pruned, structure: tuple[Effect, ...]) -> bool:
    """Whether more stayed than what entered: it may have given way only to stand for that, before it was
    there.
    """
    entered = sum(one not in structure for one in found.effects)
    return model.closed and 0 < entered < len(model.evidence)


def _others(
    problem: Problem, bending: Problem, structure: tuple[Effect, ...], story: Story, first: Found
) -> Iterator[Found]:
    """Where that leaves something open: with all instruments from the start, and band by band."""
    if story.late:
        return
    story.doing("fitting again, with errors of every sensor and force")
    more = [one for one in instruments(problem) if one not in structure]
    fit = dense_fit(problem, (*structure, *more), usual=True, until=story.until)
    yield fit
    if _open([first, fit]) and not story.late:
        story.doing("fitting again, from the lower part of the band up")
        banded = dense_fit(bending, structure, usual=True, shares=_WIDENED, until=story.until)
        yield from _further(banded, story) if banded.objective < first.objective else [banded]


def _evidence(model: Pruned) -> float:
    return model.found.log_evidence


def _best(fits: Sequence[Found], unseen: Unseen | None) -> list[Found]:
    """Those that leave nothing open; where all do, none of them is the truth, and the one that predicts
    unseen data best is kept.
    """
    if not _open(fits):
        return [one for one in fits if one.gap < CLOSED]
    if unseen is None:
        return [min(fits, key=_objective)]
    return [min(fits, key=lambda one: unseen(one.study, one.effects, one.values))]


def _recognised(found: Found) -> Found:
    """The fit without sensors whose errors have no form of their own, such as a gain or exchanged axes."""
    known = weighed(found.unknowns, found.product, 1.0)
    units = [
        one
        for one in found.unknowns.units
        if not isinstance(one.effect, SensorMatrix)
        or not isinstance(fault_of(one, found.unknowns, found.x, known)[0], SensorMatrix)
    ]
    return gone_on(found, tuple(of_units(found, units)), {})


def _open(fits: Sequence[Found]) -> bool:
    return min(fits, key=_objective).gap >= CLOSED


def _further(found: Found, story: Story, most: int = _MOST_ENTERED, *, doubted: bool = False) -> list[Found]:
    """The fit with what the springs have no amplitude for, as long as each pays for its parameters: the
    instruments or the bodies all at once, drives that relax, links that bend by parts, and all that the
    dictionary has, one by one; beside it what else closed the gap in the last round.
    """
    each_costs, others, shares = price(found.unknowns.count), list[Found](), dict[str, float]()
    if found.gap < CLOSED and not believable(found.problem, found.values):
        found = settled(found, STEPS)  # errors of a fit that has not ended say nothing
    for _ in range(most):
        believed = believable(found.problem, found.values)
        if (found.gap < CLOSED and believed and not doubted) or story.late:
            break
        more = _one_further(found, story, each_costs, shares, believed=believed)
        if more is None:
            break
        found, others = more
    return [found, *others]


def _one_further(
    found: Found, story: Story, each_costs: float, shares: dict[str, float], *, believed: bool
) -> tuple[Found, list[Found]] | None:
    """The fit with the likeliest of what it lacks, and what else closes the gap; None where nothing pays;
    believed: whether its errors are; shares: as `_tried` has them.
    """
    story.doing("scoring what else may be missing")
    trials = _trials(found)
    likely = [one._replace(gain=one.gain * shares.get(_new(found, one), 1.0)) for one in trials]
    worth = _worth(found, likely, each_costs)
    if not worth:
        return None
    story.doing(f"fitting the {len(worth)} likeliest of it")
    # Errors beyond belief that leave much open have led elsewhere: trials begin as stated.  Where they leave
    # nothing open, what they make up for takes their place step by step.
    astray = not believed and found.gap >= CLOSED
    stated = {one.name: 0.0 for one in found.problem.nuisances.entries} if astray else {}
    fitted = _tried(found, worth, stated, each_costs, shares, believed=believed)
    likeliest = min(fitted, key=lambda fit: _costs(fit, each_costs))
    best = settled(likeliest, STEPS)  # what a fit lacks that has not ended is no effect
    if found.unpriced - best.unpriced < each_costs * max(best.unknowns.size - found.unknowns.size, PAYS):
        return None
    new = found.new(best.effects) or [best.effects[-1]]
    story.say(f"With {new[0].sentence()}{' and more' * (len(new) > 1)}: gap {best.gap:.2f}.")
    return best, [one for one in fitted if one is not likeliest and one.gap < CLOSED <= found.gap]


def _costs(found: Found, each_costs: float) -> float:
    """Less is likelier."""
    return found.unpriced + each_costs * found.unknowns.size - _before(found)


def _before(found: Found) -> float:
    """Logarithm of the prior odds for where bodies that entered by themselves hang: every other one of what
    nobody stated is a tool or payload on the last link.
    """
    last, others = found.study.robot.links[-1].name, len(found.study.robot.links) - 2
    bodies = [one for one in found.unknowns.entered if isinstance(one, AddedMass)]
    return float(np.log(max(others, 1)) * sum(one.link == last for one in bodies))


class Trial(NamedTuple):
    """What may go on: what it would gain at first order, its effects, the values that new ones begin with,
    and how many unknowns it adds.
    """

    gain: float
    effects: tuple[Effect, ...]
    values: Mapping[str, float]
    size: int


def _worth(found: Found, trials: Sequence[Trial], each_costs: float) -> list[Trial]:
    """Those that gain most beyond the price of their unknowns, and of other kinds what gains most for each of
    these: by first order large effects gain less than they do, and what says the same with few would not be
    seen.
    """
    worth = [one for one in trials if one.gain > PAYS * each_costs]
    most = sorted(worth, key=lambda one: each_costs * one.size - one.gain)
    of_kind = dict[str, Trial]()
    for one in sorted((one for one in most[_TRIED:] if one.size), key=lambda one: -one.gain / one.size):
        [*_, new] = found.new(one.effects)
        of_kind.setdefault(new.kind, one)
    return [*most[:_TRIED], *list(of_kind.values())[:_TRIED]]


def _new(found: Found, trial: Trial) -> str:
    """What a trial adds, in words."""
    return ", ".join(one.sentence() for one in found.new(trial.effects))


def _tried(
    found: Found,
    trials: Sequence[Trial],
    start: Mapping[str, float],
    each_costs: float,
    shares: dict[str, float],
    *,
    believed: bool,
) -> list[Found]:
    """The fit gone on with each trial, the most promising after a few steps to their end; start: values that
    all begin with beside their own; shares: of what was foreseen, what trials gained, which is known better
    than the first order of what they would gain now.
    """
    glanced = [(one, gone_on(found, one.effects, {**start, **one.values}, _GLANCED)) for one in trials]
    glanced.sort(key=lambda pair: _costs(pair[1], each_costs))
    # What is foreseen to be worth most may begin slowly, and what gains most for each unknown be likeliest.
    glanced[1:] = sorted(glanced[1:], key=lambda pair: pair[0] is not trials[0])
    glanced[2:] = sorted(
        glanced[2:], key=lambda pair: (pair[1].unpriced - found.unpriced) / max(pair[0].size, 1)
    )
    fitted = list[Found]()
    for place, (trial, fit) in enumerate(glanced):
        own = fit if place >= _SETTLED else _ended(found, fit, believed=believed)
        gained = max(found.unpriced - own.unpriced, 0.0)
        new, share = _new(found, trial), gained / max(trial.gain, 1e-9)
        shares[new] = min(shares.get(new, 1.0) * share, 1.0)
        fitted.append(own)
    return fitted


def _ended(found: Found, fit: Found, *, believed: bool) -> Found:
    """A trial's fit to its end; where several free sensors leave something open, with those alone whose
    errors have the form of a fault: others compensate for shapes that are not there yet, and would keep them
    out.  One alone has to pay for itself.

    Errors beyond belief have made up for what the trial may be, and go back along a valley that bends, slowly
    even beside the truth: where they do not go back, the fit is begun afresh, too.
    """
    more = settled(fit)
    several = any(isinstance(one, SensorMatrix) and len(one.points) > 1 for one in found.new(fit.effects))
    if several and more.gap >= CLOSED:
        more = _recognised(more)
    if believed or (more.gap < CLOSED and believable(more.problem, more.values)):
        return more
    return min([more, afresh(more)], key=_objective)


def _trials(found: Found) -> Iterator[Trial]:
    """Everything that may go on."""
    yield from _linear(found)
    for effects, values in _in_parts(found):
        yield Trial(_foreseen(found, effects, values), effects, values, len(values))
    yield from _coupled(found)
    beside = Beside.of(found.unknowns, found.x, found.product)
    for gain, effects in moved_mounts(found.study, found.effects, beside):
        yield Trial(gain, effects, {}, 3)
    for one in candidates(found.problem, beside):
        yield Trial(one.gain, (*found.effects, one.effect), one.values, len(one.values))


def _linear(found: Found) -> Iterator[Trial]:
    """Instruments, relaxations, bodies: all of a family at once, and each of them alone."""
    families = instruments(found.study), relaxations(found.study), _bodies(found)
    absent = [new for some in families if (new := _absent(found, some))]
    if not absent:
        return
    local = Quadratic.about(found, (*found.effects, *(one for some in absent for one in some)), {})
    for some in absent:
        own = [unit for unit in local.units if unit.effect in some]
        yield Trial(local.gain(own), (*found.effects, *some), {}, sum(len(unit.all) for unit in own))
        if len(own) > 1:
            for unit in own:
                values = local.there([unit]) if found.gap < CLOSED else {}
                yield Trial(local.gain([unit]), (*found.effects, _alone(unit)), values, len(unit.all))


def _absent(found: Found, some: Sequence[Effect]) -> list[Effect]:
    """Those that a fit does not have; of sensors those that are not free."""
    free = {point for one in found.effects if isinstance(one, SensorMatrix) for point in one.points}
    rest = list[Effect]()
    for one in some:
        if isinstance(one, SensorMatrix):
            points = [point for point in one.points if point not in free]
            rest += [one.model_copy(update={"points": points})] if points else []
        elif one not in found.effects:
            rest.append(one)
    return rest


def _alone(unit: Unit) -> Effect:
    """The effect with that unit alone."""
    if not isinstance(unit.effect, SensorMatrix):
        return unit.effect
    points = [point for point in unit.effect.points if str(point) == unit.name]
    return unit.effect.model_copy(update={"points": points})


def _bodies(found: Found) -> Sequence[Effect]:
    """Not beside free sensors, which take up any scale of the masses."""
    free = any(isinstance(one, SensorMatrix) for one in found.effects)
    return () if free else bodies(found.study)


def _foreseen(found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> float:
    """What other effects would gain where they begin."""
    local = Quadratic.about(found, effects, values)
    return local.gain([unit for unit in local.units if unit.effect not in found.effects])


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


def _in_parts(found: Found) -> Iterator[tuple[tuple[Effect, ...], dict[str, float]]]:
    """The effects with all links by parts that bend, and the values of these; nothing where none does."""
    if bent := _bent(found):
        yield tuple(in_parts(found.effects, bent)), _parts(found, bent)


def _by_parts(found: Found, story: Story) -> Iterator[Found]:
    """The fit with links by parts where one bends beside other units, which may compensate for its form."""
    seen = [one for one in found.unknowns.units if found.unknowns.moved(one, found.x, found.product) > SEEN]
    if len(seen) > len(_bent(found)) and not story.late:
        yield from (gone_on(found, *parts) for parts in _in_parts(found))


def _coupled(found: Found) -> Iterator[Trial]:
    """The springs across z of one body coupled, where any of these gives way."""
    pairs = [(one, one.model_copy(update={"coupled": True})) for one in _uncoupled(found)]
    if not pairs:
        return
    local = Quadratic.about(found, exchanged(found.effects, pairs), {})
    for one, turned in pairs:
        own = [unit for unit in local.units if unit.effect == turned]
        effects = exchanged(found.effects, [(one, turned)])
        yield Trial(local.gain(own), effects, {}, 2 * len(turned.pairs))


def _uncoupled(found: Found) -> Iterator[Springs]:
    """Effects whose springs across z give way and are not coupled."""
    for one in found.effects:
        if isinstance(one, Springs) and one.pairs and not one.coupled:
            soft = found.unknowns.soft([unit for unit in found.unknowns.units if unit.effect == one], found.x)
            if any(set(pair) & set(soft) for pair in one.pairs):
                yield one


def _parts(found: Found, bent: set[str]) -> dict[str, float]:
    """Values of parts that are as stiff as the whole."""
    values, more = found.values, dict[str, float]()
    for link in bent:
        for what in ("bending_1", "bending_2", "torsion"):
            for role in ("compliance", "retardation_time"):
                own = values[f"{link}.{what}.{role}"]
                more |= {f"{link}.{what}.part_{n}.{role}": own for n in (1, 2, 3)}
    return more


def _objective(fit: Found) -> float:
    return fit.objective
