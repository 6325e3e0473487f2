"""Fits of a motion: the loop of `identify.fitting.fit` on trajectories, then missing effects tried one by one
on records that were not fitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.fitting.fit import Fit, Progress, fit
from identify.fitting.plan import StageSettings
from identify.motion.plan import motion_plan
from identify.motion.problem import MotionProblem, with_numbers
from identify.motion.study import MotionCandidate
from identify.motion.trajectory import TrajectoryObjective

_REFIT = {"kind": "gauss-newton", "evaluations": 40, "tolerance": 1e-5}
"""How a model with an effect added is fitted, from where the model without it ended."""
_WORTH = 0.99
"""An effect stays only where it takes the gap on the records that judge to this share of what it was, or
lower.
"""


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
    """The fit of the model that was kept, with its problem; trials start with the model as the study has
    it.
    """

    problem: MotionProblem
    fit: Fit
    trials: tuple[EffectTrial, ...]


def fit_motion(problem: MotionProblem, progress: Progress) -> MotionFit:
    """Fit a study of motion, then add its candidates, best first, as long as they improve the records for
    validation (all, without any).

    Raises InputError where nothing is free, or nothing was measured.
    """
    study = problem.file.study
    if not any(parameter.free for parameter in problem.parameters):
        raise InputError(
            "study",
            "no number is to be identified",
            "at least one with `initial` and `bounds`, such as gear.ratio",
        )
    best = fit(motion_plan(problem, study.optimizer, study.starts), progress)
    judged = judge(problem, best.values)
    trials = [EffectTrial("the model as it is", 0, best.cost, judged, True)]
    left = list(study.candidates)
    while left:
        tried = [_try(problem, best, candidate, progress) for candidate in left]
        scores = [judge(added, found.values) for added, found in tried]
        winner = int(np.argmin(scores))
        better = scores[winner] <= _WORTH * judged
        turn = len(study.candidates) - len(left) + 1
        results = zip(left, tried, scores, strict=True)
        trials += [
            EffectTrial(c.name, turn, found.cost, score, better and n == winner)
            for n, (c, (_, found), score) in enumerate(results)
        ]
        if not better:
            break
        (problem, best), judged = tried[winner], scores[winner]
        left.pop(winner)
    return MotionFit(problem, best, tuple(trials))


def judge(problem: MotionProblem, values: Array) -> float:
    """The gap on the records for validation; on all where none is."""
    records = [record for record in problem.records if record.settings.use == "validate"] or problem.records
    objective = TrajectoryObjective(problem, records, problem.file.study.noise)
    return float(objective.costs(values[None])[0])


def _try(
    problem: MotionProblem, best: Fit, candidate: MotionCandidate, progress: Progress
) -> tuple[MotionProblem, Fit]:
    """The model with one more effect, from where the fit without it ended."""
    values = {p.name: float(v) for p, v in zip(problem.parameters, best.values, strict=True)}
    added = with_numbers(problem, candidate.numbers, values)
    return added, fit(motion_plan(added, [StageSettings.parse(_REFIT)], 1), progress)
