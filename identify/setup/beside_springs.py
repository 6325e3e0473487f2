"""Mistakes of the set-up of an arm with many small effects: judged beside every spring.

A study's own model is a poor judge there: a dozen soft bearings leave more than a turned sensor or a reversed
joint does.  The model with every bearing, the base and the links free (`soft`) explains those, and what it
leaves of a mistake is not like the rest.  Of each kind the one that promises most by the study's own model at
a glance, and of single channels what explains most of what the soft model leaves, are fitted with every
spring; what is best becomes the base of another round.  Each must be worth its price beside the others, as in
`decide`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import CONVINCING
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.setup.constants import Factor, near
from identify.setup.decide import left_of, log_odds
from identify.setup.edits import Change
from identify.setup.hypothesis import Hypothesis
from identify.setup.registry import KINDS
from identify.setup.score import SLIGHT, Score, scored
from identify.setup.search import HELPS, Candidate, finer, glanced, of_kinds, without
from identify.setup.soft import LINES, softened, with_springs
from identify.setup.stated import Stated
from identify.setup.within import times, within

_CHANNELS = ("sensor-turned", "points-exchanged", "links", "sizes")
"""Kinds about how single channels are read, which the soft model itself proposes."""
_PHYSICAL = ("payload",)
"""Kinds that stand for what an arm may have: hoses are bodies, too, and effects that `discover` names."""
_PROMISING, _SETTLED = 10, 3
"""Hypotheses about channels that are fitted for a few steps in a round, and of all, that are for more."""
_LEFT = 0.5
"""Share of the squares that may be left: hoses and stated errors leave theirs, which no spring explains.  Of
24 right arms with two dozen effects nothing left less than 0.8, mistakes left 0.01 to 0.28.
"""
_FEW = GaussNewton(evaluations=6, tolerance=1e-2)
_MORE = GaussNewton(evaluations=20, tolerance=5e-3)


@dataclass(frozen=True)
class Found:
    """Mistakes; common factors that the FRFs may have, the nearest first; the least of their log odds; what
    puts all right, and the gaps that every spring leaves before and after.
    """

    hypotheses: tuple[Hypothesis, ...]
    factors: tuple[Factor, ...]
    log_odds: float
    edits: tuple[Change, ...]
    gap_before: float
    gap_after: float


def beside_springs(stated: Stated, plain: Score) -> Found | None:
    """What is wrong about a study, whose fit as stated is known; None where nothing is."""
    first, own = Candidate(stated, softened(plain)), plain
    best, asked = first, 1
    while True:
        hypotheses, every = _promising(best, own)
        asked = max(asked, every)
        found = _next(best, hypotheses, asked)
        if found is None:
            break
        own = scored(found.stated.problem())
        best = min(found, replace(found, score=softened(own)), key=_cost)  # what was wrong led into a valley
    best, odds = _needed(first, best, asked)
    edits = tuple(edit for one in best.hypotheses for edit in one.settled(best.score))
    factors, odds_of_factor = _factors(best, asked)
    if factors:
        edits += times(best.stated, 1 / factors[0].value)
        stated = first.stated.changed(edits)
        best = replace(best, stated=stated, score=_fitted(stated, best.score))
    if not edits:
        return None
    gaps = [within(one.score, None).gap for one in (first, best)]
    if gaps[1] >= gaps[0]:
        return None
    return Found(best.hypotheses, factors, min(odds, odds_of_factor), edits, *gaps)


def _factors(best: Candidate, asked: int) -> tuple[tuple[Factor, ...], float]:
    """Known factors near the common factor of the measured FRFs, where that explains most, and its odds."""
    if abs(best.score.level) < SLIGHT:
        return (), np.inf
    squares = [best.score.squares(levelled=it) for it in (False, True)]
    count = sum(len(one) for one in squares[0])
    share = sum(map(np.sum, squares[1])) / sum(map(np.sum, squares[0]))
    odds = log_odds(float(share), count, _LEFT) - float(np.log(asked))
    if odds < CONVINCING:
        return (), np.inf
    value = float(np.exp(best.score.level))
    return tuple(sorted(near(value), key=lambda one: abs(np.log(abs(one.value / value))))), odds


def _promising(best: Candidate, own: Score) -> tuple[list[Hypothesis], int]:
    """The most promising hypotheses on top of a candidate, by its fit with springs and by its own without;
    and of how many.
    """
    channels = list(of_kinds(best, _CHANNELS))
    rest = [name for name in KINDS if name not in (*_CHANNELS, *_PHYSICAL)]
    others = list(of_kinds(replace(best, score=own), rest))
    by_squares = sorted(channels, key=lambda one: -one.promise)[:_PROMISING]
    tried = sorted(glanced(replace(best, score=own), others), key=_cost)
    last = [one.hypotheses[-1] for one in tried]
    best_of_kind = {one.code: one for one in reversed(last)}
    some = {id(one): one for one in (*best_of_kind.values(), *last[:_PROMISING])}
    return [*by_squares, *some.values()], len(channels) + len(others)


def _next(base: Candidate, hypotheses: Sequence[Hypothesis], asked: int) -> Candidate | None:
    """A candidate with one more mistake: the best that is worth its price, or else the best that helps, which
    may be worth it beside those that are still there.
    """
    best: list[Candidate] = []
    for hypothesis in hypotheses:  # a model with every spring is large: no more of them are kept
        one = _tried(base, hypothesis)
        best = sorted([*best, *([] if one is None else [one])], key=_cost)[:_SETTLED]
    settled = sorted((_settled(base, one) for one in best), key=_cost)
    worth = [one for one in settled if _odds(base, one, asked) >= CONVINCING]
    return next(iter(worth or [one for one in settled if _helps(base, one)]), None)


def _settled(base: Candidate, one: Candidate) -> Candidate:
    """A candidate fitted for more steps, with better numbers in its last mistake, if that helps."""
    one = replace(one, score=scored(one.score.problem, one.score.values, _MORE))
    last = one.hypotheses[-1]
    if last.moved is None or not _helps(base, one):
        return one
    best = finer(one, partial(_fitted, steps=_FEW))
    numbers = best.hypotheses[-1].numbers
    # What comes down to nothing is an error of what is stated, such as of the posture, and no mistake.
    return base if numbers is None or np.linalg.norm(numbers) < last.reach else best


def _helps(base: Candidate, one: Candidate) -> bool:
    return _cost(one) <= HELPS * _cost(base)


def _tried(base: Candidate, hypothesis: Hypothesis) -> Candidate | None:
    """A candidate with one more mistake put right, fitted for a few steps from its values on; None where that
    makes no study, or a model that has no solution.
    """
    try:
        stated = base.stated.changed(hypothesis.edits)
        return Candidate(stated, _fitted(stated, base.score, _FEW), (*base.hypotheses, hypothesis))
    except (InputError, InputErrors, np.linalg.LinAlgError):
        return None


def _fitted(stated: Stated, known: Score, steps: GaussNewton = _MORE) -> Score:
    """Of a variant with every spring, from the values of another."""
    model = with_springs(replace(stated, lines=LINES).problem(), known.by_name)
    return scored(model, model.initial, steps)


def _cost(one: Candidate) -> float:
    return one.score.cost


def _odds(before: Candidate, after: Candidate, asked: int) -> float:
    """ln of the odds of what one candidate has otherwise, less its price."""
    share, count = left_of(before, after)
    return log_odds(share, count, _LEFT) - float(np.log(asked))


def _needed(first: Candidate, best: Candidate, asked: int) -> tuple[Candidate, float]:
    """A candidate without mistakes that it does not need beside the others, and the least of their odds."""
    least = np.inf
    for one in best.hypotheses:
        rest = _without(first, best, one)
        odds = np.inf if rest is None else _odds(rest, best, asked)
        if rest is not None and odds < CONVINCING:
            best = rest
        else:
            least = min(least, odds)
    return best, least


def _without(first: Candidate, best: Candidate, hypothesis: Hypothesis) -> Candidate | None:
    """A candidate without one of its mistakes, fitted again; None where that makes no study, or a later one
    holds it too.
    """
    if len(best.hypotheses) == 1:
        return first
    try:
        rest = without(first, best, hypothesis)
        return None if rest is None else Candidate(rest[0], _fitted(rest[0], best.score), rest[1])
    except (InputError, InputErrors, np.linalg.LinAlgError):
        return None
