"""The loop: of all effects not yet there, add the one that takes most of the residual
of the held-out record, as long as there is evidence for it there; refit; drop what is no longer needed.

Fitted on one record, judged on another: a coefficient never sees the record that says whether its effect is
real.  An effect passes where its evidence there is above `LEAST` and the gain is spread over the record
(chance of no mean gain below 5 %).  Of noise alone, two records agree on a coefficient so well with a chance
below 1e-3 per coefficient.  Where no single effect passes, pairs at one joint are tried, because each of two
large effects can hide the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import effective_samples
from identify.core.interruption import check
from identify.explain.candidates import Worth, worth
from identify.explain.effects.base import MotionEffect
from identify.explain.regression import Case, Fit, Screen, aligned, refine, solve, without

LEAST = 2.0
"""Natural logarithm of the odds that count as evidence."""
LEAST_SHARE = 0.003
"""Part of what a joint's residual still holds on the held-out record, in squares, that an effect must take to
be worth a name.
"""
_CHANCE = 0.05
_RIVAL = 3.0
_SEEDS = 4
_PAIR = 5.0
"""Further evidence that a pair needs, because there are some hundred pairs to choose from."""
_PAIR_SHARE = 0.2
"""Part of what is left that a pair must take: only large effects hide each other."""
_ALIKE = 0.9
"""Effects that take this part of the largest share are alike; the simplest of them is taken."""
_Found = tuple[MotionEffect, Fit, Worth]
Report = Callable[[int, str], None]


@dataclass(frozen=True)
class Step:
    """One effect added: what it was worth then, and the residual it left, RMS per joint on both records."""

    effect: MotionEffect
    worth: Worth
    rms_fit: Array
    rms_judge: Array


@dataclass(frozen=True)
class Grown:
    """A fit and the steps that led to it."""

    fit: Fit
    steps: tuple[Step, ...]


@dataclass(frozen=True)
class Explanation:
    """What explains a target: the fit, the steps that led to it, and what was there before any effect.

    worths: what each effect of the fit is worth at the end, by leaving it out; rivals: per effect, names of
    others that would do about as well in its place; other: the same effects fitted to the judging record, for
    comparison; tried: number of candidates.
    """

    fit: Fit
    start: Fit
    steps: tuple[Step, ...]
    worths: tuple[Worth, ...]
    rivals: tuple[tuple[str, ...], ...]
    other: Fit
    tried: int


def conclude(fitted: Case, judge: Case, effects: Sequence[MotionEffect], whole: Grown) -> Explanation:
    """What was grown out of `effects`, from all sides."""
    fit = whole.fit
    worths = tuple(_leave_out(fitted, judge, fit, effect) for effect in fit.effects)
    rivals = tuple(_rivals(fitted, judge, fit, effect, effects) for effect in fit.effects)
    other = refine(judge, _reweighted(judge, solve(judge, fit.effects, fit.shapes, fit.weights)))
    start = solve(fitted, (), (), fit.weights)
    return Explanation(fit, start, whole.steps, worths, rivals, other, len(effects))


def grow(
    fitted: Case,
    judge: Case,
    effects: Sequence[MotionEffect],
    grown: Grown | None = None,
    report: Report | None = None,
) -> Grown:
    """Add effects as long as one passes; grown: what to begin with, as when the loads became known better, as
    far as it still holds.
    """
    fit, steps = solve(fitted, (), (), np.ones(fitted.wanted.shape[1])), list(grown.steps if grown else ())
    fit = _reweighted(fitted, fit)
    if grown is not None:
        fit = refine(fitted, solve(fitted, grown.fit.effects, grown.fit.shapes, grown.fit.weights))
        fit, _ = _prune(fitted, judge, fit)
    banned = set[str]()
    while True:
        open_ones = [effect for effect in effects if effect.name not in banned]
        found = _best(fitted, judge, fit, open_ones) or _best_pair(fitted, judge, fit, open_ones)
        if not found:
            return Grown(fit, tuple(steps))
        for effect, after, gained in found:
            steps.append(Step(effect, gained, rms(fitted, after), rms(judge, aligned(judge, after))))
            if report is not None:
                report(len(steps), effect.name)
        fit, dropped = _prune(fitted, judge, _reweighted(fitted, refine(fitted, found[-1][1])))
        # What was dropped once may be right later, but not for ever, or two effects could take turns.
        banned |= {name for name in dropped if sum(step.effect.name == name for step in steps) > 1}


def rms(case: Case, fit: Fit) -> Array:
    """RMS of what is left (joints,) over the samples that count."""
    residual = fit.residual(case)
    return np.asarray(np.sqrt((residual**2).sum(axis=0) / np.maximum(case.used.sum(axis=0), 1)))


def _best(fitted: Case, judge: Case, fit: Fit, effects: Sequence[MotionEffect]) -> list[_Found]:
    """The effect that takes most of the residual among those that pass, with its fit; none where none
    does.
    """
    passed = [one for one in _tried(fitted, judge, fit, effects) if _passes(one[2])]
    most = max((one[2].total for one in passed), default=0.0)
    alike = [one for one in passed if one[2].total >= _ALIKE * most]
    return [min(alike, key=lambda one: (_size(one[0], fitted), -one[2].evidence))] if alike else []


def _best_pair(fitted: Case, judge: Case, fit: Fit, effects: Sequence[MotionEffect]) -> list[_Found]:
    """Two effects at one joint that pass together, the likelier first; none where no pair does.  Waves hide
    nothing and are not tried.
    """
    best: list[_Found] = []
    effects = [effect for effect in effects if not effect.wave]
    most = 0.0
    singles = sorted(_tried(fitted, judge, fit, effects), key=lambda one: -one[2].total)
    for joint in {effect.axis for effect in effects}:
        for first in [one for one in singles if one[0].axis == joint][:_SEEDS]:
            for second in _tried(
                fitted, judge, first[1], [effect for effect in effects if effect.axis == joint]
            ):
                both = worth(judge, fit, second[1])
                if _passes(both) and both.evidence > LEAST + _PAIR and both.total > max(most, _PAIR_SHARE):
                    best, most = [first, second], both.total
    return best


def _tried(fitted: Case, judge: Case, fit: Fit, effects: Sequence[MotionEffect]) -> list[_Found]:
    """Every effect that may come now, with its fit and what it is worth."""
    there = {effect.name for effect in fit.effects}
    replaced = {effect.supersedes for effect in fit.effects}
    found, screens = [], {"": Screen(fitted, fit)}
    for effect in effects:
        check()
        if effect.name in there | replaced or (effect.needs and effect.needs not in there):
            continue
        taken = effect.supersedes if effect.supersedes in there else ""
        if taken not in screens:
            screens[taken] = Screen(fitted, fit, taken)
        after = screens[taken].added(effect)
        if after is not None:
            found.append((effect, after, worth(judge, fit, after)))
    return found


def _size(effect: MotionEffect, case: Case) -> int:
    return len(effect.coefficients) + len(effect.parameters(case.scene))


def _passes(gained: Worth) -> bool:
    return gained.evidence > LEAST and gained.chance < _CHANCE and gained.total > LEAST_SHARE


def _missed(gained: Worth) -> bool:
    """Whether the held-out record misses an effect: the odds are for it, or its gain is worth a name and
    spread over the record.
    """
    return gained.evidence > 0 or (gained.chance < _CHANCE and gained.total > LEAST_SHARE)


def _prune(fitted: Case, judge: Case, fit: Fit) -> tuple[Fit, list[str]]:
    """Leave out, worst first, effects whose sign cannot be, and those that the held-out record does not
    miss.
    """
    dropped: list[str] = []
    while len(fit.effects) > 1:
        held = {effect.needs for effect in fit.effects}
        loose = [effect for effect in fit.effects if effect.name not in held]
        values = [_leave_out(fitted, judge, fit, effect) for effect in loose]
        wrong = [n for n, effect in enumerate(loose) if effect.positive and fit.of(effect)[0] < 0]
        open_ones = wrong or [n for n, value in enumerate(values) if not _missed(value)]
        if not open_ones:
            break
        worst = min(open_ones, key=lambda n: values[n].total)
        dropped.append(loose[worst].name)
        fit = _reweighted(fitted, refine(fitted, without(fitted, fit, loose[worst].name)))
    return fit, dropped


def _leave_out(fitted: Case, judge: Case, fit: Fit, effect: MotionEffect) -> Worth:
    return worth(judge, without(fitted, fit, effect.name), fit)


def _rivals(
    fitted: Case, judge: Case, fit: Fit, effect: MotionEffect, effects: Sequence[MotionEffect]
) -> tuple[str, ...]:
    """Names of effects that in place of this one do about as well on the held-out record: evidence within 3,
    and half of its share.

    A wave has no rival but another wave, and those were all tried beside it.
    """
    if effect.wave:
        return ()
    rest = without(fitted, fit, effect.name)
    others = [other for other in effects if effect.name not in (other.needs, other.name) and not other.wave]
    swaps = _tried(fitted, judge, rest, others)
    half = 0.5 * worth(judge, rest, fit).total
    alike = [one for one in swaps if one[2].total > half and one[2].evidence > 0]
    return tuple(other.name for other, swapped, _ in alike if worth(judge, swapped, fit).evidence < _RIVAL)


def _weights(case: Case, fit: Fit) -> Array:
    """One over the size of what is left per joint, where it counts as many samples as it is worth."""
    residual, sizes = fit.residual(case), rms(case, fit)
    worths = [
        effective_samples(residual[:, joint], case.used[:, joint]) for joint in range(residual.shape[1])
    ]
    share = np.sqrt(np.array(worths) / np.maximum(case.used.sum(axis=0), 1))
    return np.asarray(np.where(sizes > 0, share / np.maximum(sizes, 1e-300), 1.0))


def _reweighted(case: Case, fit: Fit) -> Fit:
    return solve(case, fit.effects, fit.shapes, _weights(case, fit))
