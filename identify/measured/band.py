"""The band that a test suggests: from below its first resonance to beyond as many as a model has to explain,
where its FRFs are more than noise.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import find_peaks

from identify.core.arrays import Array
from identify.measured.frf_set import POWER, FrfSet

_BELOW, _BEYOND = 0.5, 1.5
"""Where a band begins, over its first resonance, and ends, over its last: flanks tell of masses."""
_PEAK = 2.0
"""Power of a resonance over the valley beside it, 3 dB."""
_HALF = 0.5
"""Coherence below which noise has more power than what the force explains."""


def suggested_band(frf_set: FrfSet, resonances: int) -> tuple[float, float]:
    """Lowest and highest frequency, Hz, of the first resonances and their flanks, as far as they are measured
    well; all of that where there are fewer.
    """
    lines = frf_set.frequency_hz
    good = np.flatnonzero(_well_measured(frf_set))
    first, last = (good[0], good[-1]) if len(good) else (int(lines[0] == 0), len(lines) - 1)
    inside = frf_set.band(lines[first], lines[last])
    peaks, _ = find_peaks(np.log(_motion(inside)), prominence=np.log(_PEAK))
    at = inside.frequency_hz[peaks]
    low = max(lines[first], _BELOW * at[0]) if len(at) else lines[first]
    high = min(lines[last], _BEYOND * at[resonances - 1]) if len(at) >= resonances else lines[last]
    return float(low), float(high)


def _well_measured(frf_set: FrfSet) -> Array:
    """(lines,): whether half of the power of all FRFs has a coherence of more than a half."""
    moves = np.nan_to_num(np.abs(frf_set.frf) ** 2)
    if frf_set.coherence is None:
        return np.asarray(frf_set.frequency_hz > 0)
    explained = np.sum(moves * (np.nan_to_num(frf_set.coherence) > _HALF), axis=(1, 2))
    return np.asarray((explained > _HALF * np.sum(moves, axis=(1, 2))) & (frf_set.frequency_hz > 0))


def _motion(frf_set: FrfSet) -> Array:
    """(lines,): power of all FRFs as mobilities, in which resonances of all frequencies are as high."""
    mobility = np.abs(frf_set.frf) * np.abs(frf_set.s[:, None, None]) ** (1 - POWER[frf_set.quantity])
    return np.asarray(np.maximum(np.nansum(mobility**2, axis=(1, 2)), np.finfo(float).tiny))
