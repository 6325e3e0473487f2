"""FRFs and their noise from continuous records under a periodic excitation, such as a multisine.

At the harmonics of the period, noise averages out of the spectra of forces and responses alike, so that the
mean of both over the periods tells H even where a controller feeds noise back into a torque or a load cell is
noisy; the scatter of Y - H U over the periods is the noise of H (Pintelon and Schoukens, System
Identification, 2nd ed., section 2.5).  In the first period a structure has not settled yet: it is left out.

FRFs and their noise from continuous records under any excitation: the local polynomial method.

In a short window of lines around line k, r lines away from it, spectra of responses and forces obey

    Y(k + r) = (G_0 + G_1 r + ... + G_R r^R) U(k + r) + T_0 + ... + T_R r^R + V(k + r),

where T is what begins before the record and ends after it; both are smooth, the noise V is not, so that
linear least squares tell G_0 = H(k) and the variance of V (Pintelon and Schoukens, System Identification, 2nd
ed., section 7.2).  Windows do not overlap, so that no two lines share noise.

A controller feeds noise of the responses back into the torque, which biases Y / U.  Where what excited the
loop was recorded, R, responses and torques are both related to it, and G = G_yr G_ur^-1 (section 7.2.7).
"""

from __future__ import annotations

from dataclasses import dataclass

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


_FREEDOM = 6
"""Complex degrees of freedom that a window leaves, at least, for its noise, which is pooled with that of
those beside.
"""

_ALIKE = 1e-10
"""Independent part of a force below which it is rounding."""


@dataclass(frozen=True)
class _Window:
    """Which windows tell anything (all windows,), and of each of these (w): FRFs (w, outputs, inputs), the
    variance of their outputs' noise (w, outputs), and what an FRF's variance is of it (w, inputs).
    """

    determined: Mask
    frf: Complex
    noise: Array
    share: Array


def frf_local_polynomial(history: TimeHistory, order: int = 2) -> FrfSet:
    """FRFs with their noise, a line per window; blocks are records of the same thing.

    InputError where there is no force or no response, another number of references than of forces, records
    that are too short, or forces that are alike.
    """
    where, (forces, responses, references) = history_name(history), _signals(history)
    blocks, samples = history.data.shape[:2]
    unknown = (order + 1) * (len(references or forces) + blocks)
    half = int(np.ceil((unknown + _FREEDOM) / blocks / 2))
    count = (samples // 2 - 1) // (2 * half + 1)
    if count < 2:
        expected = f"at least {4 * (2 * half + 1) + 4}"
        raise InputError(where, f"records of {samples} samples", expected, "record for longer")
    data = history.data - history.data.mean(axis=1, keepdims=True)
    spectra = np.fft.rfft(data, axis=1)[:, 1 : 1 + count * (2 * half + 1)]
    spectra = np.moveaxis(spectra.reshape(blocks, count, -1, data.shape[2]), 0, 1)
    found = _estimated(spectra, (forces, responses, references), order, where)
    power = np.sum(np.abs(found.frf) ** 2, axis=2, keepdims=True)
    freedom = 2 * (blocks * (2 * half + 1) - unknown)
    noise = pooled_variance(power, found.noise[:, :, None], freedom)
    rate = history.sample_rate_hz
    frequency = (half + 1 + (2 * half + 1) * np.flatnonzero(found.determined)) * rate / samples
    return FrfSet(
        frequency_hz=frequency,
        frf=found.frf,
        outputs=tuple(history.channels[i] for i in responses),
        inputs=tuple(history.channels[i] for i in forces),
        quantity=quantity_of(history),
        noise=np.sqrt(noise * found.share[:, None] / 2),
        source=history.source,
        sha256=history.sha256,
    )


def _signals(history: TimeHistory) -> tuple[list[int], list[int], list[int]]:
    forces, responses, references = history.forces, history.responses, history.references
    found = f"{len(forces)} forces or torques, {len(responses)} responses and {len(references)} references"
    if not forces or not responses:
        raise InputError(history_name(history), found, "at least one force and one response")
    if references and len(references) != len(forces):
        raise InputError(history_name(history), found, "no references, or one for each force")
    return forces, responses, references


def _estimated(
    spectra: Complex, signals: tuple[list[int], list[int], list[int]], order: int, where: str
) -> _Window:
    """From spectra (windows, blocks, lines, signals); signals: numbers of forces, responses, references."""
    forces, responses, references = signals
    excited = spectra[..., references or forces]
    matrix = _regressors(excited, order)
    scale = np.linalg.norm(matrix, axis=1, keepdims=True)
    q, r = np.linalg.qr(matrix / np.where(scale > 0, scale, 1.0))
    determined = np.min(np.abs(np.diagonal(r, axis1=1, axis2=2)), axis=1) > _ALIKE
    if not determined.any():
        raise InputError(where, "no line at which all forces have power of their own", "forces that differ")
    spectra, matrix, scale, q, r = (one[determined] for one in (spectra, matrix, scale, q, r))
    inputs = excited.shape[-1]
    inverse = np.linalg.inv(r)[:, :inputs] / np.swapaxes(scale[:, :, :inputs], 1, 2)
    spread = inverse @ np.conj(np.swapaxes(inverse, 1, 2))
    seen = spectra.reshape(len(spectra), -1, spectra.shape[-1])
    explained = np.conj(np.swapaxes(q, 1, 2)) @ seen
    rest, gains = seen - q @ explained, np.swapaxes(inverse @ explained, 1, 2)
    frf, rest_of = gains[:, responses], rest[..., responses]
    if references:
        back = np.linalg.inv(gains[:, forces])
        frf = frf @ back
        rest_of = rest_of - rest[..., forces] @ np.swapaxes(frf, 1, 2)
        spread = np.swapaxes(back, 1, 2) @ spread @ np.conj(back)
    freedom = matrix.shape[1] - matrix.shape[2]
    noise = np.sum(np.abs(rest_of) ** 2, axis=1) / freedom
    return _Window(determined, frf, noise, np.real(np.diagonal(spread, axis1=1, axis2=2)))


def _regressors(excited: Complex, order: int) -> Complex:
    """(windows, blocks * lines, unknowns) from spectra (windows, blocks, lines, inputs): those that all
    blocks share, G_0 of each input first, then the transients of each block.
    """
    windows, blocks, lines = excited.shape[:3]
    half = (lines - 1) // 2
    powers = (np.arange(-half, half + 1) / half)[:, None] ** np.arange(order + 1)
    shared = np.einsum("wbli,lp->wblpi", excited, powers).reshape(windows, blocks * lines, -1)
    own = np.kron(np.eye(blocks), powers)
    size = np.sqrt(np.mean(np.abs(excited) ** 2))
    return np.concatenate([shared, np.broadcast_to(size * own, (windows, *own.shape))], axis=2)
