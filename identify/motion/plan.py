"""The plan of the fit of a study of motion."""

from __future__ import annotations

from collections.abc import Sequence

from identify.core.errors import InputError
from identify.fitting.objective import Objective
from identify.fitting.plan import FitPlan, StageSettings, make_stages
from identify.motion.problem import MotionProblem
from identify.motion.recording import PreparedRecord
from identify.motion.trajectory import TrajectoryObjective


def fitted_objective(problem: MotionProblem) -> TrajectoryObjective:
    """The gap on the records to be fitted."""
    return TrajectoryObjective(problem, fitted_records(problem), problem.file.study.noise)


def motion_plan(
    problem: MotionProblem,
    stages: Sequence[StageSettings],
    starts: int,
    gap: TrajectoryObjective | None = None,
) -> FitPlan:
    """The plan of a fit of recorded motion: the gap on the records to be fitted, or on those that a stage
    names; gap: that of the problem, where it is to be asked for its motions again.

    Raises InputError where a stage names what there is not.
    """
    study = problem.file.study
    objective = gap or fitted_objective(problem)

    def of(stage: StageSettings) -> Objective:
        if stage.measurements is None:
            return objective
        return TrajectoryObjective(problem, fitted_records(problem, stage.measurements), study.noise)

    return FitPlan(
        problem.parameters,
        objective,
        make_stages(stages, problem.parameters, of),
        starts=starts,
        start_factor=study.start_factor,
        target_cost=study.target_cost,
        seed=study.seed,
    )


def fitted_records(problem: MotionProblem, names: Sequence[str] | None = None) -> list[PreparedRecord]:
    """The records to be fitted, or those of them that are named; InputError for an unknown name."""
    known = {record.settings.name: record for record in problem.records if record.settings.use == "fit"}
    for name in names or ():
        if name not in known:
            raise InputError(
                "optimizer.measurements", f"no record {name!r} is fitted", "one of " + ", ".join(known)
            )
    return [record for name, record in known.items() if names is None or name in names]
