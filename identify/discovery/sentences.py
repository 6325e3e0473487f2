"""What a discovery says: an effect by name with its numbers, what a step decided, the verdict; sentences an
engineer would say.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from identify.core.text import capital, listed
from identify.core.thresholds import CONVINCING, MISSING, QUIET
from identify.discovery.evidence import above_noise, removed
from identify.discovery.loop import Discovery
from identify.discovery.task import Option, Step
from identify.fitting.uncertainty import BOUNDS
from identify.model.effects.base import Effect
from identify.results.tables import ParameterTable
from identify.vibration.nuisances.settings import FORMS_ALONE, IMPACTS_ALONE
from identify.vibration.problem import Problem


def gaps(gap: float, elsewhere: float) -> str:
    """`1.02 (1.05 on data not fitted)`."""
    return f"{gap:.2f}" + ("" if math.isnan(elsewhere) else f" ({elsewhere:.2f} on data not fitted)")


_FAR = 5.0
"""A stiffness of a drive this many times off its start has compensated for something."""
_DOUBTFUL = ("not determined", *BOUNDS)
_SAID = 8
"""Effects that a verdict names: tables have all."""


def named(effect: Effect, own: Sequence[str], p: ParameterTable) -> str:
    """The effect with its parameters (names `own`) and their 95 % intervals."""
    said = []
    for name in own:
        row = p.name.index(name)
        unit = "" if p.unit[row] == "1" else f" {p.unit[row]}"
        spread = (
            f" ({p.low_95[row]:.4g} to {p.high_95[row]:.4g})"
            if p.free[row] and p.status[row] not in _DOUBTFUL
            else ""
        )
        doubt = f" ({p.status[row]})" if p.status[row] in _DOUBTFUL else ""
        said.append(f"{name} = {p.value[row]:.4g}{unit}{spread}{doubt}")
    return f"{effect.sentence()}: {', '.join(said)}" if said else effect.sentence()


def verdict_of(option: Option, step: Step) -> str:
    """A phrase on one candidate of a step."""
    said = (
        (step.best is option, "best"),
        (option in step.rivals, "the data cannot tell it from the best"),
        (
            math.isinf(option.model.squares),
            f"no solution: {option.model.failure or 'it does not fit the model'}",
        ),
        (not option.gain.refitted, "ruled out on few lines"),
        (option.gain.log_odds <= 0, "does not pay for its parameters"),
        (not option.gain.confirmed, "worse on data that were not fitted"),
        (step.best is not None, "explains less"),
    )
    return next((phrase for holds, phrase in said if holds), "not convincing")


def decision(step: Step, kept: bool) -> str:
    """What a step decided, in a sentence."""
    before, best = step.before, step.best
    if best is None:
        if not step.options:
            return "Nothing more was added: no effect, and no law at one place, explains the remaining gap."
        why = "none improves the fit and the prediction of other data by more than its parameters cost"
        return f"None of {len(step.options)} candidates is supported by the data: {why}."
    trial, share = best.model, removed(before.gap, best.model.gap)
    fell = (
        f"the gap goes from {gaps(before.gap, before.gap_validation)} to"
        f" {gaps(trial.gap, trial.gap_validation)}"
    )
    found = f"{capital(best.effect.sentence())} fits best: {fell}, {share:.0%} of what is above noise."
    if kept:
        return found + " It was added."
    return found + " It was not kept: it only compensated for another missing effect."


def assumed(problem: Problem, found: Discovery) -> str:
    """What was taken for granted of what was stated, in a sentence; empty where that cannot matter."""
    stated = problem.file.study.uncertainty
    if stated == FORMS_ALONE:
        return (
            "All stated values were taken as exact, except the form of the bending link, which was fitted,"
            " because a real link is not exactly a beam (`uncertainty: {flexible_links: ...}` in the new"
            " study)."
        )
    if stated == IMPACTS_ALONE:
        return (
            "All stated values were taken as exact, except strengths and duration of the impacts, which were"
            " fitted, because the effect depends on them (`uncertainty: {impacts: ...}` in the new study)."
        )
    if stated is not None:
        like = f" `{stated.like}`" if stated.like else ""
        return (
            f"Errors of masses, places, directions and gains were fitted as nuisance parameters within the"
            f" stated{like} uncertainty: only what they cannot explain was named."
        )
    if found.final.gap <= MISSING:
        return ""
    return (
        "All stated values were taken as exact.  Errors of masses, sensor places, gains and impact directions"
        " of some per cent, millimetres and degrees would leave such a gap, too: `uncertainty: typical` in"
        " the study takes them into account."
    )


def of_amplitude(at: str) -> str:
    """That something acts at a coordinate that depends on amplitude and that no effect says; empty without
    one.
    """
    if not at:
        return ""
    return (
        f"The remaining gap comes from {at} and depends on the strength of the impacts: an arbitrary torque"
        " there would explain nearly all of it. The dynamic stiffness that is measured there at each strength"
        " shows whether the joint slips, hardens or rubs."
    )


def verdict(found: Discovery) -> tuple[str, ...]:
    """The outcome in two or three sentences."""
    first, final = found.first, found.final
    before, after = gaps(first.gap, first.gap_validation), gaps(final.gap, final.gap_validation)
    if not found.added and first.gap <= QUIET:
        nothing = (
            f"Nothing is missing: the model explains the data to within their noise, gap {before}, and no"
            " candidate is supported."
        )
        return nothing, *_may_hide(first.gap)
    if not found.added and found.late:
        return (f"The gap is {before}, and no explanation was found within the time limit.",)
    if not found.added:
        return (
            (
                f"The gap is {before}, and no combination of known effects explains it: something else is"
                " missing from the model, or the data are wrong."
            ),
        )
    names = most_important([option.effect.sentence() for option in found.added])
    closed = (
        f"Missing from the model: {names}. With {'it' if len(found.added) == 1 else 'them'}, the gap goes"
        f" from {before} to {after}."
    )
    if final.gap <= QUIET:
        return closed, *(_may_hide(final.gap) or ("The remaining residual is noise.",))
    return closed, *_not_settled(found)


def most_important(sentences: Sequence[str]) -> str:
    """Effects, the most important first, as a list that is read at a glance: how many more there are."""
    more = len(sentences) - _SAID
    return listed(sentences if more < 2 else [*sentences[:_SAID], f"{more} less important ones"])


def _not_settled(found: Discovery) -> Iterator[str]:
    """What a model is worth that leaves more than noise: what it predicts, and which drives paid for it."""
    final = found.final
    if final.gap <= MISSING:
        yield "The remaining residual is more than noise, and no known effect explains most of it."
        return
    unseen = "" if math.isnan(final.gap_validation) else ", as data that were not fitted show"
    yield (
        f"This model is predictive{unseen}, but its physics is not settled: the remaining residual is"
        f" {final.gap:.1f} times the noise and not random, so log odds are not probabilities, and intervals"
        " are too narrow."
    )
    starts = {name: k for name, k in found.problem.starts.items() if name.endswith(".rz.stiffness")}
    far = [n for n, k in starts.items() if not 1 / _FAR < final.values.get(n, k) / k < _FAR]
    if far:
        many = "stiffnesses" if len(far) > 1 else "stiffness"
        yield f"Do not rely on the {many} {listed(far)}: more than {_FAR:.0f} times off the start value."


def _may_hide(gap: float) -> tuple[str, ...]:
    """What a gap does not rule out that passes as noise, but is larger than a noise level may be wrong by."""
    if not above_noise(gap):
        return ()
    return (
        f"The remaining residual passes as noise, but is {gap - 1:.0%} above it, more than the noise level"
        " may be wrong by: a small effect may hide in it, and would shift parameters out of their intervals.",
    )


def alike(step: Step) -> tuple[str, ...]:
    """What the data of a step cannot tell from its best candidate."""
    return tuple(option.effect.sentence() for option in step.rivals)


def remark(option: Option, before: float) -> str:
    """A comment for the config."""
    strength = (
        ""
        if option.gain.log_odds > 5e5
        else f", log odds {option.gain.log_odds:.0f} (above {CONVINCING:.0f} convinces)"
    )
    return f"found by identify discover: gap {before:.2f} -> {option.model.gap:.2f}{strength}"
