"""What oscillates in a record and is not in the model: warnings."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.explain.regression import Fit, RegressionProblem
from identify.measured.conditioning import slow_part

_HALF = 0.5
"""Part of the squares from which on it is most of them."""
_NEAR = 0.1
"""How far from its peak a resonance reaches, as a share of its frequency: five times a damping of 2 %."""
_MUCH = 0.05
"""Part of a target's squares below which what is left of it calls for no warning."""
_PERIODS = 10
"""A wave that passes fewer times in a record is too slow for a peak to be distinguished from a drift."""


def resonance_warnings(
    target: str, problem: RegressionProblem, fit: Fit, lowpass_hz: float
) -> tuple[str, ...]:
    """Joints of whose target (samples, joints) most lies above the low-pass, or what is left near one
    frequency.
    """
    rate = 1 / float(np.median(np.diff(problem.scene.time_s)))
    counted = np.where(problem.mask, problem.target - problem.datum_of(problem.target), 0.0)
    left = fit.residual(problem)
    said = []
    for row, axis in enumerate(problem.scene.axes):
        whole = float((counted[:, row] ** 2).sum())
        fast = counted[:, row] - slow_part(counted[:, row], lowpass_hz, rate)
        above = float((fast**2).sum()) / max(whole, 1e-300)
        peak, near = _peak(fast, rate)
        if above > _HALF and near > _HALF:
            said.append(
                f"{target}: {100 * above:.0f} % of its squares at joint {axis} lie above lowpass_hz"
                f" ({lowpass_hz:g} Hz), most near {peak:.3g} Hz, where no acceleration is"
                " known; if that is a resonance, give a `lowpass_hz` above it"
            )
            continue
        peak, near = _peak(left[:, row], rate)
        if near > _HALF and float((left[:, row] ** 2).sum()) > _MUCH * whole:
            said.append(
                f"{target}: {100 * near:.0f} % of what is left at joint {axis} lies near {peak:.3g} Hz: the"
                " record excites a resonance that the model lacks, or waves at one speed; without"
                " `link_position` a soft gear or link is not in it"
            )
    return tuple(said)


def _peak(values: Array, rate: float) -> tuple[float, float]:
    """Frequency, Hz, about which most of the squares of values (samples,) lie, and their part."""
    power = np.abs(np.fft.rfft(values)) ** 2
    frequencies = np.fft.rfftfreq(len(values), 1 / rate)
    sums = np.concatenate([[0.0], np.cumsum(power)])
    ends = [np.searchsorted(frequencies, (1 + side * _NEAR) * frequencies) for side in (-1, 1)]
    near = np.where(np.arange(len(power)) < _PERIODS, 0.0, sums[ends[1]] - sums[ends[0]])
    best = int(np.argmax(near))
    highest = ends[0][best] + int(np.argmax(power[ends[0][best] : ends[1][best]]))
    return float(frequencies[highest]), float(near[best] / max(sums[-1], 1e-300))
