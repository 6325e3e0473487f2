"""What is believed of amplitudes before any data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identify.motion.missing.catalogue import Kind
from identify.motion.missing.springs import SpringKind


def log_prior(kind: Kind | SpringKind, places: Sequence[int], values: Mapping[str, float]) -> float:
    """How much less likely amplitudes of a kind at some of its places are before any data than ones of
    nothing, natural logarithm, at values by name.

    A Cauchy prior as wide as what is usual (Jeffreys, Theory of Probability, 1961, section 5.2): where
    records cannot tell effects apart, such as a rotor and the first body of an arm, the usual one is named.
    """
    return -sum(float(np.sum(np.log1p(kind.away(values, place) ** 2))) for place in places)
