"""From a study to the mistakes that explain its data: all hypotheses are fitted for a few steps, the most
promising for some more; what is best becomes the base for the next round, because two may be wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError, InputErrors
from identify.core.thresholds import QUIET
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.measured.quality_robot import possible
from identify.setup.constants import near
from identify.setup.hypothesis import Hypothesis
from identify.setup.registry import KINDS
from identify.setup.score import ROUGH, SLIGHT, Score, scored
from identify.setup.soft import softened
from identify.setup.stated import Stated
from identify.setup.within import Within, levelled, within
from identify.vibration.log_shape import LogShape
from identify.vibration.problem import Problem

_GLANCE = GaussNewton(evaluations=6, tolerance=1e-2)
_PROMISING = 10
"""Hypotheses of a round that are fitted for more than a few steps."""
_ABOUT = 2
"""Of these, those with a number that is only about right."""
_ANEW = 3
"""Of these, those that are fitted from all starts: a wrong set-up leads into a valley of its own."""
_ROUNDS = 3
"""Mistakes at once that are looked for."""
HELPS = 0.85
"""Times the cost that a mistake must come down to, to be looked at further."""
_BODIES = ("robot-units",)
"""Kinds that make bodies possible which cannot be."""
_LIKELY = 5
"""Hypotheses of a round of which the likelihood is asked where no logarithm helps."""
_SLIGHT = ("window",)
"""Kinds that may leave less in logarithms than a right set-up does."""
_LATER = ("joint-offset",)
"""Kinds that are asked only where no other helps: they can mimic others."""
_STEPS, _CLOSER, _FARTHER = 4, 0.5, 3.0
"""Steps of numbers that are only about right, how much smaller the differences between which slopes are taken
become with each, and how many times as long as these a step may be."""
_NOTHING = 1e-3
"""Relative change of the cost by which a hypothesis says nothing, as of the sign of a first joint that is
upright."""
_HALF = 0.5
"""Times the likelihood's gap that a mistake must come down to where no logarithm helps."""
_AS_GOOD = 1.1
"""Times the cost up to which the likelihood may tell what logarithms do not."""
_MORE = 1.03
"""Times the cost that one mistake more, such as a common factor, has to be worth."""


