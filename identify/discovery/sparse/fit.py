"""A dense fit: where it starts, how it ends, and the same gone on with more effects or with fewer."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import DampingValues
from identify.discovery.sparse.dense import rotors, with_more
from identify.discovery.sparse.evidence import price
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.unknowns import Unit, Unknowns
from identify.model.effects.base import Effect
from identify.model.effects.coupling import soft_axes
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.model.effects.springs import STIFF, Springs
from identify.vibration.all_springs import usual_rigidity, usual_springs, usual_stiffness
from identify.vibration.problem import Problem
from identify.vibration.scales import scaled_drives

_LOOSE, _ROBUST_STEPS, _LOOSE_STEPS, STEPS = 0.3, 6, 12, 30
"""Price of the first steps, by logarithmic residuals and by the likelihood; steps of each stage."""
_MORE = 12
"""Steps after something entered or left."""


@dataclass(frozen=True)
class Found:
    """A dense fit: the study's problem, the unknowns of that with all effects, where it ended, its gap,
    objective, and that without the prices of amplitudes; effects: what it has beyond the study; product (f +
    1, f + 1): [J r]'[J r] there; until: when steps end, s of the monotonic clock; whole: whether it
    began with every spring as compliant as is usual, or rigid.
    """

    study: Problem
    unknowns: Unknowns
    effects: tuple[Effect, ...]
    x: Array
    gap: float
    objective: float
    unpriced: float
    product: Array
    until: float = np.inf
    ended: bool = False
    whole: bool = False

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.until

    @property
    def problem(self) -> Problem:
        """With all effects."""
        return self.unknowns.problem

    def new(self, effects: Sequence[Effect]) -> list[Effect]:
        """Those of other effects that it does not have."""
        return [one for one in effects if one not in self.effects]

    @property
    def price(self) -> float:
        """What each parameter costs, in units of log likelihood."""
        return price(self.unknowns.count)

    @property
    def left(self) -> float:
        """What explaining all of the gap would gain, in units of log likelihood with a free scale."""
        return self.unknowns.count * float(np.log(max(self.gap, 1.0)))

    @cached_property
    def marginal(self) -> float:
        """Logarithm of the likelihood with nuisance parameters integrated out (Laplace) but for a constant:
        what their priors pay for is not priced once more.
        """
        error = self.unknowns.nuisances
        known = self.product[:-1, :-1][np.ix_(error, error)] / max(self.gap, 1.0) ** 2
        return float(-self.unpriced - 0.5 * np.linalg.slogdet(known + np.eye(len(known)))[1])

    @property
    def log_evidence(self) -> float:
        """Logarithm of the marginal likelihood but for a constant: half ln N for each parameter."""
        return self.marginal - self.price * self.unknowns.size_at(self.x)

    @property
    def values(self) -> dict[str, float]:
        """Of all unknowns, by name."""
        return self.unknowns.by_name(self.x)


def dense_fit(
    problem: Problem, effects: tuple[Effect, ...], until: float = np.inf, rival: float = np.inf
) -> Found:
    """From springs that are rigid, which is near where one thing is missing; not to its end where it does not
    come near the objective of a rival.
    """
    unknowns = _unknowns(problem, effects)
    x = _led(unknowns, _start(unknowns, usual=False), until, rival)
    return _settled(problem, effects, x, Penalised(unknowns), STEPS, until, rival)


def usual_fit(
    problem: Problem, more: tuple[Effect, ...], until: float = np.inf, rival: float = np.inf
) -> Found:
    """From bearings, base, mounts and links that give way as they usually do beside their drives, where all
    of them do so, and some far more: small ones hide each other on the way from rigid.  What is usual follows
    the drives.  What holds their rotors may give way: else bearings and bodies would stand for that.  Not to
    its end where it does not come near the objective of a rival.
    """

    more = (*rotors(problem), *more)

    def beside(values: Mapping[str, float]) -> tuple[tuple[Effect, ...], Unknowns]:
        effects = (*usual_springs(problem, values, damped=DampingValues()), *more)
        return effects, _unknowns(problem, effects)

    _, unknowns = beside(problem.starts)
    x = _robust(unknowns, _start(unknowns, usual=True))
    _, unknowns = beside(unknowns.by_name(x))
    x = _loose(unknowns, x, until, rival)
    effects, unknowns = beside(unknowns.by_name(x))
    return replace(_settled(problem, effects, x, Penalised(unknowns), STEPS, until, rival), whole=True)


def standing(problem: Problem, effects: tuple[Effect, ...], values: Mapping[str, float]) -> Found:
    """The problem's own model at values, with effects of which there is nothing yet."""
    unknowns = _unknowns(problem, effects)
    return _settled(problem, effects, unknowns.at(values), Penalised(unknowns), 0, np.inf)


