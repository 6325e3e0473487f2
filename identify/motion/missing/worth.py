"""Places of an effect that a fit has no use for: a joint whose amplitude is nothing beside its error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.core.thresholds import CONVINCING
from identify.fitting.selection.gain import Gain, Rule
from identify.motion.judging import FittedMotion
from identify.motion.missing.catalogue import Kind, log_prior
from identify.motion.missing.screen import independent
from identify.motion.missing.springs import SpringKind

ENOUGH = Rule(log_odds=CONVINCING, explained=0.01)
"""What is asked of an effect, and of each of its places."""


def needed(model: FittedMotion, kind: Kind | SpringKind, places: Sequence[int]) -> list[int]:
    """Those of the places (numbers in the kind) of an effect that the fit of a model needs: each is held to
    the rule that effects are held to.
    """
    return [place for place in places if ENOUGH.holds(worth(model, kind, [place]))]


def worth(model: FittedMotion, kind: Kind | SpringKind, places: Sequence[int]) -> Gain:
    """What places of an effect gain, by the curvature at the fit of a model (Laplace, unit information), with
    the number of independent residuals.
    """
    problem, objective = model.problem, model.objective
    scale, (residual, slopes) = Scale(problem.parameters), model.seen
    slopes = slopes * scale.slope(scale.to_x(model.fit.values))
    free = independent(objective, residual)
    information = free * slopes.T @ slopes / max(model.fit.cost**2, free / objective.count)
    information += np.diag(scale.prior_information())
    names = [problem.parameters[number].name for number in scale.free]
    own, away, unknowns = list[int](), list[float](), 0
    for place in places:
        parts = own_of(model, kind, place, names, scale)
        own, away, unknowns = [*own, *parts[0]], [*away, *parts[1]], unknowns + parts[2]
    rest = [n for n in range(len(information)) if n not in own]
    beside = information[np.ix_(own, rest)]
    left = information[np.ix_(own, own)] - beside @ np.linalg.pinv(information[np.ix_(rest, rest)]) @ beside.T
    squares = float(np.array(away) @ left @ away)
    prior = log_prior(kind, places, problem.by_name(model.fit.values))
    odds = 0.5 * squares - 0.5 * unknowns * float(np.log(max(free, 2.0))) + prior
    return Gain(odds, 1 - 1 / float(np.sqrt(1 + squares / free)))


def own_of(
    model: FittedMotion, kind: Kind | SpringKind, place: int, names: Sequence[str], scale: Scale
) -> tuple[list[int], Array, int]:
    """The free parameters of a place, of springs their stiffness, by their numbers among the names of those
    that are free; how far they are, to first order, from where it is nothing on the search scale; and how
    many unknowns it has.
    """
    x = scale.to_x(model.fit.values)
    if isinstance(kind, SpringKind):  # compliances, whose relative errors are those of the stiffness
        own = [names.index(f"{kind.coordinates[n]}.stiffness") for n in kind.places[place]]
        return own, -np.ones(len(own)), 2 * len(own)
    own = [names.index(f"joint{place + 1}.{key}") for key in kind.where]
    absent = model.fit.values.copy()
    for row, number in enumerate(own):
        absent[scale.free[number]] = kind.present[row, place]
    return own, (x - scale.to_x(absent))[own], len(own)