@dataclass(frozen=True)
class Candidate:
    """A study with some mistakes put right: the hypotheses in their order, and how well that fits."""

    stated: Stated
    score: Score
    hypotheses: tuple[Hypothesis, ...] = ()

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of its hypotheses."""
        return tuple(one.code for one in self.hypotheses)

    @property
    def within(self) -> Within:
        """What is left within what was stated to be uncertain, beside the common factor."""
        return self.within_of(np.inf)

    def within_of(self, most: float) -> Within:
        """The same, given up where it would stay above `most`."""
        return within(levelled(self.stated, self.score), self.stated.uncertainty, most)

    @property
    def explained(self) -> bool:
        """Whether nothing is left beside the common factor."""
        return self.within_of(QUIET).explained

    @property
    def mistakes(self) -> int:
        """How many its hypotheses are."""
        return sum(one.count for one in self.hypotheses)

    @property
    def cost(self) -> float:
        """RMS of logarithms, in tenths, by which it is judged: the second of two mistakes in one has to be
        worth its price.
        """
        return float(self.score.cost * _MORE ** (self.mistakes - len(self.hypotheses)))

    @cached_property
    def moving(self) -> int:
        """How many FRFs the model moves."""
        return LogShape(self.score.problem).moving


@dataclass(frozen=True)
class Searched:
    """The study as stated; rounds: after each, the best that was found, and what is about as good as its last
    mistake; rivals: the best with one mistake more that makes its common factor needless; asked: how many
    hypotheses a round had.
    """

    plain: Candidate
    rounds: tuple[tuple[Candidate, ...], ...]
    rivals: tuple[Candidate, ...]
    asked: int


def searched(stated: Stated, score: Score) -> Searched:
    """The mistakes that explain most of what is left of a study as stated, whose score is known."""
    plain = Candidate(stated, score)
    best, rounds, rivals, asked = plain, list[tuple[Candidate, ...]](), list[Candidate](), 0
    while len(rounds) < _ROUNDS:
        explained = _explained(best)
        if explained and abs(best.score.level) < SLIGHT:
            break
        tried, count = _round(best)
        asked = max(asked, count)
        better = [] if explained else _better(best, tried)
        if not better:
            level = [one for one in tried if abs(one.score.level) < SLIGHT]
            rivals = [one for one in level if one.score.cost <= _AS_GOOD * best.score.cost]
            break
        best = better[0]
        rounds.append(tuple(better))
    if len(rounds) > 1 and (again := _again(plain, best)) is not best:
        best, rounds[-1] = again, (again,)
    if 0 < len(rounds) < _ROUNDS:
        rounds += filter(None, [_slight(best)])
    return Searched(plain, tuple(rounds), tuple(rivals), asked)


def searched_where_slight(stated: Stated, score: Score) -> Searched:
    """A single mistake that explains all of the little that is left: a missing effect explains as little."""
    plain = Candidate(stated, score)
    explained = _slight(plain)
    return Searched(plain, (explained,) if explained else (), (), len(_SLIGHT))


def _slight(base: Candidate) -> tuple[Candidate, ...]:
    """What explains all of the little that a candidate leaves; nothing where it leaves much, or nothing."""
    if base.score.cost > ROUGH or base.explained:
        return ()
    tried = refined(base, list(of_kinds(base, _SLIGHT)))
    return tuple(one for one in tried if one.explained)


def without(
    plain: Candidate, best: Candidate, hypothesis: Hypothesis
) -> tuple[Stated, tuple[Hypothesis, ...]] | None:
    """The study with all mistakes of a candidate put right but one, and these; None where a later one holds
    it too.
    """
    others = tuple(one for one in best.hypotheses if one is not hypothesis)
    stated = plain.stated.changed([edit for one in others for edit in one.edits])
    same = (stated.study, stated.points) == (best.stated.study, best.stated.points)
    return None if same else (stated, others)


def _again(plain: Candidate, best: Candidate) -> Candidate:
    """A candidate with each mistake but the last chosen again beside the others: when it was found, they were
    still there.
    """
    for one in best.hypotheses[:-1]:
        rest = without(plain, best, one)
        if rest is None:
            continue
        stated, others = rest
        base = Candidate(stated, scored(stated.problem()), others)
        alike = [h for h in of_kinds(base, list(KINDS)) if h.code == one.code]
        tried = [best, *refined(base, alike)]
        best = _bodies(tried)[0] if one.code in _BODIES else min(tried, key=_cost)
    return best


def _better(base: Candidate, tried: list[Candidate]) -> list[Candidate]:
    """What was tried, best first, if that helps: by logarithms, or, because nuisance parameters leave
    these apart too, by the likelihood with these fitted along, where that explains one of the best or
    halves what is left.  Bodies that can be help in any case.
    """
    helps = bool(tried) and (_cost(tried[0]) <= HELPS * _cost(base) or not possible(base.stated.robot))
    if base.stated.uncertainty is None:
        return tried if helps else []
    most = QUIET if helps else max(QUIET, _HALF * base.within.worst)
    known = [(one.within_of(most), one) for one in tried[:_LIKELY]]
    known.sort(key=lambda pair: (not pair[0].explained, pair[0].worst))
    likely, rest = [one for _, one in known], tried[_LIKELY:]
    if known and known[0][0].explained:
        return likely + rest
    if helps:
        return tried
    return likely + rest if known and known[0][0].worst <= _HALF * base.within.worst else []


def _explained(one: Candidate) -> bool:
    """Whether a candidate leaves nothing to be explained, but a common factor."""
    return one.score.cost <= ROUGH or one.explained


def _round(base: Candidate) -> tuple[list[Candidate], int]:
    """One more mistake on top of those of a candidate, best first; and how many were asked for.  Of a robot
    whose bodies cannot be, only what makes them possible.
    """
    if not possible(base.stated.robot):
        some = [h for h in of_kinds(base, _BODIES) if possible(base.stated.changed(h.edits).robot)]
        if some:
            return _bodies(refined(base, some)), len(some)
    soon = list(of_kinds(base, [name for name in KINDS if name not in _LATER]))
    tried = refined(base, soon)
    if not tried or _cost(tried[0]) > HELPS * _cost(base):
        later = list(of_kinds(base, _LATER))
        soon += later
        tried = sorted([*tried, *refined(base, later)[:1]], key=_cost)
    return tried, len(soon)


def _bodies(tried: Sequence[Candidate]) -> list[Candidate]:
    """Of bodies that can be those that leave least with every spring, because a study's own model may leave
    more than a wrong unit does; of what is the same up to a common factor, first what needs none, and then
    what needs one that a mistake has.
    """
    least = min((softened(one.score).cost for one in tried), default=0.0)
    alike = [one for one in tried if softened(one.score).cost <= _MORE * least]
    return sorted(alike, key=lambda one: _of_factor(softened(one.score).level))


def _of_factor(level: float) -> tuple[bool, float]:
    """Whether a mistake has no common factor that is one, by its logarithm, and how large that is."""
    return abs(level) >= SLIGHT and not near(float(np.exp(level)))[0].known, abs(level)


def refined(base: Candidate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """Hypotheses on top of a candidate, the most promising, best first."""
    settled = sorted([_settled(base, one) for one in _promising(glanced(base, hypotheses))], key=_cost)
    for n in [n for n, one in enumerate(settled) if one.hypotheses[-1].moved][:1]:
        settled[n] = finer(settled[n], _refitted)
    settled.sort(key=_cost)
    return sorted([*map(_anew, settled[:_ANEW]), *settled[_ANEW:]], key=_cost)


def glanced(base: Candidate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """Hypotheses on top of a candidate, fitted for a few steps to fewer lines of fewer measurements."""
    small, costs = base.stated.glanced(), _glance_costs(base)
    rough = replace(base, stated=small, score=scored(small.problem(), base.score.values))
    found = []
    for hypothesis in hypotheses:
        one = _with(rough, hypothesis, _GLANCE)
        costs[hypothesis.key] = np.inf if one is None else _cost(one)
        found += [] if one is None else [one]
    return found


def glances(base: Candidate, hypotheses: Sequence[Hypothesis]) -> list[tuple[float, Hypothesis]]:
    """The same with the costs alone, best first: each is looked at once on top of a fit."""
    costs = _glance_costs(base)
    glanced(base, [one for one in hypotheses if one.key not in costs])
    seen = [(costs[one.key], one) for one in hypotheses if np.isfinite(costs[one.key])]
    return sorted(seen, key=lambda one: one[0])


def _glance_costs(base: Candidate) -> dict[str, float]:
    return base.score.once("glances", dict[str, float])


def _promising(tried: Sequence[Candidate]) -> list[Candidate]:
    """The best; of those that hold a number which is only about right few, which are then made better."""
    best = sorted(tried, key=_cost)
    about = [one for one in best if one.hypotheses[-1].moved][_ABOUT:]
    return [one for one in best if not any(one is other for other in about)][:_PROMISING]


def _cost(one: Candidate) -> float:
    return one.cost * (_MORE if abs(one.score.level) > SLIGHT else 1.0)


def of_kinds(base: Candidate, kinds: Sequence[str]) -> Iterator[Hypothesis]:
    """All hypotheses of these kinds about what no mistake was found of yet."""
    known = {one.about for one in base.hypotheses}
    for name in kinds:
        for hypothesis in KINDS[name](base.stated, base.score):
            if hypothesis.about not in known:
                yield hypothesis


def _with(base: Candidate, hypothesis: Hypothesis, optimizer: GaussNewton) -> Candidate | None:
    """A candidate with one more mistake put right; None where the study is then none, or nothing changes."""
    try:
        stated = base.stated.changed(hypothesis.edits)
        problem = stated.problem()
        start = _start(base.score, problem)
        shape = LogShape(problem)
        if shape.moving < base.moving:
            return None  # what is measured to move does not stand on the ground
        if start is not None and abs(float(shape.costs(start[None])[0]) / base.score.cost - 1) < _NOTHING:
            return None
        score = scored(problem, start, optimizer, shape)
    except (InputError, InputErrors, np.linalg.LinAlgError):
        return None
    return Candidate(stated, score, (*base.hypotheses, hypothesis))


def _start(score: Score, problem: Problem) -> np.ndarray | None:
    """Where a fit of another variant begins that has the same parameters."""
    same = [p.name for p in score.problem.parameters] == [p.name for p in problem.parameters]
    return score.values if same else None


def _settled(base: Candidate, one: Candidate) -> Candidate:
    """A candidate that was glanced at, fitted to its end to all lines."""
    stated = base.stated.changed(one.hypotheses[-1].edits)
    return Candidate(stated, scored(stated.problem(), one.score.values), one.hypotheses)


def _refitted(stated: Stated, known: Score) -> Score:
    return scored(stated.problem(), known.values)


def _anew(one: Candidate) -> Candidate:
    """A candidate, or what it becomes from other starts, if that is better."""
    again = replace(one, score=scored(one.stated.problem()))
    return min(one, again, key=_cost)


def finer(one: Candidate, fitted: Callable[[Stated, Score], Score]) -> Candidate:
    """A candidate whose last mistake holds numbers that are only about right, with better ones: Gauss-Newton
    on what a fit of all else leaves, with slopes from differences; fitted: a variant, from a score on.
    """
    best, reach = one, one.hypotheses[-1].reach
    for _ in range(_STEPS):
        numbers = best.hypotheses[-1].numbers
        assert numbers is not None
        sides = [_moved(best, numbers + reach * axis, fitted) for axis in np.eye(len(numbers))]
        left, *others = (_residuals(found) for found in (best, *sides))
        if any(len(other) != len(left) for other in others):
            break  # other channels are moved there
        slopes = np.array([other - left for other in others]).T
        step = -np.linalg.lstsq(slopes, left, rcond=None)[0]
        step *= min(1.0, _FARTHER / max(float(np.linalg.norm(step)), 1e-9))
        best = min([best, *sides, _moved(best, numbers + reach * step, fitted)], key=_cost)
        reach *= _CLOSER
    return best


def _residuals(one: Candidate) -> Array:
    """All of them, real (n,)."""
    found = np.concatenate([some.ravel() for some in one.score.residuals(levelled=True)])
    return np.concatenate([found.real, found.imag])


def _moved(one: Candidate, numbers: Array, fitted: Callable[[Stated, Score], Score]) -> Candidate:
    """A candidate with other numbers in its last mistake."""
    before = one.hypotheses[-1]
    assert before.moved is not None
    last = before.moved(numbers)
    stated = one.stated.changed(last.edits)
    return Candidate(stated, fitted(stated, one.score), (*one.hypotheses[:-1], last))
