"""Mistakes of the set-up of an arm with many small effects: judged beside every spring.

A study's own model is a poor judge there: a dozen soft bearings leave more than a turned sensor or a reversed
joint does.  The model with every bearing, the base and the links free (`soft`) explains those, and what it
leaves of a mistake is not like the rest.  Of each kind the one that promises most by the study's own model at
a glance, and of single channels what explains most of what the soft model leaves, are fitted with every
spring; what is best becomes the base of another round.  Each must be worth its price beside the others, as in
`decide`.

How channels are read leaves the model as it is, so that one step from its fit tells what a hypothesis
promises; of another arm a few steps do, at fewer lines.  So channels come first, and all else where none of
them explains much of all that is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import CONVINCING
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.setup.constants import Factor, near
from identify.setup.decide import LEFT, left_of, log_odds
from identify.setup.edits import Change
from identify.setup.hypothesis import Hypothesis
from identify.setup.kinds.angles import STEP_DEG
from identify.setup.registry import KINDS
from identify.setup.score import ROUGH, SLIGHT, Score, scored
from identify.setup.search import HELPS, Candidate, finer, glances, of_kinds, without
from identify.setup.soft import LINES, read_otherwise, softened, with_springs
from identify.setup.stated import Stated
from identify.setup.within import times, within

_CHANNELS = ("sensor-turned", "points-exchanged", "links", "sizes")
"""Kinds about how single channels are read, which the soft model itself proposes."""
_PHYSICAL = ("payload",)
"""Kinds that stand for what an arm may have: hoses are bodies, too, and effects that `discover` names."""
_CHANNELS_TRIED, _OTHERS_TRIED, _FURTHER, _SETTLED = 10, 20, 12, 3
"""Hypotheses about channels that are fitted for a step in a round, about the rest that are for a few, of both
those that are for some more, and of these those that are to all lines.
"""
_GLANCED = 6
"""Lines of each measurement at a first look: every spring is free."""
_LEFT = 0.5
"""Share of the squares that may be left: hoses and stated errors leave theirs, which no spring explains.  Of
24 right arms with two dozen effects nothing left less than 0.8, mistakes left 0.01 to 0.28.
"""
_TOLD_APART = 1.02
"""Times the least cost up to which another mistake in place of the last one explains as much."""
_AT_FIRST = 1.25
"""Times the cost that a mistake may leave at a first look, from where few steps have led."""
_LEVEL = (0.0,)
"""Scales of drives are the same for all: what is known of them says how they go along the arm."""
_STEP = GaussNewton(evaluations=2)
_FEW = GaussNewton(evaluations=6, tolerance=1e-2)
_MORE = GaussNewton(evaluations=20, tolerance=5e-3)


@dataclass(frozen=True)
class Found:
    """Mistakes; what else explains as much in place of the last one; common factors that the FRFs may have,
    the likeliest first; the least of their log odds; what puts all right, and the gaps that every spring
    leaves before and after.
    """

    hypotheses: tuple[Hypothesis, ...]
    instead: tuple[Hypothesis, ...]
    factors: tuple[Factor, ...]
    log_odds: float
    edits: tuple[Change, ...]
    gap_before: float
    gap_after: float


def beside_springs(stated: Stated, plain: Score) -> Found | None:
    """What is wrong about a study, whose fit as stated is known; None where nothing is."""
    first, own = Candidate(stated, softened(plain)), plain
    best, rivals = first, list[Candidate]()
    channels = list(of_kinds(first, _CHANNELS))
    asked = len(channels) + len(list(of_kinds(Candidate(stated, plain), _others())))
    while True:
        looked = _looked(best, _by_squares(channels))
        alike = _next(best, looked, asked)
        if not _nearly_right(best) and not (alike and _helps(best, alike[0])):
            looked += _looked(best, _promising(replace(best, score=own)))
            alike = _next(best, looked, asked)
        if not alike:
            break
        found, *rivals = alike
        own = scored(found.stated.problem())
        # What was wrong led into a valley.
        best = min(found, replace(found, score=softened(own)), key=attrgetter("cost"))
        channels = list(of_kinds(best, _CHANNELS))
    last = best.hypotheses[-1:]
    best, odds = _needed(first, best, asked)
    instead = tuple(one.hypotheses[-1] for one in rivals if best.hypotheses[-1:] == last)
    edits = tuple(edit for one in best.hypotheses for edit in one.settled(best.score))
    factors, odds_of_factor = _factors(best, asked)
    if factors:
        factors, best = _of_factors(best, factors)
        edits += times(best.stated, 1 / factors[0].value)
    if not edits:
        return None
    gaps = [within(one.score, None).gap for one in (first, best)]
    if gaps[1] >= gaps[0]:
        return None
    return Found(best.hypotheses, instead, factors, min(odds, odds_of_factor), edits, *gaps)


def _nearly_right(best: Candidate) -> bool:
    """Whether a candidate leaves so little that another mistake would have to leave what a right one may."""
    return best.score.cost**2 * _LEFT <= ROUGH**2 and abs(best.score.level) < SLIGHT


def _factors(best: Candidate, asked: int) -> tuple[tuple[Factor, ...], float]:
    """Known factors near the common factor of the measured FRFs, where that explains most, and its odds.  One
    that no mistake has only stands for what else is wrong.
    """
    if abs(best.score.level) < SLIGHT:
        return (), np.inf
    squares = [best.score.squares(levelled=it) for it in (False, True)]
    count = sum(len(one) for one in squares[0])
    share = sum(map(np.sum, squares[1])) / sum(map(np.sum, squares[0]))
    odds = log_odds(float(share), count, _LEFT) - float(np.log(asked))
    if odds < CONVINCING:
        return (), np.inf
    value = float(np.exp(best.score.level))
    known = [one for one in near(value) if one.known]
    nearest = sorted(known, key=lambda one: abs(np.log(abs(one.value / value))))
    return tuple(nearest), odds if known else np.inf


def _of_factors(best: Candidate, factors: Sequence[Factor]) -> tuple[tuple[Factor, ...], Candidate]:
    """Factors, that which leaves the least gap first, and the candidate with it."""
    tried = []
    for one in factors:
        stated = best.stated.changed(times(best.stated, 1 / one.value))
        score = _fitted(stated, best.score)
        tried.append((within(score, None).gap, one, score))
    tried.sort(key=lambda one: one[0])
    return tuple(one for _, one, _ in tried), replace(best, score=tried[0][2])


def _by_squares(channels: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those about single channels that explain most of what a fit with springs leaves, each once."""
    single = [one for one in channels if one.promise]
    best = {one.sentence: one for one in sorted(single, key=lambda one: one.promise)}
    return list(best.values())[: -_CHANNELS_TRIED - 1 : -1]


