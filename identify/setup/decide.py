"""What is named: mistakes beside which next to nothing is left of what no physics explains either.

Study and correction are compared with every bearing, the base and the links free (`soft`), so that a mistake
competes with all physics at once, and in the study's own model.  Of what a mistake touches it must leave at
most a quarter of the squares in both, and what it explains must be worth more than its price:

    ln odds = n ln(S_0 / S) - ln(hypotheses of a round) for each mistake

with the RMS S of logarithms and the number n of FRFs that are touched: the lines of one FRF are not counted
one by one, because a model that is wrong is wrong along all of them.  S may be the gap instead, with the
errors fitted along that the study states: both noise and they leave logarithms apart.  Of several mistakes
each must leave as little beside the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.thresholds import CONVINCING, MISSING
from identify.measured.quality_robot import possible
from identify.setup.constants import Factor, nearest
from identify.setup.edits import Change, Edit
from identify.setup.hypothesis import Hypothesis
from identify.setup.score import SLIGHT, Score, scored
from identify.setup.search import Candidate, Searched, without
from identify.setup.soft import softened
from identify.setup.within import levelled, within
from identify.vibration.costs.target import FrfTarget

LEFT = 0.25
"""Share of the squares, on what a mistake touches, that may be left beside it."""


@dataclass(frozen=True)
class Decision:
    """The mistakes that are named, those that are as likely in place of the last one, and the common factor,
    if it is one; log_odds: that the study is as corrected, against as stated with any spring free; rivals:
    those with a mistake in place of the factor.
    """

    candidate: Candidate
    alike: tuple[Candidate, ...]
    factor: Factor | None
    log_odds: float
    rivals: tuple[Candidate, ...] = ()

    def others(self, most: int, gap: float) -> list[Decision]:
        """The same decision for the first of those that are as likely, where they leave at most a gap."""
        every = (self.candidate, *self.alike)
        return [
            replace(
                self,
                candidate=one,
                alike=tuple(other for other in every if other is not one),
                factor=_factor(one) or _factor_within(one),
            )
            for one in self.alike[:most]
            if one.within_of(gap).gap <= gap
        ]

    @property
    def level(self) -> list[Decision]:
        """The same without a factor, for each of the mistakes in its place."""
        return [Decision(one, (), None, self.log_odds) for one in self.rivals]

    @property
    def fitted(self) -> Score | None:
        """The fit that the search ended with, where that is of what puts it right and not of numbers near."""
        settled = any(one.settle for one in self.candidate.hypotheses)
        return None if settled or self.factor is not None else self.candidate.score

    def start(self, edits: Sequence[Change]) -> Array | None:
        """Where a fit with these edits begins: none where they have other effects than were fitted."""
        effects = any(isinstance(one, Edit) and one.key[0] == "effects" for one in edits)
        settled = any(one.settle for one in self.candidate.hypotheses)
        return None if settled and not effects else self.candidate.score.values


def decided(found: Searched) -> Decision | None:
    """What is named of a search; None where nothing is."""
    best, others = needed(found)
    factor = _factor(best) or _factor_within(best)
    mistakes = best.mistakes + (factor is not None)
    if not mistakes:
        return None
    touched = _touched(found.plain, best, factor)
    share = _left(found.plain.score, best.score, touched, levelled=factor is not None)
    price = mistakes * np.log(max(found.asked, 1))
    count = sum(int(one.sum()) for one in touched)
    odds = log_odds(share, count) - price
    if odds < CONVINCING:
        share = _left_within(found.plain, best, levelled_too=factor is not None)
        odds = log_odds(share, sum(len(one) for one in touched)) - price
    if odds < CONVINCING:
        return None
    last = best.hypotheses[-1].count if best.hypotheses else 0
    alike = tuple(
        one
        for one in others
        if one.hypotheses[-1].count <= last and count * np.log(one.score.cost / best.score.cost) < CONVINCING
    )
    same = found.rounds[-1][0] if found.rounds else found.plain
    rivals = found.rivals if factor is not None and best is same else ()
    return Decision(best, alike, factor, odds, rivals)


def log_odds(share: float, count: int, most: float = LEFT) -> float:
    """Of what leaves a share of squares of as many FRFs; none where it leaves more than the most it may, or
    nothing at all, as where the model does not move.
    """
    return -0.5 * count * float(np.log(share)) if 0 < share <= most else -np.inf


def _left(plain: Score, best: Score, touched: Sequence[Mask], *, levelled: bool) -> float:
    """The share of squares that a correction leaves of what it touches, with every spring, or infinity where
    it leaves too much in the study's own model.
    """

    def share(before: Score, after: Score) -> float:
        return _sum(after, touched, levelled=levelled) / _sum(before, touched, levelled=False)

    return share(softened(plain), softened(best)) if share(plain, best) <= LEFT else np.inf


def _left_within(plain: Candidate, best: Candidate, *, levelled_too: bool) -> float:
    """The share of squared residuals over noise that a correction leaves, where what was stated to be
    uncertain may be so, of those of the study's own model and with every spring; infinity where something is
    missing all the same.
    """
    uncertain = plain.stated.uncertainty
    corrected = levelled(best.stated, best.score) if levelled_too else best.score
    after = within(corrected, uncertain, MISSING).worst
    if after > MISSING:
        return np.inf
    before = within(plain.score, uncertain).worst
    if after**2 > LEFT * before**2:
        return np.inf
    return float((after / min(before, within(softened(plain.score), uncertain).worst)) ** 2)


def needed(found: Searched) -> tuple[Candidate, tuple[Candidate, ...]]:
    """The best of a search, without mistakes that it does not need beside the others, and what is as good as
    its last one.
    """
    rounds = [(found.plain,), *found.rounds]
    while len(rounds) > 2 and not _worth(rounds[-2][0], rounds[-1][0]):
        rounds.pop()
    best, *others = rounds[-1]
    for hypothesis in best.hypotheses[:-1]:
        rest = _without(found.plain, best, hypothesis)
        if rest is not None and possible(rest.stated.robot) and not _worth(rest, best):
            best, others = rest, []
    return best, tuple(others)


def _worth(before: Candidate, after: Candidate) -> bool:
    """Whether one mistake more leaves little of what it touches, up to common factors."""
    if abs(after.score.level) < SLIGHT <= abs(before.score.level):
        return after.score.cost <= before.score.cost  # it stands in the place of a factor
    if left_of(before, after)[0] <= LEFT:
        return True
    if after.stated.uncertainty is None and not after.explained:
        return False
    most = float(np.sqrt(LEFT)) * before.within.worst
    return after.within_of(most).worst <= most


def left_of(before: Candidate, after: Candidate) -> tuple[float, int]:
    """The share of squares that one candidate leaves another of what tells them apart, up to common factors,
    and of how many FRFs.
    """
    touched = _touched(before, after, None)
    sums = [_sum(one.score, touched, levelled=True) for one in (before, after)]
    return sums[1] / sums[0] if sums[0] else np.inf, sum(int(one.sum()) for one in touched)


def _without(plain: Candidate, best: Candidate, hypothesis: Hypothesis) -> Candidate | None:
    """A candidate without one of its mistakes; None where a later one holds it too."""
    rest = without(plain, best, hypothesis)
    if rest is None:
        return None
    stated, others = rest
    problem = stated.problem()
    same = [p.name for p in problem.parameters] == [p.name for p in best.score.problem.parameters]
    starts = (None, best.score.values) if same else (None,)
    return Candidate(stated, min((scored(problem, x) for x in starts), key=lambda one: one.cost), others)


def _factor(best: Candidate) -> Factor | None:
    """The common factor of the measured FRFs, where it is a mistake: of what is left with it and with every
    spring, without it there would be four times as much.
    """
    if abs(best.score.level) < SLIGHT or abs((soft := softened(best.score)).level) < SLIGHT:
        return None
    without, with_it = (sum(float(one.sum()) for one in soft.squares(levelled=it)) for it in (False, True))
    return nearest(np.exp(soft.level)) if with_it <= LEFT * without else None


def _factor_within(best: Candidate) -> Factor | None:
    """The same where what was stated to be uncertain may be so."""
    uncertain = best.stated.uncertainty
    if uncertain is None or abs(best.score.level) < SLIGHT:
        return None
    most = float(np.sqrt(LEFT)) * within(best.score, uncertain).worst
    return nearest(np.exp(best.score.level)) if best.within_of(most).worst <= most else None


def _touched(plain: Candidate, best: Candidate, factor: Factor | None) -> list[Mask]:
    """Which FRFs (pairs,) of each set a correction touches: all, where it changes more than how single
    channels are read.
    """
    same = _model(plain) == _model(best) and factor is None
    pairs = zip(plain.score.problem.measurements, best.score.problem.measurements, strict=True)
    found = []
    for one, other in pairs:
        before, after = one.target, other.target
        assert isinstance(before, FrfTarget) and isinstance(after, FrfTarget)
        if same and one.given.posture.tobytes() == other.given.posture.tobytes():
            found.append(_reread(plain, best, before, after))
        else:
            found.append(np.ones(len(before.pairs[0]), dtype=bool))
    return found if any(one.any() for one in found) else [np.ones_like(one) for one in found]


def _reread(plain: Candidate, best: Candidate, before: FrfTarget, after: FrfTarget) -> Mask:
    """Which FRFs (pairs,) of a set are those of another channel, of another size, or on another link."""
    outputs, inputs = before.pairs
    one, other = before.data, after.data
    if one.frf.shape != other.frf.shape or one.quantity != other.quantity:
        return np.ones(len(outputs), dtype=bool)
    names = list(zip(one.outputs, other.outputs, strict=True))
    moved = np.any(one.frf != other.frf, axis=0)[outputs, inputs]
    links = [_link(plain, a.node) != _link(best, b.node) for a, b in names]
    renamed = [a != b for a, b in names]
    forced = [a != b for a, b in zip(one.inputs, other.inputs, strict=True)]
    return np.asarray(
        moved | np.array(renamed)[outputs] | np.array(links)[outputs] | np.array(forced)[inputs]
    )


def _link(one: Candidate, node: int) -> str | None:
    """Of a point; none of a motor."""
    return one.stated.points[node].link if node in one.stated.points else None


def _model(one: Candidate) -> str:
    study = one.stated.study
    return study.robot.model_dump_json() + repr(study.effects)


def _sum(score: Score, touched: Sequence[Mask], *, levelled: bool) -> float:
    """Squares of the FRFs that are touched."""
    squares = score.squares(levelled=levelled)
    return sum(float(one[which].sum()) for one, which in zip(squares, touched, strict=False))
