"""Noise of FRFs by the scatter between neighbouring lines, where nothing else that is sure tells it.

In a short window of lines all FRFs of a set are rational functions with one denominator, whatever the
structure: A(r) H_p(r) = B_p(r), with r a line's distance from the window's centre, A of the order of the
poles nearby and common to all, and B_p of an order that compensates for all others (the local rational
method: McKelvey and Guerin, Estimation of frequency response functions by local rational models, SYSID 2012).
What is left of its linear least squares is noise, and of a window that does not follow a sharp resonance more
than that; so several windows are tried around each line, and the one that leaves least is taken. An
exponential window makes the noise of neighbouring lines alike by a known correlation, of which the residuals
keep a known part.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.core.latest import LatestLike
from identify.measured.frf_set import FrfSet

_WINDOWS = ((3, 3, 1), (4, 4, 1), (4, 4, 2), (5, 5, 2))
"""Lines to either side, order of the numerators, and poles."""
_LINES = 2 * max(half for half, _, _ in _WINDOWS) + 1
_ROUNDS, _FINEST, _RIDGE, _TINY = 2, 1e-9, 1e-14, 1e-200
"""FRFs weigh by their levels first, then by their noise, so that a channel of noise alone bends no
denominator; noise is no finer than this part of the level."""
_seen = LatestLike[Array](12)
"""A run asks for noise, dead channels and checks of the same FRFs."""
FREEDOM = 2
"""Degrees of freedom of a line's estimate: those of one line, since the windows of neighbours overlap."""


def scatter(frf_set: FrfSet) -> Array | None:
    """Variance (lines, outputs, inputs) of the complex FRFs, NaN where not measured; None of too few lines,
    or where they are not evenly spaced.
    """
    steps = np.diff(frf_set.frequency_hz)
    measured = np.asarray(~np.isnan(frf_set.frf).any(axis=0))
    if len(steps) < _LINES - 1 or np.ptp(steps) > 1e-3 * steps.min() or not measured.any():
        return None
    decay = frf_set.window_decay_per_s / float(steps.min())
    return _seen.of((frf_set.frf, decay), lambda: _scatter(frf_set.frf, measured, decay)).copy()


def _scatter(frf: Complex, measured: Mask, decay: float) -> Array:
    """The same of FRFs, some of which were measured (outputs, inputs), at evenly spaced lines; decay: of the
    window from line to line.
    """
    values = frf[:, measured]
    level = np.sqrt(np.mean(np.abs(values) ** 2, axis=0))
    outputs, inputs = np.nonzero(measured)
    parted = inputs if np.ptp(inputs) else outputs - outputs[0]  # impacts of several inputs share no noise
    half = parted % 2 == parted[0] % 2
    weighed, found = level, np.zeros(values.shape)
    for _ in range(_ROUNDS):
        found = _least(values / np.where(weighed > 0, weighed, 1.0), half, decay) * weighed**2
        weighed = np.maximum(np.sqrt(np.median(found, axis=0)), _FINEST * level)
    variance = np.full(frf.shape, np.nan)
    variance[:, measured] = found
    return variance


def _least(values: Complex, half: Mask, decay: float) -> Array:
    """(lines, FRFs): variance by the windows around each line that leave least.

    Denominators of half of the FRFs, and which window is best, come from the other half, so that nothing is
    fitted to the noise that is measured; where half is all, they are their own.
    """
    halves = ((half, ~half), (~half, half)) if not half.all() else ((half, half),)
    projected = [_projected(values, *window) for window in _WINDOWS]
    found = np.zeros(values.shape)
    for own, others in halves:
        tried = np.array(
            [
                _tried(one, len(values), others, window, decay)
                for one, window in zip(projected, _WINDOWS, strict=True)
            ]
        )
        size = np.mean(np.log(tried[:, :, others] + _FINEST**2), axis=2)
        found[:, own] = tried[np.argmin(size, axis=0), np.arange(len(values))][:, own]
    return found


def _powers(half: int, poles: int) -> Array:
    """(lines of a window, poles + 1): powers of the distance from its centre."""
    return np.asarray((np.arange(-half, half + 1) / half)[:, None] ** np.arange(poles + 1))


def _projected(values: Complex, half: int, order: int, poles: int) -> Complex:
    """(windows, rest, FRFs, poles + 1): what numerators leave of FRFs times each power."""
    lines = np.lib.stride_tricks.sliding_window_view(values, 2 * half + 1, axis=0)
    return np.asarray(
        np.einsum("lr,lk,npl->nrpk", _beside(half, order), _powers(half, poles), lines, optimize=True)
    )


def _tried(projected: Complex, count: int, chosen: Mask, window: tuple[int, int, int], decay: float) -> Array:
    """(count of lines, FRFs): variance by windows of one kind, `projected`, with denominators of the chosen
    FRFs, at the ends of the band that of the last whole one.
    """
    half, order, poles = window
    rest, powers = _beside(half, order), _powers(half, poles)
    used = projected[:, :, chosen].reshape(len(projected), -1, poles + 1)
    gram = used.conj().swapaxes(1, 2) @ used
    ridge = _RIDGE * np.trace(gram, axis1=1, axis2=2).real[:, None, None] * np.eye(poles) + _TINY
    solved = np.linalg.solve(gram[:, 1:, 1:] + ridge, -gram[:, 1:, :1])
    whole = np.concatenate([np.ones((len(projected), 1, 1)), solved], axis=1)
    left = np.sum(np.abs(projected @ whole[:, None]) ** 2, axis=(1, 3))
    left /= _kept_of_noise(rest, (powers @ whole)[..., 0], decay)[:, None]
    if chosen.all():
        left *= rest.shape[1] / (rest.shape[1] - poles)
    return np.asarray(left[np.clip(np.arange(count) - half, 0, len(left) - 1)])


def _kept_of_noise(rest: Array, denominators: Complex, decay: float) -> Array:
    """(windows,): energy that residuals have, per variance of the noise, behind denominators (windows,
    lines); decay of the exponential window that shaped it, over the spacing of lines.
    """
    apart = np.subtract.outer(np.arange(len(rest)), np.arange(len(rest)))
    alike = 1 / (1 - 1j * np.pi * apart / decay) if decay > 0 else np.eye(len(rest))
    shaped = (rest @ rest.T * alike.T)[None] * denominators[:, :, None] * denominators.conj()[:, None]
    return np.asarray(np.sum(shaped, axis=(1, 2)).real)


@cache
def _beside(half: int, order: int) -> Array:
    """(lines, rest): orthonormal rest of a window that the numerators leave."""
    powers = np.vander(np.arange(-half, half + 1) / half, order + 1)
    return np.asarray(np.linalg.svd(powers)[0][:, order + 1 :])
