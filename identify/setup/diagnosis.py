"""Mistakes of a set-up that are named, with what they explain and what puts them right."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.threads import one_thread
from identify.core.thresholds import CONVINCING, QUIET
from identify.setup.beside_springs import beside_springs
from identify.setup.bounds import sag, too_stiff
from identify.setup.brakes import brake
from identify.setup.constants import NEAR, Factor, near
from identify.setup.decide import Decision, decided
from identify.setup.edits import Change
from identify.setup.kinds.readout import radians_per_second
from identify.setup.score import ROUGH, SLIGHT, Score, scored
from identify.setup.search import Searched, searched, searched_where_slight
from identify.setup.soft import softened, springs_explain
from identify.setup.stated import Stated, stated
from identify.setup.within import times, within, within_as_stated
from identify.vibration.problem import Problem

LARGE = 20.0
"""Gap above which the set-up is looked at: far more than a small effect leaves."""
_BY_SIZE = 0.99
"""Probability of a mistake that only the size of a number tells: one drive in a hundred may be as stiff."""
_TOLD_APART = 1.02
"""Times the least gap up to which another explanation is as good."""
_NEARLY = 2.0
"""Times the least gap up to which another explanation may be as good with a factor that is exact."""
_POOR = 0.2
"""Share of logarithms that is left with every spring where a study's own model is too poor to judge by."""
_SIGMAS = 3.0
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
    """Mistakes that explain the data together; probability: that they, or those instead, were made, rather
    than that some spring is missing; gap before and after, of a few lines; edits: what puts them right;
    instead: other mistakes that explain the data as well; softened: whether the gaps are those of a model
    with every bearing, the base and the links free.
    """

    mistakes: tuple[Mistake, ...]
    probability: float
    gap_before: float
    gap_after: float
    edits: tuple[Change, ...]
    instead: tuple[tuple[Mistake, ...], ...] = ()
    softened: bool = False

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
    now = within_as_stated(first, as_stated.uncertainty)
    if too_stiff(first) and (fast := _in_rad_per_s(as_stated, first, now.gap, alone=True)) is not None:
        return fast
    small = (gap or now.gap) <= LARGE and first.cost <= ROUGH
    if now.explained:  # whatever logarithms say, which noise and bands without a resonance leave open
        found = Found(Looked(now.gap), first)
    elif abs(first.level) < SLIGHT and small:
        found = _found(as_stated, searched_where_slight(as_stated, first), now.gap)
    elif springs_explain(first, as_stated.uncertainty):
        found = Found(Looked(now.gap), first)
    else:
        found = _wrong(as_stated, first, now.gap)
    if too_stiff(found.corrected):
        return _in_rad_per_s(as_stated, found.corrected, now.gap) or found.looked
    return found.looked


def _wrong(as_stated: Stated, first: Score, gap: float) -> Found:
    """The mistakes that explain the data alone, and beside every spring those that explain what is left."""
    if softened(first).cost <= _POOR * first.cost:
        found = Found(Looked(gap), first)
    else:
        found = _and_braked(as_stated, _found(as_stated, searched(as_stated, first), gap))
    named, known, plain = found.looked.diagnosis, as_stated, found.corrected
    if named is not None:
        if named.gap_after <= QUIET or springs_explain(plain, as_stated.uncertainty):
            return found
        if found.put is not None:
            found = _without_factor(as_stated, found.put, Found(Looked(gap), first))
            plain, named = found.corrected, found.looked.diagnosis
        known = as_stated if named is None else as_stated.changed(named.edits)
    rough = plain.cost <= ROUGH and abs(plain.level) < SLIGHT  # then the set-up is right
    more = None if rough else _beside_springs(known, plain)
    if more is None:
        return found
    told = more if named is None else _joined(named, more)
    return Found(Looked(gap, told), scored(known.changed(more.edits).problem()))


@dataclass(frozen=True)
class _Put:
    """What puts a decision right, with the factor that was chosen, and the gap it leaves."""

    decision: Decision
    edits: tuple[Change, ...]
    score: Score
    gap: float


@dataclass(frozen=True)
class Found:
    """What a search found, and the study as corrected, or as it is; put: how, if with a common factor."""

    looked: Looked
    corrected: Score
    put: _Put | None = None


