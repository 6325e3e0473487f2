"""The 95 % bands of depth limits.

A limit is the least of several crossings, each with a depth that moves in proportion to exp(g z), z the
independent standard normal numbers of all that is uncertain: to first order in the logarithm, in which depths
that are products (stiffness times damping over a cutting coefficient) are exact.  The band is that of the
least of all crossings over draws of z, so that it knows of another lobe that may come first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.thresholds import PERCENTILES_95
from identify.machining.exact_limit import ExactLimit
from identify.machining.mounted import Uncertain

_SEED = 1
UNKNOWN = (0.0, np.inf)


def relative_band(
    crossings: Sequence[ExactLimit], tip: Uncertain, coefficients: float, draws: int
) -> tuple[float, float]:
    """95 % limits of the least of crossings, over the least of them; 0 and infinity without any.

    coefficients: relative standard deviation of all cutting coefficients together.
    """
    if not crossings:
        return UNKNOWN
    least = min(one.depth for one in crossings)
    rng = np.random.default_rng(_SEED)
    moves = [tip.relative(one) for one in crossings]
    shared = rng.standard_normal((draws, len(moves[0][0])))
    found = np.full(draws, np.inf)
    for one, (change, misfit) in zip(crossings, moves, strict=True):
        log = shared @ change + misfit * rng.standard_normal(draws)
        with np.errstate(over="ignore"):
            found = np.minimum(found, one.depth / least * np.exp(log))
    found = found * np.exp(coefficients * rng.standard_normal(draws))
    low, high = np.percentile(found, PERCENTILES_95)
    return min(float(low), 1.0), max(float(high), 1.0)
