"""Fits of a motion: the loop of `identify.fitting.fit` on trajectories, then missing effects by the loop that
adds effects (`identify.fitting.selection`), judged by records that were not fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

from identify.core.errors import InputError
from identify.fitting.fit import Fit, Progress
from identify.fitting.selection.loop import select
from identify.fitting.selection.workbench import Story
from identify.motion.problem import MotionProblem
from identify.motion.workbench import MotionWorkbench, TrialOption, TrialStep


@dataclass(frozen=True)
class EffectTrial:
    """An effect added to the model of its round: the gap on the fitted records and on those that judge, and
    whether it stayed.
    """

    name: str
    round: int
    gap: float
    gap_judged: float
    kept: bool


@dataclass(frozen=True)
class MotionFit:
    """The fit of the model that was kept, with its problem; trials start with the model as the study has it;
    rivals: (effect that stayed, another that does about as well in its place).
    """

    problem: MotionProblem
    fit: Fit
    trials: tuple[EffectTrial, ...]
    rivals: tuple[tuple[str, str], ...] = ()


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
    story = Story()
    found = select(MotionWorkbench(problem, progress), story)
    first, kept = found.first, found.options
    trials = [EffectTrial("the model as it is", 0, first.fit.cost, first.gap, True)]
    for number, step in enumerate(story.steps, start=1):
        trials += _trials(problem, number, step, kept)
    stayed = [step for step in story.steps if any(step.best is option for option in kept)]
    rivals = [
        (step.best.effect.name, rival.effect.name) for step in stayed if step.best for rival in step.rivals
    ]
    return MotionFit(found.final.problem, found.final.fit, tuple(trials), tuple(rivals))


def _trials(
    problem: MotionProblem, number: int, step: TrialStep, kept: tuple[TrialOption, ...]
) -> list[EffectTrial]:
    """What a round tried, in the order of the study."""
    order = problem.file.study.candidates
    return [
        EffectTrial(
            option.effect.name,
            number,
            option.model.fit.cost,
            option.model.gap,
            any(option is one for one in kept),
        )
        for option in sorted(step.options, key=lambda option: order.index(option.effect))
    ]