def _unknowns(study: Problem, effects: tuple[Effect, ...], entered: tuple[Effect, ...] = ()) -> Unknowns:
    """Of a study's problem with effects beyond its own."""
    return Unknowns(with_more(study, effects), len(study.file.study.effects), entered)


def _settled(
    study: Problem,
    effects: tuple[Effect, ...],
    x: Array,
    fit: Penalised,
    steps: int,
    until: float,
    rival: float = np.inf,
) -> Found:
    last = fit.minimise(Point(x), steps, until, rival)
    x, ended = last.x, last.settled
    squares, local = fit.squares(x), fit.local(x)
    gap, objective = float(np.sqrt(squares / fit.count)), fit.value(squares, x, local)
    unpriced = Penalised(fit.unknowns, price=0.0).value(squares, x, local)
    return Found(study, fit.unknowns, effects, x, gap, objective, unpriced, local.product, until, ended)


def _onwards(
    found: Found,
    effects: tuple[Effect, ...],
    x: Array,
    fit: Penalised,
    steps: int,
    rival: float = np.inf,
) -> Found:
    ended = _settled(found.study, effects, x, fit, steps, found.until, rival)
    return replace(ended, whole=found.whole)


def _start(unknowns: Unknowns, *, usual: bool) -> Array:
    """On the scale of all drives that is best by logarithms, with rigid or usual bearings."""
    fit, problem = Penalised(unknowns, logarithmic=True), unknowns.problem
    scaled = [np.clip(unknowns.to_x(values), *unknowns.limits) for values in scaled_drives(problem)]
    rigid = [np.where(unknowns.springs | unknowns.nuisances, unknowns.reference, x) for x in scaled]
    return min([_usual(unknowns, x) if usual else x for x in rigid], key=fit.squares)


def _usual(unknowns: Unknowns, x: Array) -> Array:
    """With compliances of usual bearings and links beside the drives at x (f,)."""
    found, values, model = x.copy(), unknowns.by_name(x), unknowns.problem
    links = {one.link: one for one in model.file.study.effects if isinstance(one, LinkFlexibility)}
    for number in np.flatnonzero(unknowns.springs):
        body, axis, *_ = unknowns.names[number].split(".")
        if body in links:
            stiffness = usual_rigidity(model.robot, links[body], values)
        else:
            stiffness = usual_stiffness(body, axis, values)
        found[number] = min(1 / stiffness, unknowns.limits[1][number])
    return found


def gone_on(
    found: Found,
    effects: tuple[Effect, ...],
    values: Mapping[str, float],
    steps: int = _MORE,
    rival: float = np.inf,
) -> Found:
    """The fit gone on with other effects; those that are new begin with `values`, or with nothing.  Not to
    its end where it does not come near the objective of a rival.
    """
    unknowns, x = begun(found, effects, values)
    return _onwards(found, effects, x, Penalised(unknowns), steps, rival)


