"""One turn of the loop: every candidate is looked at, the promising ones refitted, the best chosen by
evidence, its rivals named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from identify.fitting.selection.gain import UNKNOWN
from identify.fitting.selection.policy import Policy
from identify.fitting.selection.workbench import (
    Attempt,
    Criterion,
    Named,
    Option,
    Step,
    Story,
    Workbench,
)

E = TypeVar("E", bound=Named)
M = TypeVar("M")


def turn(bench: Workbench[E, M], before: M, story: Story, banned: Sequence[E] = ()) -> Step[E, M]:
    """Try all candidates beside the effects of `before`, but the banned ones."""
    found = [effect for effect in bench.candidates(before) if effect not in banned]
    screened = bench.screen(before, found, story)
    promising, criterion, options = _tried(bench, before, screened, story)
    chosen = choice(bench.policy, options)
    step = Step(before, tuple(options), chosen, (), criterion)
    if not chosen:
        step = _with_pair(bench, step, screened, banned)
    if step.best is not None and bench.policy.rivals_each:
        others = [option for option in step.options if option not in step.found]
        step = replace(step, rivals=rivals(bench.policy, criterion, step.best.model, step.best, others))
    rest = [Option(a.effect, a.model, a.size, UNKNOWN) for a in screened if a not in promising]
    return replace(step, options=(*step.options, *rest))


def _tried(
    bench: Workbench[E, M], before: M, screened: Sequence[Attempt[E, M]], story: Story
) -> tuple[list[Attempt[E, M]], Criterion[M], list[Option[E, M]]]:
    """What promised enough to be refitted, how models are judged, and the best of each, the likeliest first;
    of a persistent bench the next ones too, until one is admitted.
    """
    promising, groups = list[Attempt[E, M]](), list[list[Attempt[E, M]]]()
    while True:
        more = bench.promising(before, [one for one in screened if one not in promising])
        promising += more
        groups += [group for group in bench.refit(before, more) if group]
        criterion = bench.criterion([before, *(attempt.model for group in groups for attempt in group)])
        options = ranked([ranked(as_options(criterion, before, group))[0] for group in groups])
        last = not bench.policy.persistent or not more or story.late
        if last or choice(bench.policy, options):
            return promising, criterion, options


def as_options(criterion: Criterion[M], before: M, attempts: Sequence[Attempt[E, M]]) -> list[Option[E, M]]:
    """What attempts of one effect each gain over the model before."""
    return [Option(a.effect, a.model, a.size, criterion.gain(before, a.model)) for a in attempts]


def ranked(options: Sequence[Option[E, M]]) -> list[Option[E, M]]:
    """The likeliest first."""
    return sorted(options, key=lambda option: -option.gain.log_odds)


def choice(policy: Policy, options: Sequence[Option[E, M]]) -> tuple[Option[E, M], ...]:
    """The best of the options that are admitted; nothing where none is.

    The likeliest, or the smallest of those that explain about as much as the best one, where a policy asks
    for that.
    """
    admitted = [option for option in options if policy.admit.holds(option.gain)]
    if not admitted or policy.parsimony is None:
        return tuple(ranked(admitted)[:1])
    most = max(option.gain.explained for option in admitted)
    alike = [option for option in admitted if option.gain.explained >= policy.parsimony * most]
    return (min(alike, key=lambda option: (option.size, -option.gain.log_odds)),)


def rivals(
    policy: Policy,
    criterion: Criterion[M],
    model: M,
    chosen: Option[E, M],
    options: Sequence[Option[E, M]],
) -> tuple[Option[E, M], ...]:
    """Options that do about as well as what was chosen, whose model is `model`.

    They gain by themselves what `policy.rival` asks and at least `policy.rival_part` of what was chosen
    explains, and the odds for the chosen model over theirs are below `policy.rival_log_odds`.
    """
    least = policy.rival_part * chosen.gain.explained if policy.rival_part > 0 else -float("inf")
    return tuple(
        option
        for option in options
        if policy.rival.holds(option.gain)
        and option.gain.explained > least
        and criterion.gain(option.model, model).log_odds < policy.rival_log_odds
    )


def _with_pair(
    bench: Workbench[E, M], step: Step[E, M], screened: Sequence[Attempt[E, M]], banned: Sequence[E]
) -> Step[E, M]:
    """The step with what a pair says where it says more."""
    found = bench.pair(step, screened, banned)
    if found is None:
        return step
    options = ranked([*step.options, *(option for option in found if option not in step.options)])
    return replace(step, options=tuple(options), found=found)