def _others() -> list[str]:
    """Kinds about all but single channels."""
    return [name for name in KINDS if name not in (*_CHANNELS, *_PHYSICAL)]


def _promising(own: Candidate) -> list[Hypothesis]:
    """The most promising hypotheses about all else on top of a candidate, by its own fit without springs."""
    rest = [one for one in of_kinds(own, [*_CHANNELS, *_others()]) if not one.promise]
    last = _each_way([one for _, one in glances(own, rest)])
    best_of_kind = {one.code: one for one in reversed(last)}
    powers = [one for one in last if one.code == "quantity"]  # each of which has a common factor
    some = {id(one): one for one in (*best_of_kind.values(), *powers, *last[:_OTHERS_TRIED])}
    return list(some.values())


def _each_way(seen: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses, best first; of those that hold a number, which is made better later, one of each sign."""
    ways = [id(one) if one.numbers is None else (one.about, np.sign(one.numbers).tobytes()) for one in seen]
    return [one for n, one in enumerate(seen) if ways[n] not in ways[:n]]


def _next(base: Candidate, looked: Sequence[Candidate], asked: int) -> list[Candidate]:
    """A candidate with one more mistake: the best that is worth its price, or else the best that helps, which
    may be worth it beside those that are still there; then what is as good.
    """
    kept = _kept(looked, base, _SETTLED)
    tried = [one.score.once("settled", partial(_settled, base, one)) for one in kept]
    settled = sorted([one for one in tried if one is not base], key=attrgetter("cost"))
    needed = [one for one in settled if not any(_simpler(other, one) for other in settled)]
    worth = [one for one in needed if _odds(base, one, asked) >= CONVINCING]
    found = worth or [one for one in needed if _may_hide(base, one)]
    alike = [one for one in found if one.cost <= _TOLD_APART * found[0].cost]
    alike.sort(key=lambda one: one.hypotheses[-1].moved is not None)  # what holds no number first
    return list({one.hypotheses[-1].sentence: one for one in reversed(alike)}.values())[::-1]


def _simpler(other: Candidate, one: Candidate) -> bool:
    """Whether another candidate has fewer mistakes, and what one has more explains too little beside it."""
    return other.mistakes < one.mistakes and log_odds(*left_of(other, one), most=1.0) < CONVINCING


def _may_hide(base: Candidate, one: Candidate) -> bool:
    """Whether a mistake that is not worth its price yet may be so beside another, which it hides.  How single
    channels are read hides little, and is judged by what is left of them alone.
    """
    return _levels(base, one) or (_helps(base, one) and not one.hypotheses[-1].promise)


def _levels(base: Candidate, one: Candidate, most: float = 1.0) -> bool:
    """Whether a mistake takes most of a common factor away at no cost, or at most that many times as much: it
    may stand in the place of one.
    """
    level = base.score.level**2
    less = level >= SLIGHT**2 and one.score.level**2 <= LEFT * level
    return less and one.cost <= most * base.cost


def _looked(base: Candidate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """Candidates with one more mistake, the most promising of a first look at few lines, and what leaves
    least of a common factor, if there is one.
    """
    if not hypotheses:
        return []
    stated = base.stated.glanced()
    small = replace(base, stated=stated, score=_fitted(stated, base.score, _STEP, _GLANCED))
    seen, most = list[Candidate](), _AT_FIRST * small.cost
    for hypothesis in hypotheses:
        one = _with(small, hypothesis, _STEP if hypothesis.promise else _FEW)
        if one is not None and one.cost <= most:
            seen = _kept([*seen, one], base, _FURTHER)  # a model with every spring is large
    again = [replace(one, score=_refitted(one.score, most)) for one in seen]
    return [one for one in again if one.cost <= small.cost or _levels(small, one, _AT_FIRST)]


def _refitted(score: Score, most: float) -> Score:
    return scored(score.problem, score.values, _FEW, slopes=(), most=most)


def _kept(seen: Sequence[Candidate], base: Candidate, count: int) -> list[Candidate]:
    """The best, and where there is a common factor what leaves least of it."""
    best = sorted(seen, key=attrgetter("cost"))
    level = best[count:] if abs(base.score.level) >= SLIGHT else []
    return best[:count] + sorted(level, key=lambda one: abs(one.score.level))[:1]


def _with(base: Candidate, hypothesis: Hypothesis, steps: GaussNewton) -> Candidate | None:
    """A candidate with one more mistake put right, fitted for a few steps from its values on; None where that
    makes no study, or a model that has no solution.
    """
    try:
        stated = base.stated.changed(hypothesis.edits)
        score = _fitted(stated, base.score, steps, _GLANCED, _AT_FIRST * base.score.cost)
        return Candidate(stated, score, (*base.hypotheses, hypothesis))
    except (InputError, InputErrors, np.linalg.LinAlgError):
        return None


def _settled(base: Candidate, seen: Candidate) -> Candidate:
    """A candidate of a first look, fitted for more steps to all lines, with better numbers in its last
    mistake, if that helps.
    """
    stated = base.stated.changed(seen.hypotheses[-1].edits)
    one = replace(seen, stated=stated, score=_fitted(stated, seen.score))
    last, turned = one.hypotheses[-1], _turned(base, one)
    if 0 < turned < STEP_DEG:
        return base  # an error of the posture as it is stated, whatever it is called
    if last.moved is None or not _helps(base, one):
        return one
    best = finer(one, partial(_fitted, steps=_FEW))
    numbers = best.hypotheses[-1].numbers
    # What comes down to nothing is an error of what is stated, such as of the posture, and no mistake.
    return base if numbers is None or np.linalg.norm(numbers) < last.reach else best


def _turned(base: Candidate, one: Candidate) -> float:
    """By how much a candidate turns any joint away from where the base has it, degrees."""
    pairs = zip(base.score.problem.measurements, one.score.problem.measurements, strict=True)
    away = [np.exp(1j * (m.given.posture - other.given.posture)) for m, other in pairs]
    return float(np.degrees(np.max(np.abs(np.angle(away)))))


def _helps(base: Candidate, one: Candidate) -> bool:
    return one.cost <= HELPS * base.cost


def _fitted(
    stated: Stated,
    known: Score,
    steps: GaussNewton = _MORE,
    lines: int = LINES,
    most: float = np.inf,
) -> Score:
    """Of a variant with every spring, from the values of another: on other scales too, where it is more than
    how channels are read; given up above `most`.
    """
    problem = replace(stated, lines=lines).problem()
    reread = read_otherwise(problem, known)
    if reread is not None:
        return scored(reread, known.values, steps, slopes=(), most=most)
    model = with_springs(problem, known.by_name)
    same = problem.robot is known.problem.robot  # whose springs are of about the right size
    soft = scored(model, model.initial, steps, slopes=() if same else _LEVEL, most=most)
    if len(known.problem.file.study.effects) > len(problem.file.study.effects):
        return soft
    # Where no spring gives way, usual ones are far from the best.
    rigid = scored(problem, problem.at(problem.starts | known.by_name), steps, slopes=())
    return min(soft, rigid, key=lambda one: one.cost)


def _odds(before: Candidate, after: Candidate, asked: int) -> float:
    """ln of the odds of what one candidate has otherwise, less its price."""
    share, count = left_of(before, after)
    return log_odds(share, count, _LEFT) - (after.mistakes - before.mistakes) * float(np.log(asked))


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
    """A candidate without one of its mistakes, fitted again from where it led: a fit as stated may have ended
    in a valley that a mistake only leads out of.  None where that makes no study, or a later one holds it
    too.
    """
    try:
        rest = without(first, best, hypothesis)
        if rest is None:
            return None
        again = Candidate(rest[0], _fitted(rest[0], best.score), rest[1])
    except (InputError, InputErrors, np.linalg.LinAlgError):
        return None
    return again if again.hypotheses else min(again, first, key=attrgetter("cost"))
