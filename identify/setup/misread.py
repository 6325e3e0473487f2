"""Channels that are misread on a robot with many small effects: judged beside every spring.

A study's own model is a poor judge there: a dozen soft bearings leave more than a turned sensor does.  The
model with every bearing, the base and the links free (`soft`) is nearly right all the same, because most
channels are, and what it leaves of a misread one is not like the rest.  How channels are read does not change
it, so that a mistake is tried at its values first, and fitted again only where it promises most.  Each must
leave at most a quarter of the squares that it touches beside the others, and be worth its price, as in
`decide`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import CONVINCING
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.setup.decide import left_of, log_odds
from identify.setup.hypothesis import Hypothesis
from identify.setup.score import Score, scored
from identify.setup.search import HELPS, Candidate, of_kinds
from identify.setup.soft import softened, with_springs
from identify.setup.stated import Stated
from identify.setup.within import within
from identify.vibration.log_shape import LogShape
from identify.vibration.problem import Problem

_KINDS = ("sensor-turned", "points-exchanged", "links", "sizes")
"""Kinds about how single channels are read."""
_PROMISING, _TRIED = 10, 3
"""Hypotheses of a round that are tried, and of these, that are fitted again."""
_AGAIN = GaussNewton(evaluations=10, tolerance=5e-3)


@dataclass(frozen=True)
class Misread:
    """Mistakes in how channels are read, with the least of their log odds, and the gaps that every spring
    leaves before and after.
    """

    hypotheses: tuple[Hypothesis, ...]
    log_odds: float
    gap_before: float
    gap_after: float


def misread(stated: Stated, plain: Score) -> Misread | None:
    """What is misread in a study, whose fit as stated is known; None where nothing is."""
    first = Candidate(stated, softened(plain))
    best, asked = first, 1
    while True:
        hypotheses = list(of_kinds(best, _KINDS))
        asked = max(asked, len(hypotheses))
        found = _next(best, hypotheses, asked)
        if found is None:
            break
        best = found
    best, odds = _needed(first, best, asked)
    if best is first:
        return None
    gaps = [within(one.score, None).gap for one in (first, best)]
    return Misread(best.hypotheses, odds, *gaps) if gaps[1] < gaps[0] else None


def _next(base: Candidate, hypotheses: Sequence[Hypothesis], asked: int) -> Candidate | None:
    """A candidate with one more mistake: the best that is worth its price, or else the best that helps, which
    may be worth it beside those that are still there.
    """
    promising = sorted(hypotheses, key=lambda one: -one.promise)[:_PROMISING]
    read = [one for h in promising if (one := _read(base, h)) is not None]
    fitted = sorted(map(_fitted, sorted(read, key=_cost)[:_TRIED]), key=_cost)
    worth = [one for one in fitted if _odds(base, one, asked) >= CONVINCING]
    helping = [one for one in fitted if _cost(one) <= HELPS * _cost(base)]
    return next(iter(worth or helping), None)


def _read(base: Candidate, hypothesis: Hypothesis) -> Candidate | None:
    """A candidate with one more mistake put right, at its values; None where that makes no study."""
    try:
        stated = base.stated.changed(hypothesis.edits)
        score = _at(with_springs(stated), base.score)
    except (InputError, InputErrors):
        return None
    return Candidate(stated, score, (*base.hypotheses, hypothesis))


def _at(problem: Problem, known: Score) -> Score:
    """The score of a problem at the values of another, by name."""
    by_name = dict(zip((p.name for p in known.problem.parameters), known.values, strict=True))
    told = zip(problem.parameters, problem.initial, strict=True)
    values: Array = np.array([by_name.get(p.name, own) for p, own in told])
    shape = LogShape(problem)
    return Score(problem, values, float(shape.costs(values[None])[0]), shape.level(values))


def _fitted(one: Candidate) -> Candidate:
    return replace(one, score=scored(one.score.problem, one.score.values, _AGAIN))


def _cost(one: Candidate) -> float:
    return one.score.cost


def _odds(before: Candidate, after: Candidate, asked: int) -> float:
    """ln of the odds of what one candidate has read otherwise, less its price."""
    share, count = left_of(before, after)
    return log_odds(share, count) - float(np.log(asked))


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
    """A candidate without one of its mistakes, fitted again; None where that makes no study."""
    others = tuple(one for one in best.hypotheses if one is not hypothesis)
    if not others:
        return first
    try:
        stated = first.stated.changed([edit for one in others for edit in one.edits])
        return _fitted(Candidate(stated, _at(with_springs(stated), best.score), others))
    except (InputError, InputErrors):
        return None
