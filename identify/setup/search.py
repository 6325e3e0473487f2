"""From a study to the mistakes that explain its data: all hypotheses are fitted for a few steps, the most
promising for some more; what is best becomes the base for the next round, because two may be wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.setup.edits import Change, Edit
from identify.setup.hypothesis import Hypothesis
from identify.setup.registry import KINDS
from identify.setup.score import ROUGH, SLIGHT, LogShape, Score, scored
from identify.setup.stated import Stated
from identify.setup.within import levelled, within
from identify.vibration.problem import Problem

_GLANCE = GaussNewton(evaluations=6, tolerance=1e-2)
_PROMISING = 10
"""Hypotheses of a round that are fitted for more than a few steps."""
_ANEW = 3
"""Of these, those that are fitted from all starts: a wrong set-up leads into a valley of its own."""
_ROUNDS = 3
"""Mistakes at once that are looked for."""
_HELPS = 0.85
"""Times the cost that a mistake must come down to, to be looked at further."""
_LATER = ("joint-offset",)
"""Kinds that are asked only where no other helps: they can mimic others."""
_FINEST_DEG = 0.5
_NOTHING = 1e-3
"""Relative change of the cost by which a hypothesis says nothing, as of the sign of a first joint that is
upright."""
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


@dataclass(frozen=True)
class Searched:
    """The study as stated; rounds: after each, the best that was found, and what is about as good as its last
    mistake; asked: how many hypotheses a round had.
    """

    plain: Candidate
    rounds: tuple[tuple[Candidate, ...], ...]
    asked: int


def searched(stated: Stated, score: Score) -> Searched:
    """The mistakes that explain most of what is left of a study as stated, whose score is known."""
    plain = Candidate(stated, score)
    best, rounds, asked = plain, list[tuple[Candidate, ...]](), 0
    while len(rounds) < _ROUNDS and not _explained(best):
        tried, count = _round(best)
        asked = max(asked, count)
        if not tried or _cost(tried[0]) > _HELPS * _cost(best):
            break
        best = tried[0]
        rounds.append(tuple(tried))
    return Searched(plain, tuple(rounds), asked)


def _explained(one: Candidate) -> bool:
    """Whether a candidate leaves nothing to be explained, but a common factor."""
    if one.score.cost <= ROUGH:
        return True
    return within(levelled(one.stated, one.score), one.stated.uncertainty).explained


def _round(base: Candidate) -> tuple[list[Candidate], int]:
    """One more mistake on top of those of a candidate, best first; and how many were asked for."""
    soon = list(_of_kinds(base, [name for name in KINDS if name not in _LATER]))
    tried = _tried(base, soon)
    if not tried or _cost(tried[0]) > _HELPS * _cost(base):
        later = list(_of_kinds(base, _LATER))
        soon += later
        tried = sorted([*tried, *map(_finer, _tried(base, later)[:1])], key=_cost)
    return tried, len(soon)


def _tried(base: Candidate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """Hypotheses on top of a candidate, the most promising, best first."""
    small = base.stated.glanced()
    rough = replace(base, stated=small, score=scored(small.problem(), base.score.values))
    glanced = [one for h in hypotheses if (one := _with(rough, h, _GLANCE)) is not None]
    promising = sorted(glanced, key=_cost)[:_PROMISING]
    settled = sorted([_settled(base, one) for one in promising], key=_cost)
    return sorted([*map(_anew, settled[:_ANEW]), *settled[_ANEW:]], key=_cost)


def _cost(one: Candidate) -> float:
    more = sum(h.count for h in one.hypotheses) - len(one.hypotheses) + (abs(one.score.level) > SLIGHT)
    return float(one.score.cost * _MORE**more)


def _of_kinds(base: Candidate, kinds: Sequence[str]) -> Iterator[Hypothesis]:
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
        if _moving(problem) < _moving(base.score.problem):
            return None  # what is measured to move does not stand on the ground
        shape = LogShape(problem)
        if start is not None and abs(float(shape.costs(start[None])[0]) / base.score.cost - 1) < _NOTHING:
            return None
        score = scored(problem, start, optimizer, shape)
    except (InputError, InputErrors, np.linalg.LinAlgError):
        return None
    return Candidate(stated, score, (*base.hypotheses, hypothesis))


def _moving(problem: Problem) -> int:
    """How many FRFs the model moves."""
    return sum(len(target.observable) for use in ("fit", "validate") for target in problem.targets(use).frf)


def _start(score: Score, problem: Problem) -> np.ndarray | None:
    """Where a fit of another variant begins that has the same parameters."""
    same = [p.name for p in score.problem.parameters] == [p.name for p in problem.parameters]
    return score.values if same else None


def _settled(base: Candidate, one: Candidate) -> Candidate:
    """A candidate that was glanced at, fitted to its end to all lines."""
    stated = base.stated.changed(one.hypotheses[-1].edits)
    return Candidate(stated, scored(stated.problem(), one.score.values), one.hypotheses)


def _anew(one: Candidate) -> Candidate:
    """A candidate, or what it becomes from other starts, if that is better."""
    again = replace(one, score=scored(one.stated.problem()))
    return min(one, again, key=_cost)


def _finer(one: Candidate) -> Candidate:
    """An offset of a joint in ever smaller steps."""
    step, best = 8.0, one
    [edit] = [edit for edit in one.hypotheses[-1].edits if isinstance(edit, Edit)]
    number = int(one.hypotheses[-1].about.removeprefix("zero"))
    while step >= _FINEST_DEG:
        now = _offsets(best)
        tried = [
            _moved(best, edit, [*now[:number], now[number] + sign * step, *now[number + 1 :]])
            for sign in (1, -1)
        ]
        best = min([best, *tried], key=_cost)
        step /= 2
    offset = _offsets(best)[number]
    sentence = f"the zero of joint {number + 1} is off by about {offset:.3g} degrees"
    last = replace(best.hypotheses[-1], sentence=sentence)
    return replace(best, hypotheses=(*best.hypotheses[:-1], last))


def _offsets(one: Candidate) -> list[float]:
    return list(one.stated.study.joint_angles.offset_deg or [])


def _moved(one: Candidate, edit: Edit, offsets: list[float]) -> Candidate:
    edits: tuple[Change, ...] = (replace(edit, value=offsets),)
    stated = one.stated.changed(edits)
    score = scored(stated.problem(), one.score.values, _GLANCE)
    last = replace(one.hypotheses[-1], edits=edits)
    return Candidate(stated, score, (*one.hypotheses[:-1], last))
