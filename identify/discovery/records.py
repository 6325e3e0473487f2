"""What discovery takes up into the present model because no hammer test is without it: when the impacts are
in their records.
"""

from __future__ import annotations

from identify.model.effects.pre_trigger import PreTrigger
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, with_effects


def timed(problem: Problem) -> Problem:
    """The problem with the pre-trigger as a parameter, where FRFs are those of impacts and the study does not
    say it.

    What a response that has not died out lacks at its end looks like whatever is missing.
    """
    effects, targets = problem.file.study.effects, [m.target for m in problem.measurements]
    impacts = any(isinstance(one, FrfTarget) and one.record is not None for one in targets)
    if not impacts or any(isinstance(effect, PreTrigger) for effect in effects):
        return problem
    return with_effects(problem, [*effects, PreTrigger()], {})
