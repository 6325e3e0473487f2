"""From a present model to what is missing: dense fits, units without evidence taken out, what remains by
name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.thresholds import CLOSED, MATERIAL
from identify.discovery.sparse.couplings import couplings
from identify.discovery.sparse.dense import (
    exchanged,
    instruments,
    links,
    of_all,
)
from identify.discovery.sparse.evidence import (
    PAYS,
    believable,
    fault_of,
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
    usual_fit,
)
from identify.discovery.sparse.named import named
from identify.discovery.sparse.names import Named
from identify.discovery.sparse.prune import FEW, SEEN, Pruned, Unseen, pruned
from identify.discovery.sparse.quadratic import Quadratic
from identify.discovery.sparse.spring_places import at_frames, displaced, located
from identify.discovery.sparse.trials import Trial, trials
from identify.fitting.selection.workbench import Story
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.vibration.all_springs import all_springs
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem, with_uncertainty

_MOST_ENTERED, _TRIED = 8, 3
"""How often more may enter, and how many are tried at a time."""
_GLANCED, _SETTLED = 4, 3
"""Steps of every trial, and how many of them, the best, are fitted to their end."""
_CLEARLY = 2.0
"""Times what is foreseen of another: first order foresees half at least of what large effects gain."""
_LEFT = 0.5
"""Share of what bearings leave that links leave where some bend, or the same where one acts elsewhere."""
_FAR = 3 * CLOSED
"""Gap from which a fit with links as stated is not pruned."""


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
    stated = bool(problem.nuisances.entries)  # masses may be off by what was stated
    bending = problem if stated else with_uncertainty(problem, FORMS_ALONE)
    told = _with_few(problem, bending, story, unseen)
    likeliest = _likeliest(told, unseen)
    if likeliest is None or not (story.late or likeliest.simple or _complete(likeliest)):
        closed = any(one.closed for one in told)
        likeliest = _likeliest([*told, *_with_all(bending, story, unseen, closed=closed)], unseen)
    assert likeliest is not None
    known = likeliest.found
    return Explained(named(known, likeliest.evidence, likeliest.inflated), known.values, known.study)


def _with_all(problem: Problem, story: Story, unseen: Unseen | None, *, closed: bool) -> list[Pruned]:
    """What is missing where everything gives way about as it usually does; closed: whether a model with less
    leaves nothing open, so that one that does is no better.
    """
    story.doing("fitting everything that may be missing at once")
    whole = located(usual_fit(problem, tuple(of_all(problem)), story.until))
    story.say(f"With all bearings and links about as compliant as is usual: gap {whole.gap:.2f}.")
    fits = _further(whole, story, 1 if closed else _MOST_ENTERED)
    if closed and _open(fits):
        return []
    if _open(fits):
        fits += _with_instruments(problem, story, min(map(_objective, fits)))
    best = _best(fits, unseen) if _open(fits[:1]) else fits[0]
    story.say(f"Everything that may be missing in the model at once: gap {best.gap:.2f}.")
    return [_aligned(best, story, unseen)]


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
    gains += [(trial.gain, trial.size) for trial in trials(found)]
    return any(gain > count * MATERIAL + found.price * size for gain, size in gains)


def _beside_bearings(fit: Found, bending: Problem, story: Story) -> list[Found]:
    """The fit with what bearings do not stand for as long as something pays; once a link bends, with forms of
    links uncertain.
    """
    others = list[Found]()
    for _ in range(_MOST_ENTERED):
        [more, *rest] = _further(fit, story, 1)
        if more is fit:
            break
        fit, others = more, rest
        if fit.study is not bending and any(isinstance(one, LinkFlexibility) for one in fit.effects):
            fit = gone_on(replace(fit, study=bending), fit.effects, {}, STEPS)
    return [fit, *others]


def _beside_links(fit: Found, bending: Problem, story: Story) -> list[Found]:
    """The fit with what no spring stands for in two rounds, the second only with what explains the rest;
    where links bend by parts, gone on with their forms uncertain in the second.
    """
    fits = _further(fit, story, 1)
    if fits[0] is fit or not _open(fits):
        return fits
    if any(isinstance(one, LinkFlexibility) and one.nonuniform for one in fits[0].effects):
        return [gone_on(replace(fits[0], study=bending), fits[0].effects, {}, STEPS)]
    return _further(fits[0], story, 1, alone=True)


def _several(found: Found) -> bool:
    """Whether many give way a little."""
    unknowns = found.unknowns
    return sum(unknowns.moved(one, found.x, found.product) > SEEN for one in unknowns.units) > FEW


def _complete(kept: Pruned) -> bool:
    """Whether a model that explains the data leaves nothing to another start: links that bend, which its
    bearings may stand for, would gain no more than estimators get wrong.
    """
    found = kept.found
    if not kept.closed or any(isinstance(one, LinkFlexibility) for one in found.effects):
        return False
    local = Quadratic.about(found, (*found.effects, *links(found.study)), {})
    new = [unit for unit in local.units if isinstance(unit.effect, LinkFlexibility)]
    size = sum(len(unit.all) for unit in new)
    return local.gain(new) < found.unknowns.count * MATERIAL + found.price * size


def _begun(problem: Problem, story: Story) -> Found:
    """The fit from rigid bearings, base and mounts.  Where many give way, they may stand for one that acts
    elsewhere along its joint's axis, or for a link that bends: the fit is gone on with what leaves less than
    half as much.
    """
    story.doing("fitting with bearings that may give way")
    structure = _structure(problem)
    bearings = tuple(one for one in structure if not isinstance(one, LinkFlexibility))
    fit = _where_it_acts(located(dense_fit(problem, bearings, story.until)))
    if story.late or not (_several(fit) and _open([fit])):
        return fit
    story.doing("fitting with links that may give way, too")
    left = _half_of(fit)
    rival = fit.objective + 0.5 * fit.unknowns.count * np.log(left / fit.gap**2)
    other = dense_fit(problem, structure, story.until, rival)
    return other if other.gap**2 < left else fit


def _where_it_acts(fit: Found) -> Found:
    """The fit with one bearing after the other where it acts, as long as each leaves less than half."""
    while _several(fit) and _open([fit]):
        moved = next(_displaced(fit), fit)
        if moved.gap**2 >= _half_of(fit):
            break
        fit = moved
    return fit


def _half_of(fit: Found) -> float:
    """Square of the gap that leaves half as much."""
    return 1 + _LEFT * (fit.gap**2 - 1)


def _from_rigid(problem: Problem, bending: Problem, story: Story) -> tuple[Found, list[Found]]:
    """The fit from rigid springs, and that with what they do not stand for; nothing where many give way, and
    hide each other, unless they stand for one thing.
    """
    fit = _begun(problem, story)
    bends = any(isinstance(one, LinkFlexibility) for one in fit.effects)
    if story.late or not (bends or _several(fit)):
        return fit, _beside_bearings(fit, bending, story)
    fits = _beside_links(fit, bending, story) if bends else _further(fit, story, 1, alone=True)
    return fit, [] if _open(fits) or (fits[0] is fit and not bends) else fits


def _with_few(problem: Problem, bending: Problem, story: Story, unseen: Unseen | None) -> list[Pruned]:
    """What is missing where few springs give way, or many stand for one thing; else nothing."""
    begun, fits = _from_rigid(problem, bending, story)
    # Prices hold a fit a little open, never by so much: what is far off is another start's to explain.
    models = [(one, _aligned(one, story, unseen)) for one in fits if one.gap < _FAR or story.late]
    again = [one for one, model in models if _may_stand_for_others(one, model, begun.effects)]
    for one in again:
        if not story.late:
            other = afresh(one)
            models += [(other, _aligned(other, story, unseen))] if other.gap < CLOSED else []
    return [model for _, model in models]


def _aligned(found: Found, story: Story, unseen: Unseen | None) -> Pruned:
    """The fit without units that have no evidence.  Where that explains the data, axes of bearings that stay
    are turned and moved, and what only stood for that goes: none is softest exactly along the axes of its
    joint's frame, nor acts exactly there.
    """
    model = pruned(found, story.say, unseen)
    for others in (at_frames, _turned, _displaced):
        if model.closed and not story.late:
            again = [pruned(one, story.say, unseen) for one in others(model.found)]
            model = max([model, *again], key=_evidence)
    return model


def _turned(found: Found) -> Iterator[Found]:
    """The fit with all bearings coupled for which that pays."""
    pays = PAYS * found.price
    coupled = [pair for gain, [pair] in couplings(found) if gain > pays]
    if coupled:
        yield gone_on(found, exchanged(found.effects, coupled), {})


def _displaced(found: Found) -> Iterator[Found]:
    """The fit with each of its bearings and mounts elsewhere for which that pays."""
    return map(located, displaced(found, PAYS * found.price))


def _may_stand_for_others(found: Found, model: Pruned, structure: tuple[Effect, ...]) -> bool:
    """Whether more stayed than what entered: it may have given way only to stand for that, before it was
    there.
    """
    entered = sum(one not in structure for one in found.effects)
    return model.closed and 0 < entered < len(model.evidence)


def _with_instruments(problem: Problem, story: Story, rival: float = np.inf) -> list[Found]:
    """Where that leaves something open: with all instruments from the start, if that comes near the objective
    of a rival.
    """
    if story.late:
        return []
    story.doing("fitting again, with errors of every sensor and force")
    fit = usual_fit(problem, tuple(instruments(problem)), story.until, rival)
    return [located(fit)] if fit.ended or fit.objective < rival else []


def _likeliest(models: Sequence[Pruned], unseen: Unseen | None) -> Pruned | None:
    """Of those that leave nothing open the one with most evidence; where all leave something, the one that
    predicts unseen data best.
    """
    closed = [one for one in models if one.closed]
    if closed or unseen is None:
        return max(closed or models, key=_evidence, default=None)
    found = [(unseen(one.found.study, one.found.effects, one.found.values), one) for one in models]
    return min(found, key=lambda pair: pair[0], default=(0.0, None))[1]


def _evidence(model: Pruned) -> float:
    return model.found.log_evidence


def _best(fits: Sequence[Found], unseen: Unseen | None) -> Found:
    """The likeliest; where all leave something open, none of them is the truth, and the one that predicts
    unseen data best is kept.
    """
    if unseen is None or not _open(fits):
        return min(fits, key=_objective)
    return min(fits, key=lambda one: unseen(one.study, one.effects, one.values))


def _recognised(found: Found) -> Found:
    """The fit without sensors whose errors have no form of their own, such as a gain or exchanged axes."""
    known = weighed(found.unknowns, found.x, found.product, 1.0)
    units = [
        one
        for one in found.unknowns.units
        if not isinstance(one.effect, SensorMatrix)
        or not isinstance(fault_of(one, found.unknowns, found.x, known)[0], SensorMatrix)
    ]
    return gone_on(found, tuple(of_units(found, units)), {})


def _open(fits: Sequence[Found]) -> bool:
    return min(fits, key=_objective).gap >= CLOSED


def _further(found: Found, story: Story, most: int = _MOST_ENTERED, *, alone: bool = False) -> list[Found]:
    """The fit with what the springs have no amplitude for, as long as each pays for its parameters: the
    instruments or the bodies all at once, drives that relax, links that bend by parts, and all that the
    dictionary has, one by one; beside it what else closed the gap in the last round.  Where nothing is open,
    only what would lower the gap by more than estimators get wrong.  alone: only what is foreseen to explain
    all of the gap, of which first order sees half at least.
    """
    others, shares = list[Found](), dict[str, float]()
    if found.gap < CLOSED and not believable(found.problem, found.values):
        found = settled(found, STEPS)  # errors of a fit that has not ended say nothing
    for _ in range(most):
        believed = believable(found.problem, found.values)
        closed = found.gap < CLOSED and believed
        if story.late or (closed and found.gap < 1 + MATERIAL):
            break
        least = found.unknowns.count * MATERIAL if closed else 0.0
        more = _one_further(found, story, shares, least, believed=believed, alone=alone)
        if more is None:
            break
        found, others = more
    return [found, *others]


def _one_further(
    found: Found,
    story: Story,
    shares: dict[str, float],
    least: float,
    *,
    believed: bool,
    alone: bool,
) -> tuple[Found, list[Found]] | None:
    """The fit with the likeliest of what it lacks, and what else closes the gap; None where nothing pays;
    least: what it must gain beyond its price; believed: whether the fit's errors are; alone: as `_further`
    has it; shares: as `_tried` does.
    """
    story.doing("scoring what else may be missing")
    likely = [one._replace(gain=one.gain * shares.get(_new(found, one), 1.0)) for one in trials(found)]
    worth = _worth(found, likely, least or (found.left / _CLEARLY if alone else 0.0))
    story.doing("fitting the likeliest of it")
    # Errors beyond belief that leave much open have led elsewhere: trials begin as stated.  Where they leave
    # nothing open, what they make up for takes their place step by step.
    astray = not (believed or found.whole) and found.gap >= CLOSED
    stated = {one.name: 0.0 for one in found.problem.nuisances.entries} if astray else {}
    fitted = _tried(found, worth, stated, shares, believed=believed)
    if not fitted:
        return None
    [likeliest, *others] = sorted(fitted, key=_odds, reverse=True)
    best = settled(likeliest, STEPS)  # what a fit lacks that has not ended is no effect
    if not _pays(found, best, least):
        return None
    best = located(_with_others(found, best, others))
    story.say(f"With {', '.join(_added(found, best))}: gap {best.gap:.2f}.")
    return best, [one for one in others if one.gap < CLOSED <= found.gap]


def _pays(found: Found, more: Found, least: float = 0.0) -> bool:
    """Whether a fit with more pays for that, and gains so much beyond."""
    price_of_it = found.price * max(more.unknowns.size - found.unknowns.size, PAYS)
    return more.marginal - found.marginal >= price_of_it + least


def _with_others(found: Found, best: Found, others: Sequence[Found]) -> Found:
    """The best with each effect that was tried alone and pays beside it, too: what one link lacks says little
    of what another does, and a round of its own for each takes far longer.
    """
    known = found.values
    for one in others:
        if best.late or best.gap < CLOSED:
            break
        new, own = found.new(one.effects), {k: v for k, v in one.values.items() if k not in known}
        alone = len(new) == 1 and not one.new(found.effects)
        if alone and not own.keys() & best.values.keys() and _pays(found, one):
            more = gone_on(best, (*best.effects, *new), own, rival=best.objective)
            best = settled(more, STEPS) if _pays(best, more) else best
    return best


def _added(found: Found, best: Found) -> list[str]:
    """What a fit has more, in words."""
    new = found.new(best.effects) or [best.effects[-1]]
    return [new[0].sentence(), "and more"] if len(new) > 4 else [one.sentence() for one in new]


def _odds(found: Found) -> float:
    """More is likelier."""
    return found.marginal - found.price * found.unknowns.size + _before(found)


def _before(found: Found) -> float:
    """Logarithm of the prior odds for where bodies that entered by themselves hang: every other one of what
    nobody stated is a tool or payload on the last link.
    """
    last, others = found.study.robot.links[-1].name, len(found.study.robot.links) - 2
    bodies = [one for one in found.unknowns.entered if isinstance(one, AddedMass)]
    return float(np.log(max(others, 1)) * sum(one.link == last for one in bodies))


def _worth(found: Found, trials: Sequence[Trial], least: float) -> list[Trial]:
    """Where any gains so much at least, those that gain most beyond the price of their unknowns, and of other
    kinds what gains most for each of these: by first order large effects gain less than they do, and what
    says the same with few would not be seen.
    """
    if max((one.gain for one in trials), default=0.0) < least:
        return []
    worth = [one for one in trials if one.gain > PAYS * found.price]
    most = sorted(worth, key=lambda one: found.price * one.size - one.gain)
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
    shares: dict[str, float],
    *,
    believed: bool,
) -> list[Found]:
    """The fit gone on with each trial, the most promising after a few steps to their end; start: values that
    all begin with beside their own; shares: of what was foreseen, what trials gained, which is known better
    than the first order of what they would gain now.
    """
    pairs = sorted(_glanced(found, trials, start), key=lambda pair: -_odds(pair[1]))
    # What is foreseen to be worth most may begin slowly, and what gains most for each unknown be likeliest.
    pairs[1:] = sorted(pairs[1:], key=lambda pair: pair[0] is not trials[0])
    pairs[2:] = sorted(pairs[2:], key=lambda pair: (pair[1].unpriced - found.unpriced) / max(pair[0].size, 1))
    fitted = list[Found]()
    for place, (trial, fit) in enumerate(pairs):
        # What errors beyond belief have made up for goes back slowly, and is not told by its pace.
        rival = min(map(_objective, fitted), default=np.inf) if believed or found.whole else np.inf
        own = _ended(found, fit, rival, believed=believed) if place < _SETTLED else fit
        gained = max(found.unpriced - own.unpriced, 0.0)
        new, share = _new(found, trial), gained / max(trial.gain, 1e-9)
        shares[new] = min(shares.get(new, 1.0) * share, 1.0)
        fitted.append(own)
    return fitted


def _glanced(
    found: Found, trials: Sequence[Trial], start: Mapping[str, float]
) -> Iterator[tuple[Trial, Found]]:
    """Some steps with each trial, until one gains twice as much as any that follows is foreseen to gain; all
    of them near the data, where errors that are out leave first order little to foresee.
    """
    most = 0.0
    for one in trials:
        if most > _CLEARLY * one.gain and found.gap >= CLOSED:
            return
        fit = gone_on(found, one.effects, {**start, **one.values}, _GLANCED)
        most = max(most, found.unpriced - fit.unpriced)
        yield one, fit


def _ended(found: Found, fit: Found, rival: float, *, believed: bool) -> Found:
    """A trial's fit to its end; where several free sensors leave something open, with those alone whose
    errors have the form of a fault: others compensate for shapes that are not there yet, and would keep them
    out.  One alone has to pay for itself.

    Errors beyond belief have made up for what the trial may be, and go back along a valley that bends, slowly
    even beside the truth: where they do not go back, the fit is begun afresh, too.
    """
    more = settled(fit, rival=rival)
    several = any(isinstance(one, SensorMatrix) and len(one.points) > 1 for one in found.new(fit.effects))
    if several and more.gap >= CLOSED:
        more = _recognised(more)
    if believed or found.whole or (more.gap < CLOSED and believable(more.problem, more.values)):
        return more
    return min([more, afresh(more, more.objective)], key=_objective)


def _objective(fit: Found) -> float:
    return fit.objective
