"""What might stand in the place of an effect that was found, to first order: what the effect takes off the
residuals of the last model, offered to everything that may be missing beside all others.

The effects that come first were found while those that came later were missing, and may stand for them or
for something that was never tried beside them (sequential replacement: Miller, Subset Selection in
Regression, 2002, section 3.4).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.parameters import Scale
from identify.motion.judging import FittedMotion
from identify.motion.missing.catalogue import Kind, log_prior
from identify.motion.missing.linear import Place, solutions
from identify.motion.missing.screen import Promise, distinct, promise, sight_of
from identify.motion.missing.springs import SpringKind
from identify.motion.missing.worth import own_of
from identify.motion.study import MotionCandidate


def instead(
    model: FittedMotion,
    effect: MotionCandidate,
    kind: Kind | SpringKind,
    at: Sequence[int],
    places: Sequence[Place],
) -> list[Promise]:
    """An effect of a model, a kind at some of its places, and after it what promises something where it is
    not, the most promising first; places: all that may be missing, with what they change.
    """
    (residual, slopes), scale = model.seen, Scale(model.problem.parameters)
    slopes = slopes * scale.slope(scale.to_x(model.fit.values))
    names = [model.problem.parameters[number].name for number in scale.free]
    parts = [own_of(model, kind, place, names, scale) for place in at]
    own = [number for part in parts for number in part[0]]
    away, unknowns = np.concatenate([part[1] for part in parts]), sum(part[2] for part in parts)
    dampers = {names[n].replace(".stiffness", ".damping") for n in own}
    rest = [n for n, name in enumerate(names) if n not in own and name not in dampers]
    without = sight_of(model, residual - slopes[:, own] @ away, slopes[:, rest], len(places))
    with_it = sight_of(model, residual, slopes, len(places))
    worth = without.log_odds(float(with_it.residual @ with_it.residual), unknowns, len(at))
    worth += log_prior(kind, at, model.problem.by_name(model.fit.values))
    others = [one for one in places if one.kind.name != kind.name or one.number not in at]
    found = [promise(one.places, one.log_odds, one.starts()) for one in solutions(others, without)]
    return [Promise(kind, tuple(at), effect, worth, {}), *distinct(found)]
