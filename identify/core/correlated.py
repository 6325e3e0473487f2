"""Residuals of a motion are correlated over time: how many samples they are worth, and how sure a difference
or a value is.

All arrays are (samples, joints) with a mask of the samples that count; samples left out count as a gap in
time.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy

from identify.core.arrays import Array, Mask

_BLOCKS, _DRAWS = 20, 2000
_SLOWEST = 0.1
"""Share of the samples, those at least speed, by which noise is separated from waves over an angle."""
_STRIDES = 8
"""Steps that are tried, up to 128 samples."""
_ROUNDING = 1e-12
"""Share of a signal below which a difference is rounding."""
_PART = 0.03
"""Part of a signal's own size from which on third differences over several samples are those of the signal.
"""
_FLAT = 1.0
"""Power of the step by which third differences of noise grow at the most: those of a random walk by a half,
those of a signal that is smooth where they are looked at by three.
"""

_FIRST = 2
"""Octaves begin at this power of two of half waves in the record."""


def correlation_time(residual: Array, used: Mask, *, centred: bool = True) -> float:
    """Samples (at least 1) that one independent sample is worth, of one joint's residual (samples,): 1 + 2
    sum of autocorrelations; centred: about its mean, which otherwise is an error like any other.

    The sum ends at the first negative pair of neighbouring lags (initial positive sequence, Geyer 1992).
    """
    if used.sum() < 4:
        return 1.0
    x = np.where(used, residual - (residual[used].mean() if centred else 0.0), 0.0)
    padded = np.fft.rfft(x, 2 * len(x))
    correlation = np.fft.irfft(np.abs(padded) ** 2)[: len(x)]
    if correlation[0] <= 0:
        return 1.0
    correlation /= correlation[0]
    pairs = correlation[1 : 2 * ((len(x) - 1) // 2) + 1].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs < 0)
    last = negative[0] if len(negative) else len(pairs)
    return max(1.0, 1.0 + 2.0 * float(pairs[:last].sum()))


def effective_samples(residual: Array, used: Mask, *, centred: bool = True) -> float:
    """Number of independent samples that one joint's residual (samples,) is worth; centred as above."""
    return float(used.sum()) / correlation_time(residual, used, centred=centred)


def mean_above_zero(values: Array) -> float:
    """Chance that values (n,), correlated over time, have a mean above zero by luck: a bootstrap of
    contiguous blocks.

    Half a block counts for no gain at all, so that few blocks never give certainty.
    """
    if len(values) < 2 * _BLOCKS:
        return 1.0
    sizes = len(values) // _BLOCKS + (np.arange(_BLOCKS) < len(values) % _BLOCKS)
    means = np.add.reduceat(values, np.cumsum(sizes) - sizes) / sizes
    return float((np.count_nonzero(_drawn() @ means <= 0) + 0.5) / (_DRAWS + 1))


@cache
def _drawn() -> Array:
    """(draws, blocks): how often each block is drawn."""
    drawn = np.random.default_rng(0).integers(0, _BLOCKS, (_DRAWS, _BLOCKS))
    return np.array([np.bincount(row, minlength=_BLOCKS) for row in drawn], dtype=float)


def log_likelihood_gain(before: Array, after: Array, used: Mask) -> tuple[float, Array]:
    """Gain in log likelihood from one residual of a joint (samples,) to another, where its spectrum is not
    known; and where it is.

    The second is (samples,): the fall of the square in the range of frequencies that counts, over its sum
    before, zero where samples do not count.

    Whittle's likelihood with a level of its own for every octave: half the number of samples in an octave
    times ln of the ratio of powers. A slow residual lives in the few samples of the low octaves, whatever the
    sample rate; the lowest of them, of one, one and two samples, are taken together, because a level found
    from one sample would hide any constant.  Counted below or above the frequency that makes it largest,
    because an effect is slow or fast, less the price of that choice, ln of the number of choices.  By the
    cosine transform, which has no jump at the ends; samples that do not count are bridged by straight lines
    and lower the number, but for those before the first and after the last that counts, which are not there.
    """
    first_used, last_used = np.flatnonzero(used)[[0, -1]]
    if last_used - first_used + 1 < len(used):
        inside, fall = slice(first_used, last_used + 1), np.zeros(len(used))
        gain, fall[inside] = log_likelihood_gain(before[inside], after[inside], used[inside])
        return gain, fall
    waves = [scipy.fft.dct(_bridged(residual, used), norm="ortho") for residual in (before, after)]
    powers = [wave**2 for wave in waves]
    octaves = 2 ** np.arange(_FIRST, max(int(np.log2(len(before))) + 1, _FIRST + 1))
    edges = [0, *octaves[octaves < len(before)].tolist(), len(before)]
    counts = np.diff(edges)
    old, new = (np.add.reduceat(power, edges[:-1]) for power in powers)
    floor = max(1e-12 * float(old.sum()), 1e-300)
    gains = (_beyond_leakage(old, counts) * counts / 2 * np.log((old + floor) / (new + floor))).tolist()
    ends = len(gains)
    runs = {(0, ends): sum(gains)}
    for split in range(1, ends):
        runs |= {(0, split): sum(gains[:split]), (split, ends): sum(gains[split:])}
    first, last = (edges[end] for end in max(runs, key=lambda run: runs[run]))
    inside = (np.arange(len(before)) >= first) & (np.arange(len(before)) < last)
    parts = [
        np.where(used, scipy.fft.idct(np.where(inside, wave, 0.0), norm="ortho"), 0.0) ** 2 for wave in waves
    ]
    fall = (parts[0] - parts[1]) / max(float(parts[0].sum()), 1e-300)
    return float(max(runs.values()) * used.mean() - np.log(len(runs))), fall


