"""Mistakes of a set-up that are named, with what they explain and what puts them right."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.threads import one_thread
from identify.setup.bounds import sag, too_stiff
from identify.setup.constants import Factor, near
from identify.setup.decide import Decision, decided
from identify.setup.edits import Change
from identify.setup.kinds.readout import radians_per_second
from identify.setup.score import ROUGH, SLIGHT, Score, scored
from identify.setup.search import searched
from identify.setup.stated import Stated, stated
from identify.setup.within import times, within
from identify.vibration.problem import Problem

LARGE = 20.0
"""Gap above which the set-up is looked at: far more than a small effect leaves."""
_BY_SIZE = 0.99
"""Probability of a mistake that only the size of a number tells: one drive in a hundred may be as stiff."""
_OTHERS = 3
"""Mistakes that are about as likely by logarithms, which the likelihood may tell apart."""


@dataclass(frozen=True)
class Mistake:
    """One that is named: its code, what was done, and what else would explain the same."""

    code: str
    sentence: str
    otherwise: tuple[str, ...] = ()


@dataclass(frozen=True)
class Diagnosis:
    """Mistakes that explain the data together; probability: that they were made, rather than that some spring
    is missing; gap before and after, of a few lines; edits: what puts them right.
    """

    mistakes: tuple[Mistake, ...]
    probability: float
    gap_before: float
    gap_after: float
    edits: tuple[Change, ...]

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the mistakes."""
        return tuple(one.code for one in self.mistakes)


@dataclass(frozen=True)
class Looked:
    """What a look at a set-up found: the gap as stated, of a few lines, and the diagnosis, if any."""

    gap: float
    diagnosis: Diagnosis | None = None


def look(problem: Problem, gap: float | None = None) -> Looked:
    """The diagnosis of a study that was loaded; none where its gap, which is found quickly where it is not
    given, is not large, or where it is no study of FRFs with known noise.
    """
    try:
        with one_thread():
            return _look(stated(problem), gap)
    except (InputError, InputErrors):
        return Looked(np.nan)


def _look(as_stated: Stated, gap: float | None) -> Looked:
    first = scored(as_stated.problem())
    now = within(first, as_stated.uncertainty)
    quick = now.gap
    if too_stiff(first) and (found := _in_rad_per_s(as_stated, first, quick)) is not None:
        return found
    if now.explained:
        return Looked(quick)
    if (quick if gap is None else gap) <= LARGE and first.cost <= ROUGH and abs(first.level) < SLIGHT:
        return Looked(quick)
    decision = decided(searched(as_stated, first))
    if decision is None:
        return Looked(quick)
    factor, edits, after = _best_factor(as_stated, decision)
    for other in decision.others[:_OTHERS]:
        tried = _best_factor(as_stated, other)
        if tried[2] < after:
            decision, (factor, edits, after) = other, tried
    if after >= quick:
        return Looked(quick)
    mistakes = _mistakes(replace(decision, factor=factor))
    return Looked(quick, Diagnosis(mistakes, _probability(decision), quick, after, edits))


def _in_rad_per_s(as_stated: Stated, first: Score, quick: float) -> Looked | None:
    """Frequencies in rad/s, where the fitted drives are stiffer than any: accelerances are the same functions
    of frequencies that are all scaled, with stiffnesses scaled by the square, so that a fit does not see it.
    None where they would be as stiff in rad/s.
    """
    for hypothesis in radians_per_second(as_stated, first):
        there = as_stated.changed(hypothesis.edits)
        score = scored(there.problem())
        if too_stiff(score):
            continue
        degrees, right = np.degrees(sag(first)), np.degrees(sag(score))
        sentence = (
            f"{hypothesis.sentence}: as stated, the arm would sag under its own weight by {degrees:.1g}"
            f" degrees, which no drive is stiff enough for; in rad/s by {right:.1g}"
        )
        inner = _look(there, None)
        mistake = Mistake(hypothesis.code, sentence)
        if inner.diagnosis is None:
            return Looked(quick, Diagnosis((mistake,), _BY_SIZE, quick, inner.gap, hypothesis.edits))
        more = inner.diagnosis
        edits, mistakes = (*hypothesis.edits, *more.edits), (mistake, *more.mistakes)
        return Looked(quick, replace(more, mistakes=mistakes, edits=edits, gap_before=quick))
    return None


def _best_factor(as_stated: Stated, decision: Decision) -> tuple[Factor | None, tuple[Change, ...], float]:
    """The known factor near that which was found that leaves the least gap, all edits with it, and that
    gap.
    """
    found = []
    for factor in (None,) if decision.factor is None else near(decision.factor.value):
        edits = (*_edits(decision), *_of_factor(replace(decision, factor=factor)))
        score = scored(as_stated.changed(edits).problem(), decision.start(edits))
        found.append((factor, edits, within(score, as_stated.uncertainty).gap))
    return min(found, key=lambda one: one[2])


def _edits(decision: Decision) -> tuple[Change, ...]:
    """What puts all right but the common factor, with numbers that were fitted along."""
    found: list[Change] = []
    for hypothesis in decision.candidate.hypotheses:
        found += hypothesis.settled(decision.candidate.score)
    return tuple(found)


def _of_factor(decision: Decision) -> tuple[Change, ...]:
    if decision.factor is None:
        return ()
    return times(decision.candidate.stated, 1 / decision.factor.value)


def _mistakes(decision: Decision) -> tuple[Mistake, ...]:
    named = [Mistake(one.code, one.sentence) for one in decision.candidate.hypotheses]
    if named and decision.alike:
        others = dict.fromkeys(one.hypotheses[-1].sentence for one in decision.alike)
        others.pop(named[-1].sentence, None)
        named[-1] = replace(named[-1], otherwise=tuple(others))
    if decision.factor is not None:
        named.append(_factor_mistake(decision.factor))
    return tuple(named)


def _factor_mistake(factor: Factor) -> Mistake:
    first, *others = factor.reasons or ("a sensitivity is wrong",)
    return Mistake("factor", f"all FRFs are {factor.words} what they should be: {first}", tuple(others))


def _probability(decision: Decision) -> float:
    """Of the mistakes, with those as likely in place of the last one: neither is told from the other here."""
    return float(1 / (1 + np.exp(-decision.log_odds)))
