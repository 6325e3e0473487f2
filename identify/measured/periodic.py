"""FRFs and their noise from continuous records under a periodic excitation, such as a multisine.

At the harmonics of the period, noise averages out of the spectra of forces and responses alike, so that the
mean of both over the periods tells H even where a controller feeds noise back into a torque or a load cell is
noisy; the scatter of Y - H U over the periods is the noise of H (Pintelon and Schoukens, System
Identification, 2nd ed., section 2.5).  In the first period a structure has not settled yet: it is left out.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.core.errors import InputError
from identify.measured.estimators import history_name, quantity_of
from identify.measured.frf_set import FrfSet
from identify.measured.noise import pooled_variance
from identify.measured.time_history import TimeHistory

_WHOLE = 1e-3
"""Part of a sample by which a period may be off a whole number of them."""
_REPEATS, _SILENT = 20.0, 1e-10
"""Power of a force's mean over its variance from which on a line is excited, which one of noise alone reaches
once in some hundred million; power beside that of the strongest line below which it is rounding."""


def frf_from_periods(history: TimeHistory, period_s: float) -> FrfSet:
    """FRFs at the harmonics that the forces excite, with their noise; blocks are records of the same thing,
    as many as inputs or more.

    InputError where there is no force, no response, fewer blocks than inputs or than three periods in each,
    a period that is no whole number of samples, or no harmonic that every force repeats.
    """
    where, forces, responses = history_name(history), history.forces, history.responses
    periods = _periods(history, period_s)
    blocks, count, samples, _ = periods.shape
    if not forces or not responses or blocks < len(forces):
        found = f"{len(forces)} forces or torques and {len(responses)} responses in {blocks} records"
        raise InputError(where, found, "both, and as many records as forces")
    spectra = np.fft.rfft(periods, axis=2)[:, :, 1 : (samples + 1) // 2]
    excited = _excited(spectra[..., forces])
    if not excited.any():
        raise InputError(where, "no harmonic that repeats in every force", "a periodic force")
    spectra = np.moveaxis(spectra[:, :, excited], 2, 0)
    mean = spectra.mean(axis=2)
    back = np.linalg.pinv(mean[..., forces])
    frf = np.swapaxes(back @ mean[..., responses], 1, 2)
    off = spectra - mean[:, :, None]
    rest = off[..., responses] - np.einsum("lbpj,lij->lbpi", off[..., forces], frf)
    freedom = blocks * (count - 1)
    noise = np.sum(np.abs(rest) ** 2, axis=(1, 2)) / freedom / count
    share = np.sum(np.abs(back) ** 2, axis=2)
    power = np.sum(np.abs(frf) ** 2, axis=2, keepdims=True)
    pooled = pooled_variance(power, noise[:, :, None], 2 * freedom)
    return FrfSet(
        frequency_hz=(1 + np.flatnonzero(excited)) * history.sample_rate_hz / samples,
        frf=frf,
        outputs=tuple(history.channels[i] for i in responses),
        inputs=tuple(history.channels[i] for i in forces),
        quantity=quantity_of(history),
        noise=np.sqrt(pooled * share[:, None] / 2),
        source=history.source,
        sha256=history.sha256,
    )


def _periods(history: TimeHistory, period_s: float) -> Array:
    """(blocks, periods, samples, signals) without the first period of each block."""
    samples, size = history.data.shape[1], period_s * history.sample_rate_hz
    if abs(size - round(size)) > _WHOLE or round(size) < 8:
        found = f"a period of {period_s:g} s, {size:.6g} samples"
        raise InputError(history_name(history), found, "a whole number of at least 8", "correct `period_s`")
    length = round(size)
    if samples // length < 3:
        found = f"{samples / length:.3g} periods of {period_s:g} s"
        raise InputError(history_name(history), found, "3 or more", "record for longer")
    whole = history.data[:, length : samples // length * length]
    return whole.reshape(len(whole), -1, length, whole.shape[2])


def _excited(forces: Complex) -> Mask:
    """(lines,): where every force (blocks, periods, lines, inputs) repeats in some record."""
    mean = np.abs(forces.mean(axis=1)) ** 2
    variance = forces.var(axis=1) / (forces.shape[1] - 1)
    repeats = (mean > _REPEATS * variance) & (mean > _SILENT * mean.max(axis=1, keepdims=True))
    return np.asarray(repeats.any(axis=0).all(axis=1))