def _beyond_leakage(powers: Array, counts: Array) -> Mask:
    """Which octaves, of so many lines each, hold more than the cosine transform of a record of finite length
    may spread upwards out of lower ones: past a kink, as at its ends, by the fourth power of frequency.

    A sensor behind a filter leaves nothing in the upper octaves, which have most of the samples: what is
    found there is this, and says no more than the octaves that it comes from.
    """
    level, found = 0.0, np.ones(len(powers), dtype=bool)
    for octave, density in enumerate(powers / counts):
        found[octave] = density >= level
        level = max(level, density) / 16
    return found


def _bridged(residual: Array, used: Mask) -> Array:
    samples = np.arange(len(residual))
    return np.interp(samples, samples[used], residual[used])


def column_sizes(columns: Array) -> Array:
    """(p,): Euclidean lengths of columns (n, p), 1 of one that is nothing."""
    size = np.sqrt((columns**2).sum(axis=0))
    return np.where(size > 0, size, 1.0)


def covariance(
    jacobian: Array,
    residual: Array,
    used: Mask,
    expected: Array | None = None,
    instruments: Array | None = None,
) -> tuple[Array, float]:
    """Covariance (p, p) of least-squares values whose residuals are correlated in time, and its degrees of
    freedom.

    jacobian (samples, joints, p) and residual (samples, joints), both weighted.  Newey and West (1987) with a
    window of eight correlation times; as many degrees of freedom as independent windows (fixed-b, Kiefer and
    Vogelsang 2005, in its simplest form).  expected (p,): one over the standard deviation that values have
    before the data speak; what they were expected to be has erred by as much.  instruments (samples, joints,
    p), weighted: what residuals were made orthogonal to, where that is not the jacobian (White 1982).
    """
    probes = jacobian if instruments is None else instruments
    scores = np.einsum("naj,na->nj", np.where(used[:, :, None], probes, 0.0), np.where(used, residual, 0.0))
    flat, probed = jacobian[used], probes[used]
    scale, own = column_sizes(flat), column_sizes(probed)
    prior = np.zeros(len(scale)) if expected is None else expected / scale
    bread = np.linalg.pinv((probed / own).T @ (flat / scale) + np.diag(prior**2), rcond=1e-10)
    spans = [
        correlation_time(residual[:, joint], used[:, joint])
        for joint in range(residual.shape[1])
        if used[:, joint].any()
    ]
    window = int(np.clip(np.ceil(8 * max(spans, default=1.0)), 1, max(1, len(scores) // 6)))
    padded = np.concatenate(
        [np.zeros((window, scores.shape[1])), scores / own, np.zeros((window - 1, scores.shape[1]))]
    )
    sums = np.cumsum(padded, axis=0)
    windows = sums[window:] - sums[:-window]
    meat = windows.T @ windows / window + np.diag(prior**2)
    samples = float(used.any(axis=1).sum())
    freedom = max(3.0, samples / window)
    return bread @ meat @ bread.T / np.outer(scale, scale), freedom


def white_level(signal: Array, used: Mask, speed: Array | None = None) -> float:
    """Standard deviation of what changes from sample to sample in a joint's signal (samples,): its noise, by
    third differences (MAD); NaN where noise cannot be separated from the signal.

    Behind a filter, or between two counts of an encoder, hardly anything changes from one sample to the next:
    third differences over every second, fourth, ... sample then grow until they are those of independent
    samples, where they stay until the signal itself passes so fast.  So the noise is that of the first step
    from which they hardly grow; of a smooth signal alone they grow by the third power of the step.

    speed (samples,): of the joint; only the slowest tenth of the samples is then looked at, because waves
    over an angle pass from sample to sample as fast as the joint moves, and a fast record would look noisier
    than a slow one of the same robot.
    """
    steps = 2 ** np.arange(_STRIDES)
    levels = [_third(signal, used, speed, int(step)) for step in steps if 3 * step < len(signal)]
    known = np.array([level for level in levels if np.isfinite(level)])
    if len(known) < 2:
        return float(known[0]) if len(known) else float("nan")
    rounding, most = _ROUNDING * float(np.abs(signal[used]).max()), _PART * float(signal[used].std())
    grown = np.log2(np.maximum(known[1:], 1e-300) / np.maximum(known[:-1], 1e-300))
    grown = np.where(
        (known[:-1] > rounding) & ((known[:-1] < most) | (steps[: len(grown)] == 1)), grown, np.inf
    )
    return float(known[np.argmax(grown <= _FLAT)]) if (grown <= _FLAT).any() else float("nan")


def _third(signal: Array, used: Mask, speed: Array | None, step: int) -> float:
    """Size of third differences over so many samples, as of one sample of white noise."""
    rows = [slice(n * step, len(signal) - (3 - n) * step) for n in range(4)]
    signs = (-1.0, 3.0, -3.0, 1.0)
    third = sum(sign * signal[row] for sign, row in zip(signs, rows, strict=True))
    good = used[rows[0]] & used[rows[1]] & used[rows[2]] & used[rows[3]]
    if not good.any():
        return float("nan")
    if speed is not None:
        windows = np.lib.stride_tricks.sliding_window_view(np.abs(speed), 3 * step + 1)
        fastest = windows.max(axis=1)
        good = good & (fastest <= np.quantile(fastest[good], _SLOWEST))
    return float(np.median(np.abs(np.asarray(third)[good])) / 0.6745 / np.sqrt(20.0))
