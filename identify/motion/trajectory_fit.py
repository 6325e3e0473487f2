"""Fits of a motion: the loop of `identify.fitting.fit` on trajectories, then missing effects tried one by one
on records that were not fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.fitting.fit import Fit, Progress, fit
from identify.fitting.optimizers.base import Optimizer, parse_optimizer
from identify.motion.problem import MotionProblem, with_numbers
from identify.motion.recording import Record
from identify.motion.study import Candidate, MotionStudy
from identify.motion.trajectory import TrajectoryObjective

_REFIT = {"kind": "gauss-newton", "evaluations": 40, "tolerance": 1e-5}
"""How a model with an effect added is fitted, from where the model without it ended."""
_WORTH = 0.99
"""An effect stays only where it takes the gap on the records that judge to this share of what it was, or
lower.
"""


@dataclass(frozen=True)
class TrajectoryCost:
    """RMS of simulated less recorded signals over their standard deviations: the gap; 1 is perfect."""

    noise: Mapping[str, float]
    kind: str = "trajectory"

    def objective(self, targets: MotionTargets) -> TrajectoryObjective:
        """The cost on these records."""
        return TrajectoryObjective(targets.problem, targets.records, self.noise)


@dataclass(frozen=True)
class MotionTargets:
    """Records to compare."""

    problem: MotionProblem
    records: Sequence[Record]


@dataclass(frozen=True)
class FittedMotion:
    """What the loop reads of a study of motion."""

    cost: TrajectoryCost
    stages: list[Optimizer]
    starts: int
    start_factor: float
    target_cost: float
    seed: int
    last_resort: list[Optimizer] = field(default_factory=list)


@dataclass(frozen=True)
class MotionFitFile:
    """The study as the loop asks for it."""

    study: FittedMotion


@dataclass(frozen=True)
class FittableMotion:
    """A problem of motion as the fit loop wants it (`identify.fitting.fit.Fittable`)."""

    problem: MotionProblem
    file: MotionFitFile

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters."""
        return self.problem.parameters

    @property
    def initial(self) -> Array:
        """Where the search starts, (parameters,)."""
        return self.problem.initial

    def targets(self, use: str = "fit", names: Sequence[str] | None = None) -> MotionTargets:
        """The records of that use, or those of them that are named; InputError for an unknown name."""
        known = {
            record.settings.name: record for record in self.problem.records if record.settings.use == use
        }
        for name in names or ():
            if name not in known:
                raise InputError(
                    "optimizer.measurements", f"no record {name!r} is fitted", "one of " + ", ".join(known)
                )
        return MotionTargets(
            self.problem, [record for name, record in known.items() if names is None or name in names]
        )


@dataclass(frozen=True)
class Trial:
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
    trials: tuple[Trial, ...]


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
    best = fit(_fittable(problem, study.optimizer, study.starts), progress)
    judged = judge(problem, best.values)
    trials = [Trial("the model as it is", 0, best.cost, judged, True)]
    left = list(study.candidates)
    while left:
        tried = [_try(problem, best, candidate, progress) for candidate in left]
        scores = [judge(added, found.values) for added, found in tried]
        winner = int(np.argmin(scores))
        better = scores[winner] <= _WORTH * judged
        turn = len(study.candidates) - len(left) + 1
        results = zip(left, tried, scores, strict=True)
        trials += [
            Trial(c.name, turn, found.cost, score, better and n == winner)
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
    problem: MotionProblem, best: Fit, candidate: Candidate, progress: Progress
) -> tuple[MotionProblem, Fit]:
    """The model with one more effect, from where the fit without it ended."""
    values = {p.name: float(v) for p, v in zip(problem.parameters, best.values, strict=True)}
    added = with_numbers(problem, candidate.numbers, values)
    return added, fit(_fittable(added, [parse_optimizer(_REFIT)], 1), progress)


def _fittable(problem: MotionProblem, stages: list[Optimizer], starts: int) -> FittableMotion:
    s: MotionStudy = problem.file.study
    study = FittedMotion(TrajectoryCost(s.noise), stages, starts, s.start_factor, s.target_cost, s.seed)
    return FittableMotion(problem, MotionFitFile(study))
