"""Channels whose noise stands out from that of the others, told apart from those that only hardly move.

Coherence alone cannot tell them apart: it is low at every point that stands still.  Noise can.  Of a pair
with coherence g2 the part of |H|^2 that the force does not explain is w = |H|^2 (1 - g2) / g2.  Sensors of
one test have noise of their own, alike in all of them, and what bad impacts and noise of the force add in
proportion to their motion: w = a + b |H|^2, with a of a line and force, b of a force.  Both are medians over
the channels, so a few bad ones do not move them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identify.core.arrays import Array
from identify.core.text import capital, count
from identify.measured.finding import Finding
from identify.measured.frf_set import FrfSet
from identify.measured.rounded import remark

LOW_COHERENCE = 0.8
"""Below it half of an FRF's lines count as badly measured (a common rule in modal testing)."""
_MOSTLY_NOISE = 0.5
"""Coherence below which noise has more power than what the force explains."""
_STANDS_OUT = 10.0
"""Power of a channel's noise over that of its neighbours, 10 dB, from which on it is named."""
_TINY = 1e-12


def coherence(frf_set: FrfSet) -> Iterator[Finding]:
    """What is missing to know the noise, and a set that is mostly noise."""
    if frf_set.coherence is None:
        if frf_set.noise is not None:
            return
        yield Finding(
            "warn",
            "no-coherence",
            (),
            "There is no coherence: the noise can only come from repeated measurements.",
        )
        return
    if frf_set.averages is None:
        sentence = (
            "The number of averages is not known, so the coherence does not give the noise: say averages."
        )
        yield Finding("warn", "no-averages", (), sentence)
    if said := remark(frf_set.coherence):
        yield Finding("warn", "rounded-coherence", (), f"{capital(said)}.")
    overall = float(_median(frf_set.coherence, (0, 1, 2)))
    if overall < _MOSTLY_NOISE:
        sentence = f"The median coherence of all FRFs is {overall:.2f}: the measurement is mostly noise."
        yield Finding("fail", "coherence", (), sentence, overall)


def noisy_channels(frf_set: FrfSet) -> Iterator[Finding]:
    """Channels with more than 10 dB more noise than the others have, the worst first."""
    if frf_set.coherence is None or len(frf_set.outputs) < 3:
        return
    excess = noise_excess(frf_set)
    worst = excess.max(axis=1)
    for i in sorted(np.flatnonzero(worst > _STANDS_OUT).tolist(), key=lambda i: -worst[i]):
        bad = excess[i] > _STANDS_OUT
        forces = [frf_set.inputs[j] for j in np.flatnonzero(bad & frf_set.measured[i])]
        alone = "" if len(forces) == frf_set.measured[i].sum() else f" under {', '.join(map(str, forces))}"
        sentence = (
            f"{frf_set.outputs[i]} is {np.sqrt(worst[i]):.2g} times as noisy{alone} as channels that move as"
            " much: look for its cable, a loose sensor or overload."
        )
        yield Finding("warn", "noisy-channel", (frf_set.outputs[i],), sentence, float(np.sqrt(worst[i])))


def noise_excess(frf_set: FrfSet) -> Array:
    """(outputs, inputs): power of the noise over what is usual at that motion, the median over the lines; 0
    of what was not measured.
    """
    assert frf_set.coherence is not None
    energy, ratio = np.abs(frf_set.frf) ** 2, _unexplained(frf_set.coherence)
    own = _median(energy * ratio, (1,))[:, None]
    usual = own + _of_the_force(energy, ratio) * energy
    with np.errstate(invalid="ignore", divide="ignore"):
        found = _median(energy * ratio / usual, (0,))
    return np.asarray(np.nan_to_num(found, nan=0.0, posinf=0.0))


def poor_forces(frf_set: FrfSet) -> Iterator[Finding]:
    """Forces under which even the channels that move most have a low coherence."""
    if frf_set.coherence is None:
        return
    energy, ratio = np.abs(frf_set.frf) ** 2, _unexplained(frf_set.coherence)
    coherence = 1 / (1 + np.ravel(_of_the_force(energy, ratio)))
    for force, value in zip(frf_set.inputs, coherence.tolist(), strict=True):
        if value < LOW_COHERENCE:
            sentence = (
                f"Under {force} even the channels that move most have a median coherence of {value:.2f}:"
                " look for double hits, overload or nonlinearity."
            )
            yield Finding("warn", "coherence", (force,), sentence, value)


def quiet_channels(frf_set: FrfSet) -> Iterator[Finding]:
    """How many channels have a low coherence only because they hardly move."""
    if frf_set.coherence is None:
        return
    usual = np.ones(len(frf_set.outputs), bool)
    if len(frf_set.outputs) > 2:
        usual = noise_excess(frf_set).max(axis=1) <= _STANDS_OUT
    median = _median(frf_set.coherence, (0, 2))
    low = np.flatnonzero((median < LOW_COHERENCE) & usual)
    if len(low):
        channels = tuple(frf_set.outputs[i] for i in low)
        sentence = (
            f"{len(low)} of {count(len(frf_set.outputs), 'channel')} with a low coherence (lowest median"
            f" {median[low].min():.2f}) have no more noise than the others: little moves there, which is no"
            " fault."
        )
        yield Finding("info", "coherence", channels, sentence, float(median[low].min()))


def _unexplained(coherence: Array) -> Array:
    """(1 - g2) / g2, finite."""
    return np.asarray((1 - coherence) / np.maximum(coherence, _TINY))


def _of_the_force(energy: Array, ratio: Array) -> Array:
    """(1, 1, inputs): share of |H|^2 that is noise in the half of the channels that move most."""
    most = energy >= _median(energy, (1,))[:, None]
    return _median(np.where(most, ratio, np.nan), (0, 1))[None, None]


def _median(values: Array, axes: tuple[int, ...]) -> Array:
    """Of what is known; NaN where nothing is."""
    known = np.isfinite(values)
    filled = np.where(known.any(axis=axes, keepdims=True), values, 0.0)
    found = np.nanmedian(filled, axis=axes)
    return np.asarray(np.where(known.any(axis=axes), found, np.nan), dtype=np.float64)