def _without_factor(as_stated: Stated, with_it: _Put, nothing: Found) -> Found:
    """The same but its common factor, which may stand for what else is wrong, such as a power of j omega."""
    decision = replace(with_it.decision, factor=None)
    gap, mistakes = nothing.looked.gap, _mistakes(decision)
    for put in _put_right(as_stated, [decision]) if mistakes else ():
        if put.gap >= gap:
            return nothing
        told = Diagnosis(mistakes, _sure(decision.log_odds), gap, put.gap, put.edits)
        return Found(Looked(gap, told), put.score)
    return nothing


def _found(as_stated: Stated, search: Searched, gap: float) -> Found:
    first, decision = search.plain.score, decided(search)
    if decision is None:
        return Found(Looked(gap), first)
    every = _put_right(as_stated, [decision])
    most = _NEARLY * min(map(_gap, every), default=np.inf)
    every += _put_right(as_stated, decision.others(_OTHERS, most))
    if every and min(every, key=_gap).decision.factor is not None:
        every += _put_right(as_stated, decision.level[:_OTHERS])
    least = min(map(_gap, every), default=gap)
    if least >= gap:
        return Found(Looked(gap), first)
    alike = [one for one in every if one.gap <= _TOLD_APART * least]
    best = min(alike, key=_likelier)
    mistakes = _mistakes(best.decision)
    instead = dict.fromkeys(_mistakes(one.decision) for one in sorted(alike, key=_gap))
    del instead[mistakes]
    told = Diagnosis(mistakes, _sure(decision.log_odds), gap, best.gap, best.edits, tuple(instead))
    return Found(Looked(gap, told), best.score, None if best.decision.factor is None else best)


def _and_braked(as_stated: Stated, found: Found) -> Found:
    """Where files disagree beside what was found, with a drive that is another in one of them; and with what
    explains the others beside that.
    """
    gap, named = found.looked.gap, found.looked.diagnosis
    if named is not None and named.gap_after <= QUIET:
        return found
    known = as_stated if named is None else as_stated.changed(named.edits)
    braked = _braked(known, found.corrected, gap if named is None else named.gap_after)
    if braked is None:
        return found
    more, number = braked
    if named is not None:
        return Found(Looked(gap, _joined(named, more)), found.corrected)
    beside = _look(as_stated.without(number), None).diagnosis if more.gap_after > QUIET else None
    return replace(found, looked=Looked(gap, more if beside is None else _joined(more, beside)))


def _beside_springs(known: Stated, plain: Score) -> Diagnosis | None:
    """Mistakes beside many effects, in a study with those put right that explain the data alone."""
    wrong = beside_springs(known, plain)
    if wrong is None:
        return None
    mistakes = [Mistake(one.code, one.sentence) for one in wrong.hypotheses]
    factors = []
    if wrong.factors:
        factor = _factor_mistake(wrong.factors[0])
        others = tuple(reason for one in wrong.factors[1:] for reason in one.reasons)
        factors.append(replace(factor, otherwise=(*factor.otherwise, *others)))
    instead = [(*mistakes[:-1], Mistake(one.code, one.sentence), *factors) for one in wrong.instead]
    return Diagnosis(
        (*mistakes, *factors),
        _sure(wrong.log_odds),
        wrong.gap_before,
        wrong.gap_after,
        wrong.edits,
        tuple(instead),
        softened=True,
    )


def _joined(one: Diagnosis, more: Diagnosis) -> Diagnosis:
    """Both, as one after the other was found."""
    return Diagnosis(
        (*one.mistakes, *more.mistakes),
        min(one.probability, more.probability),
        one.gap_before,
        more.gap_after,
        (*one.edits, *more.edits),
        tuple(
            (*first, *second)
            for first in (one.mistakes, *one.instead)
            for second in (more.mistakes, *more.instead)
        )[1:],
        one.softened or more.softened,
    )


def _braked(as_stated: Stated, first: Score, gap: float) -> tuple[Diagnosis, int] | None:
    """A drive that is another in one file than in the others, where that has evidence; the file's number."""
    found = brake(as_stated, first)
    if found is None:
        return None
    tried = len(as_stated.sets) * len(as_stated.robot.joints)
    log_odds = -0.5 * found.count * np.log(found.share) - np.log(tried)
    after = within(found.others, as_stated.uncertainty).gap
    if log_odds < CONVINCING or after >= gap:
        return None
    mistake = Mistake("brake", found.sentence(as_stated))
    return Diagnosis((mistake,), _sure(log_odds), gap, after, (found.edit,)), found.number


