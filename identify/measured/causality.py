"""Whether FRFs answer before they are asked: the sign of a set that is the complex conjugate of the true one.

The impulse response of a structure is zero before the impulse; that of the conjugate set, as from software
with the time convention e^{-j omega t}, is zero after it.  No polarity of a sensor or a hammer does so.
"""

from __future__ import annotations

import numpy as np
import scipy

from identify.core.arrays import Array, Complex

_TIMES = 512
_CHANCE = 1e-6
"""Probability by which noise alone may look conjugated."""


def is_conjugated(frequency_hz: Array, frfs: Complex) -> bool:
    """Whether FRFs (lines, n), finite, have their impulse response before the impulse.

    Energies of the impulse responses over a quarter of the period of the lines before and after it, all FRFs
    with the same weight, are compared as two variances (F test), with as many degrees of freedom as lines
    share the energy of each FRF.
    """
    if len(frequency_hz) < 2 or not np.any(frfs):
        return False
    size = np.sqrt(np.sum(np.abs(frfs) ** 2, axis=0))
    frfs = frfs[:, size > 0] / size[size > 0]
    steps = np.gradient(frequency_hz)
    time = (np.arange(_TIMES) + 0.5) / (4 * _TIMES * np.median(steps))
    turning = np.exp(2j * np.pi * np.outer(time, frequency_hz)) * steps
    after, before = (np.sum((kernel @ frfs).real ** 2) for kernel in (turning, turning.conj()))
    freedom = np.sum(1 / np.sum(np.abs(frfs) ** 4, axis=0))
    return bool(before > after * scipy.special.fdtri(freedom, freedom, 1 - _CHANCE))
