"""The intervals of a fit of vibration, whichever cost it has.

The likelihood fits nuisance parameters along, so that its intervals are marginal over them.  No other
cost says how an error in kg is to be weighed against its residuals, in Hz or m/N: it is fitted as published,
with what was stated taken as exact, and its optimum is a function of the errors p that were not fitted.  By
the implicit function theorem

    dx/dp = -(J'J)^-1 J' dr/dp

with r the cost's own residuals and J their derivatives (Gauss-Newton: the squares that gradient methods
minimise; a sum of moduli of residuals that scatter alike has the same optimum, on average), and the stated
errors widen the intervals by it, linearly.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.fitting.objective import Objective
from identify.fitting.uncertainty import Uncertainty, propagated_uncertainty
from identify.vibration.costs.modal_target import Targets
from identify.vibration.problem import Problem
from identify.vibration.uncertainty import by_residuals, uncertainty


def intervals(problem: Problem, values: Array) -> Uncertainty:
    """Of the parameters at values (unknowns,), the optimum of the study's cost."""
    targets, cost = problem.targets(), problem.file.study.cost
    if cost.likelihood or not targets.nuisances:
        return uncertainty(targets, Scale(problem.parameters), values)
    return _propagated(targets, cost.objective(targets), problem, values)


def _propagated(targets: Targets, objective: Objective, problem: Problem, values: Array) -> Uncertainty:
    own, values_of_effects = Scale(problem.of_effects), values[: problem.size]
    exact = Targets(targets.frf, targets.modal)
    found, wider, notes = by_residuals(exact, own, values_of_effects)
    moved = _moved(objective, Scale(problem.parameters), values, len(own.free), own, found.product)
    given = found.count, own, values_of_effects, notes, wider
    return propagated_uncertainty(found.product, found.variance, moved, *given)


def _moved(
    objective: Objective, every: Scale, values: Array, count: int, own: Scale, information: Array
) -> Array:
    """(f, e): how far each error moves the optimum, on the search scale.

    What the cost does not determine stays where the bounds put it.  They are weighed against the cost's
    residuals, which have no unit of noise, as if these said as much in all as the data do.
    """
    slope = every.slope(every.to_x(values))
    product = objective.product(values, every.free)[:-1, :-1] * np.outer(slope, slope)
    data = product[:count, :count]
    unit = np.trace(information) / max(np.trace(data), np.finfo(float).tiny)
    determined = unit * data + np.diag(own.prior_information())
    return np.asarray(-np.linalg.solve(determined, unit * product[:count, count:]))
