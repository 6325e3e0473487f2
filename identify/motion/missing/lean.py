"""Places of an effect that a fit has no use for: a joint whose amplitude is nothing beside its error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.motion.judging import FittedMotion
from identify.motion.missing.catalogue import Kind
from identify.motion.missing.screen import independent
from identify.motion.missing.springs import SpringKind


def needed(model: FittedMotion, kind: Kind | SpringKind, places: Sequence[int]) -> list[int]:
    """Those of the places (numbers in the kind) of an effect that the fit of a model needs, by the curvature
    at it: half the squares that it would lose without them, less half ln n for each unknown (Laplace, unit
    information), n the number of independent residuals.
    """
    problem, objective = model.problem, model.objective
    scale, (residual, slopes) = Scale(problem.parameters), model.seen
    slopes = slopes * scale.slope(scale.to_x(model.fit.values))
    worth = independent(objective, residual)
    information = worth * slopes.T @ slopes / max(model.fit.cost**2, worth / objective.count)
    information += np.diag(scale.prior_information())
    names = [problem.parameters[number].name for number in scale.free]
    covariance, kept = np.linalg.inv(information), list[int]()
    for place in places:
        own, away, unknowns = _own(model, kind, place, names, scale)
        squares = float(away @ np.linalg.solve(covariance[np.ix_(own, own)], away))
        if 0.5 * squares > 0.5 * unknowns * np.log(max(worth, 2.0)):
            kept.append(place)
    return kept


def _own(
    model: FittedMotion, kind: Kind | SpringKind, place: int, names: Sequence[str], scale: Scale
) -> tuple[list[int], Array, int]:
    """The free parameters of a place, how far they are from where it is nothing on the search scale, and how
    many unknowns it has.
    """
    x = scale.to_x(model.fit.values)
    if isinstance(kind, SpringKind):  # a compliance, whose relative error is that of the stiffness
        return [names.index(f"{kind.coordinates[place]}.stiffness")], np.ones(1), 2
    own = [names.index(f"joint{place + 1}.{key}") for key in kind.where]
    absent = model.fit.values.copy()
    for row, number in enumerate(own):
        absent[scale.free[number]] = kind.present[row, place]
    return own, (x - scale.to_x(absent))[own], len(own)
