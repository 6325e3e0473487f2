"""What explains a target of a recorded motion: the loop that adds effects (`identify.fitting.selection`), and
what each one is worth in the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
from identify.explain.regression import Fit, aligned, solve
from identify.explain.screen import refine
from identify.explain.workbench import MotionOption, RecordWorkbench, reweighted, rms
from identify.fitting.selection.gain import Gain
from identify.fitting.selection.loop import found_in, select
from identify.fitting.selection.prune import left_out
from identify.fitting.selection.turn import as_options, rivals
from identify.fitting.selection.workbench import Option, Story


@dataclass(frozen=True)
class Addition:
    """One effect added: what it gained then, and the residual it left, RMS per joint on both records."""

    option: MotionOption
    rms_fit: Array
    rms_judge: Array


@dataclass(frozen=True)
class Explanation:
    """What explains a target: the fit, what was found in order, and what was there before any effect.

    gains: what each effect of the fit is worth at the end, by leaving it out; rivals: per effect, names of
    others that would do about as well in its place; other: the same effects fitted to the judging record, for
    comparison; tried: number of candidates.
    """

    fit: Fit
    start: Fit
    steps: tuple[Addition, ...]
    gains: tuple[Gain, ...]
    rivals: tuple[tuple[str, ...], ...]
    other: Fit
    tried: int


def grow(bench: RecordWorkbench, story: Story) -> tuple[Fit, list[Addition]]:
    """Add effects as long as one passes; what was added."""
    before, judge = len(story.steps), bench.judge
    final = select(bench, story).final
    return final, [
        Addition(option, rms(bench.fitted, option.model), rms(judge, aligned(judge, option.model)))
        for option in found_in(story.steps[before:])
    ]


def conclude(bench: RecordWorkbench, fit: Fit, steps: Sequence[Addition]) -> Explanation:
    """What was selected, from all sides."""
    judge = bench.judge
    without = left_out(bench, bench.criterion([fit]), fit, fit.effects)
    other = refine(judge, reweighted(judge, solve(judge, fit.effects, fit.nonlinear, fit.weights)))
    return Explanation(
        fit,
        _as_stated(bench, fit),
        tuple(steps),
        tuple(gain for _, gain in without),
        tuple(
            _rivals(bench, fit, Option(effect, fit, bench.size(fit, effect), gain), rest)
            for effect, (rest, gain) in zip(fit.effects, without, strict=True)
        ),
        other,
        len(bench.effects),
    )


def _as_stated(bench: RecordWorkbench, fit: Fit) -> Fit:
    """No effect, and bodies exactly as they are stated."""
    found = solve(bench.fitted, (), (), fit.weights)
    return replace(found, coefficients=np.zeros_like(found.coefficients))


def _rivals(bench: RecordWorkbench, fit: Fit, chosen: MotionOption, rest: Fit) -> tuple[str, ...]:
    """Names of effects that in place of one do about as well on the held-out record; rest: the fit without
    it.

    A harmonic has no rival but another harmonic, and those were all tried beside it.
    """
    own = chosen.effect
    if own.harmonic:
        return ()
    others = [
        other
        for other in bench.candidates(rest)
        if own.name not in (other.needs, other.name) and not other.harmonic
    ]
    criterion = bench.criterion([fit])
    options = as_options(criterion, rest, bench.screen(rest, others, Story()))
    return tuple(option.effect.name for option in rivals(bench.policy, criterion, fit, chosen, options))