def settled(found: Found, steps: int = _MORE, rival: float = np.inf) -> Found:
    """The fit gone on as it is, if it has not ended; not where it does not come near the objective of a
    rival.
    """
    if found.ended:
        return found
    return _onwards(found, found.effects, found.x, Penalised(found.unknowns), steps, rival)


def afresh(found: Found, rival: float = np.inf) -> Found:
    """The fit from rigid bearings and links and no errors again, with all else as it was found: a fit that
    compensated for something else than it has now is in a valley of its own.  Not to its end where it does
    not come near the objective of a rival.
    """
    unknowns = found.unknowns
    reset = unknowns.springs | unknowns.nuisances | unknowns.times
    rigid = np.where(reset, unknowns.reference, found.x)
    x = _led(unknowns, rigid, found.until, rival)
    return _onwards(found, found.effects, x, Penalised(unknowns), STEPS, rival)


def _led(unknowns: Unknowns, x: Array, until: float, rival: float) -> Array:
    """The first steps."""
    return _loose(unknowns, _robust(unknowns, x), until, rival)


def _robust(unknowns: Unknowns, x: Array) -> Array:
    """By logarithms, which prices hardly hold; with payloads on soft mounts, too, which no step finds from
    rigid ones: their resonances have to come down through the whole band.
    """
    fit = Penalised(unknowns, logarithmic=True, price=_LOOSE)
    starts = [x] if (soft := _on_soft_mounts(unknowns, x)) is None else [x, soft]
    return min([fit.led(Point(start), _ROBUST_STEPS).x for start in starts], key=fit.squares)


def _on_soft_mounts(unknowns: Unknowns, x: Array) -> Array | None:
    """With payloads that turn where robots resonate; None where no mount may give way."""
    may = [name.startswith("payload") and name.split(".")[1][0] == "r" for name in unknowns.names]
    mounts = np.flatnonzero(np.array(may) & unknowns.springs)
    found = x.copy()
    found[mounts] = [unknowns.problem.parameters[n].initial / STIFF for n in unknowns.free[mounts]]
    return np.clip(found, *unknowns.limits) if len(mounts) else None


def _loose(unknowns: Unknowns, x: Array, until: float, rival: float = np.inf) -> Array:
    """By the likelihood, which they hardly hold, either."""
    return Penalised(unknowns, price=_LOOSE).minimise(Point(x), _LOOSE_STEPS, until, rival).x


def begun(found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> tuple[Unknowns, Array]:
    """Unknowns with other effects, and where they begin."""
    new = found.new(effects)
    entered = (*found.unknowns.entered, *(new if len(new) == 1 else ()))
    unknowns = _unknowns(found.study, effects, entered)
    return unknowns, unknowns.at({**found.values, **values})


def refitted(found: Found, units: Sequence[Unit]) -> Found:
    """The fit with these units only, no price on any of them."""
    effects = tuple(of_units(found, units))
    # Priors stay where they were: what was found is where it starts, not their centre.
    unknowns, x = begun(found, effects, {})
    return _onwards(found, effects, x, Penalised(unknowns, price=0.0), STEPS)


def of_units(found: Found, units: Sequence[Unit]) -> list[Effect]:
    """Dense effects that have these units and no others; an axis of one that stays rigid may still give way
    once something else is gone that stands for it.
    """
    kept: list[Effect] = []
    for effect in found.effects:
        own = [unit for unit in units if unit.effect == effect]
        if isinstance(effect, Springs):
            soft, coupled = soft_axes(found.unknowns.soft(own, found.x))
            may, _ = soft_axes(found.unknowns.names[n].split(".")[1] for unit in own for n in unit.amplitudes)
            if soft:
                axes = [axis for axis in effect.axes if axis in may]
                kept.append(effect.model_copy(update={"axes": axes, "coupled": coupled}))
        elif isinstance(effect, SensorMatrix):
            points = [point for point in effect.points if str(point) in {unit.name for unit in own}]
            if points:
                kept.append(effect.model_copy(update={"points": points}))
        elif own:
            kept.append(effect)
    return kept
