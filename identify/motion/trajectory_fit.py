"""Fits of a motion: the loop of `identify.fitting.fit` on trajectories, then missing effects by the loop that
adds effects (`identify.fitting.selection`), judged by records that were not fitted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identify.core.errors import InputError
from identify.fitting.fit import Fit, Progress
from identify.fitting.selection.loop import select
from identify.fitting.selection.workbench import Story
from identify.motion.judging import FittedMotion
from identify.motion.problem import MotionProblem
from identify.motion.trajectory import TrajectoryObjective
from identify.motion.workbench import MotionWorkbench, TrialOption, TrialStep


@dataclass(frozen=True)
class EffectTrial:
    """An effect added to the model of its round: the gap on the fitted records and on those that judge,
    whether it stayed, and the odds for it there (natural logarithm).
    """

    name: str
    round: int
    gap: float
    gap_judged: float
    kept: bool
    log_odds: float = float("nan")


@dataclass(frozen=True)
class MotionFit:
    """The fit of the model that was kept, with its problem; trials start with the model as the study has it;
    rivals: (effect that stayed, another that does about as well in its place); first: the model as the study
    has it; objective: what was minimised, which remembers the last motions.
    """

    problem: MotionProblem
    fit: Fit
    trials: tuple[EffectTrial, ...]
    rivals: tuple[tuple[str, str], ...] = ()
    first: FittedMotion | None = None
    objective: TrajectoryObjective | None = None


def fit_motion(problem: MotionProblem, progress: Progress) -> MotionFit:
    """Fit a study of motion, then add its candidates, likeliest first, as long as they improve the records
    for validation (all, without any).

    Raises InputError where nothing is free, or nothing was measured.
    """
    if not any(parameter.free for parameter in problem.parameters):
        raise InputError(
            "study",
            "no number is to be identified",
            "at least one with `initial` and `bounds`, such as gear.ratio",
        )
    return with_missing(MotionWorkbench(problem, progress), Story())


def with_missing(bench: MotionWorkbench, story: Story) -> MotionFit:
    """The model of a workbench with the effects that it lacks, and all that was tried."""
    found = select(bench, story)
    final, leaner = bench.ended(found.final)
    first, kept = found.first, found.options
    trials = [EffectTrial("the model as it is", 0, first.fit.cost, first.gap, True)]
    for number, step in enumerate(story.steps, start=1):
        trials += _trials(bench.problem, number, step, kept, leaner)
    stayed = [step for step in story.steps if any(step.best is option for option in kept)]
    rivals = [
        (leaner.get(step.best.effect.name, step.best.effect.name), rival.effect.name)
        for step in stayed
        if step.best
        for rival in step.rivals
    ]
    return MotionFit(final.problem, final.fit, tuple(trials), tuple(rivals), first, final.objective)


def _trials(
    problem: MotionProblem,
    number: int,
    step: TrialStep,
    kept: tuple[TrialOption, ...],
    leaner: Mapping[str, str],
) -> list[EffectTrial]:
    """What a round refitted, in the order of the study, or as promising; leaner: what is left of those that
    stayed, by name.
    """
    order, found = [*problem.file.study.candidates, *(option.effect for option in step.options)], []
    for option in sorted(step.options, key=lambda option: order.index(option.effect)):
        if option.gain.refitted:
            stayed, name = any(option is one for one in kept), option.effect.name
            name = leaner.get(name, name) if stayed else name
            gaps = option.model.fit.cost, option.model.gap
            found.append(EffectTrial(name, number, *gaps, stayed, option.gain.log_odds))
    return found
