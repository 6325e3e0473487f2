"""What the fit of a study of vibration is told."""

from __future__ import annotations

import numpy as np

from identify.core.thresholds import QUIET
from identify.fitting.objective import Objective
from identify.fitting.plan import FitPlan, make_stages
from identify.vibration.costs.base import parse_cost
from identify.vibration.problem import Problem
from identify.vibration.study import VibrationStage


def fit_plan(problem: Problem) -> FitPlan:
    """The plan of a study: each stage with its own cost or the study's, on its own measurements or on all.

    The cost of FRF least squares is a gap, so a minimum above noise is not believed early.  Raises InputError
    where a stage names what there is not, or a cost has not the data it compares.
    """
    study, parameters = problem.file.study, problem.parameters
    objective = study.cost.objective(problem.targets())

    def of(stage: VibrationStage) -> Objective:
        if stage.cost is None and stage.measurements is None:
            return objective
        return (stage.cost or study.cost).objective(problem.targets(names=stage.measurements))

    return FitPlan(
        parameters,
        objective,
        make_stages(study.stages, parameters, of),
        make_stages(study.last_resort, parameters, of),
        study.starts,
        study.start_factor,
        study.target_cost,
        QUIET if study.cost == parse_cost("frf-least-squares") else np.inf,
        study.seed,
    )
