"""What gives way without evidence: no bearing, base, mount or link is rigid, and what one that is taken to be
so gives way is found in the drives that it is in series with.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.discovery.decimated import decimated
from identify.discovery.sparse.evidence import covariance, inflation, weighed
from identify.discovery.sparse.fit import STEPS
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.unknowns import Unknowns
from identify.discovery.state import State
from identify.discovery.workers import Workers
from identify.vibration.all_springs import usual_springs
from identify.vibration.problem import with_effects


def left_open(workers: Workers, state: State) -> dict[str, float]:
    """Standard deviation of the logarithm of each stiffness and damping of the state's model, by name, that
    comes from what has no name: by how much they move where all of it may give way as it usually does, and
    how much less they are determined then.

    Whole whatever time is left: steps that were not taken would be intervals that are too narrow.  Nothing
    where nothing was found, which says that all is as stated, or where impacts are simulated.
    """
    if not state.added or any(one.of_amplitude for one in state.effects):
        return {}
    key = state.key("unnamed")
    found: dict[str, float] = workers.recall(key, lambda: _left_open(state), "what has no name")
    return found


def _left_open(state: State) -> dict[str, float]:
    values, few = state.model.values, decimated(state.problem)
    known = with_effects(few, state.effects, values)
    model = with_effects(few, (*state.effects, *usual_springs(known, values)), values)
    unknowns = Unknowns(model, len(model.file.study.effects))
    fit, start = Penalised(unknowns, price=0.0), unknowns.at(values)
    x = fit.minimise(Point(start), STEPS).x
    told = weighed(unknowns, x, fit.local(x).product, inflation(known, known.initial)).information
    own = np.isin(unknowns.names, list(values))
    less = _variance(told)[own] - _variance(told[np.ix_(own, own)])
    std = np.sqrt(np.maximum(less, 0.0) + (x - start)[own] ** 2)
    names, wanted = np.array(unknowns.names)[own], unknowns.log[own]
    return {str(name): float(one) for name, one in zip(names[wanted], std[wanted], strict=True)}


def _variance(information: Array) -> Array:
    """(f,): of each unknown; zero where nothing is known."""
    found, known = np.zeros(len(information)), np.flatnonzero(np.diag(information) > 0)
    some = information[np.ix_(known, known)]
    found[known] = np.diag(covariance(some, np.arange(len(known))))
    return found