def _gap(one: _Put) -> float:
    return one.gap


def _likelier(one: _Put) -> tuple[int, bool, float]:
    """By what the first of those that explain the data as well is chosen: fewest mistakes, then a common
    factor that a mistake has, then the gap.
    """
    factor = one.decision.factor
    return len(_mistakes(one.decision)), factor is not None and not factor.known, one.gap


def _in_rad_per_s(as_stated: Stated, stiff: Score, quick: float, *, alone: bool = False) -> Looked | None:
    """Frequencies in rad/s, where the fitted drives are stiffer than any: accelerances are the same functions
    of frequencies that are all scaled, with stiffnesses scaled by the square, so that a fit does not see it.
    None where they would be as stiff in rad/s, or the data would have no resonance that tells, or (alone)
    where that alone leaves something to be explained.
    """
    for hypothesis in radians_per_second(as_stated, stiff):
        there = as_stated.changed(hypothesis.edits)
        score = scored(there.problem())
        now, then = sag(stiff), sag(score)
        if now is None or then is None or too_stiff(score) or (alone and not _right(there, score)):
            continue
        sentence = (
            f"{hypothesis.sentence}: as stated, the arm would sag under its own weight by"
            f" {np.degrees(now):.1g} degrees, which no drive is stiff enough for; in rad/s by"
            f" {np.degrees(then):.1g}"
        )
        inner = _look(there, None)
        mistake = Mistake(hypothesis.code, sentence)
        if inner.diagnosis is None:
            return Looked(quick, Diagnosis((mistake,), _BY_SIZE, quick, inner.gap, hypothesis.edits))
        alone_there = Diagnosis((mistake,), 1.0, quick, inner.gap, hypothesis.edits)
        return Looked(quick, _joined(alone_there, inner.diagnosis))
    return None


def _right(stated: Stated, score: Score) -> bool:
    """Whether a variant needs nothing further."""
    level = abs(score.level) < SLIGHT
    return level and (score.cost <= ROUGH or within(score, stated.uncertainty, QUIET).explained)


def _put_right(as_stated: Stated, decisions: Sequence[Decision]) -> list[_Put]:
    """Those that make a study: one with a payload of nothing does not."""
    found = []
    for one in decisions:
        with suppress(InputError, InputErrors):
            found += _put(as_stated, one)
    return found


def _put(as_stated: Stated, decision: Decision) -> list[_Put]:
    """A decision with each known factor near that which was found, of which the gap may tell."""
    found = []
    apart = _apart(as_stated)
    for factor in (None,) if decision.factor is None else near(decision.factor.value, apart):
        chosen = replace(decision, factor=factor)
        edits = (*_edits(chosen), *_of_factor(chosen))
        score = chosen.fitted or scored(as_stated.changed(edits).problem(), chosen.start(edits))
        found.append(_Put(chosen, edits, score, within(score, as_stated.uncertainty).gap))
    return found


def _apart(as_stated: Stated) -> float:
    """The logarithm by which a fitted common factor may be off: more beside uncertain masses and forces."""
    uncertain = as_stated.uncertainty
    some = (
        () if uncertain is None else (uncertain.std("links", "mass"), uncertain.std("channels", "force_gain"))
    )
    return float(np.linalg.norm([NEAR, *(_SIGMAS * one for one in some)]))


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
    """Those of a decision, with its common factor as one."""
    named = [Mistake(one.code, one.sentence) for one in decision.candidate.hypotheses]
    return (*named, *([] if decision.factor is None else [_factor_mistake(decision.factor)]))


def _factor_mistake(factor: Factor) -> Mistake:
    first, *others = factor.reasons or ("a sensitivity is wrong",)
    return Mistake("factor", f"all FRFs are {factor.words} what they should be: {first}", tuple(others))


def _sure(log_odds: float) -> float:
    """The probability of mistakes, with those as likely in place of the last one: neither is distinguished
    from the other here.
    """
    return float(1 / (1 + np.exp(-log_odds)))
