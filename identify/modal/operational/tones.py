"""Harmonics of what turns, found in response records and taken out.

A tone has a steady amplitude where noise through a resonance has a varying one: the kurtosis of its complex
amplitude is 1, that of noise 2 (Jacobsen, Andersen and Brincker, Using enhanced frequency domain
decomposition as a robust technique to harmonic excitation, ISMA 2006).  Where speeds are stated, their
multiples need no such proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from identify.core.arrays import Array, Complex
from identify.modal.operational.records import Records

_SEGMENTS = 16
"""Of the record, at whose resolution tones are looked for."""
_AROUND = 41
"""Lines whose median is what is around a peak."""
_STANDS_OUT, _TOLD_STANDS_OUT, _FOOT = 3.0, 2.0, 1.5
"""Power over what is around of a peak, of one where a tone is stated, and of the foot of a peak."""
_STEADY = 1.5
"""Kurtosis of the complex amplitude below which it is a tone's: it is half a tone's power or more."""
_FEWEST = 24
"""Independent amplitudes that a kurtosis takes."""
_SLIP = 0.005
"""How far from what was stated a tone may be, relative."""


@dataclass(frozen=True)
class Tone:
    """frequency_hz, of its peak; low_hz, high_hz: where it reaches; kurtosis of its complex amplitude; share
    of the power in the band, of all channels of unit RMS; multiple of the stated speed (None: found).
    """

    frequency_hz: float
    low_hz: float
    high_hz: float
    kurtosis: float
    share: float
    multiple: int | None = None
    speed_hz: float = np.nan

    @property
    def width_hz(self) -> float:
        """Of its foot."""
        return self.high_hz - self.low_hz


def tones(records: Records, speeds_hz: Sequence[float]) -> list[Tone]:
    """Tones in the band, by frequency: multiples of the stated speeds, and peaks of steady amplitude."""
    hz, density = _density(records)
    over = density / _median(density)
    lines = np.flatnonzero((hz >= records.band_hz[0]) & (hz <= records.band_hz[1]))
    told = [
        (k, speed)
        for speed in speeds_hz
        for k in range(1, int(records.band_hz[1] / speed) + 1)
        if k * speed >= records.band_hz[0]
    ]
    found: list[Tone] = []
    for k, speed in told:
        near = lines[np.abs(hz[lines] - k * speed) <= max(_SLIP * k * speed, 1.5 * hz[1])]
        if len(near) and np.max(over[near]) > _TOLD_STANDS_OUT:
            peak = int(near[np.argmax(over[near])])
            found.append(replace(_tone(records, hz, over, peak), multiple=k, speed_hz=speed))
    for peak in lines[np.argsort(-over[lines])]:
        if over[peak] < _STANDS_OUT:
            break
        if over[peak] < np.max(over[max(peak - 1, 0) : peak + 2]) or any(
            tone.low_hz <= hz[peak] <= tone.high_hz for tone in found
        ):
            continue
        tone = _tone(records, hz, over, int(peak))
        if tone.kurtosis < _STEADY:
            found.append(tone)
    return sorted(found, key=lambda tone: tone.frequency_hz)


def without(records: Records, found: Sequence[Tone]) -> Records:
    """The records with every tone brought down to the level beside it, channel by channel."""
    return replace(records, takes=tuple(_levelled(take, records.rate_hz, found) for take in records.takes))


def _levelled(take: Array, rate_hz: float, found: Sequence[Tone]) -> Array:
    spectrum, spacing = np.fft.rfft(take, axis=0), rate_hz / len(take)
    for tone in found:
        low, high = int(tone.low_hz / spacing), int(tone.high_hz / spacing) + 1
        reach = high - low
        sides = [slice(max(low - reach, 1), low), slice(high, min(high + reach, len(spectrum)))]
        beside = np.sqrt(np.mean([np.mean(np.abs(spectrum[side]) ** 2, axis=0) for side in sides], axis=0))
        size = np.abs(spectrum[low:high])
        spectrum[low:high] *= np.minimum(1.0, beside / np.maximum(size, np.finfo(float).tiny))
    return np.asarray(np.fft.irfft(spectrum, len(take), axis=0))


def _density(records: Records) -> tuple[Array, Array]:
    """Frequencies and power density of all channels of unit RMS together."""
    length = int(max(len(take) for take in records.takes) / _SEGMENTS * 2)
    total, weight = 0.0, 0
    for take in records.takes:
        hz, density = scipy.signal.welch(
            take / records.size, records.rate_hz, nperseg=min(length, len(take)), nfft=length, axis=0
        )
        total, weight = total + density.sum(axis=1) * len(take), weight + len(take)
    return hz, np.asarray(total / weight)


def _median(density: Array) -> Array:
    reach = min(_AROUND, len(density) // 4 * 2 + 1)
    return np.asarray(scipy.ndimage.median_filter(density, reach, mode="nearest") + np.finfo(float).tiny)


def _tone(records: Records, hz: Array, over: Array, peak: int) -> Tone:
    low, high = peak, peak
    while low > 1 and over[low - 1] > _FOOT and peak - low < _AROUND // 2:
        low -= 1
    while high < len(hz) - 2 and over[high + 1] > _FOOT and high - peak < _AROUND // 2:
        high += 1
    spacing = hz[1]
    edges = float(hz[low] - spacing), float(hz[high] + spacing)
    kurtosis, share = _kurtosis(records, *edges)
    return Tone(float(hz[peak]), *edges, kurtosis, share)


def _kurtosis(records: Records, low_hz: float, high_hz: float) -> tuple[float, float]:
    """Of the complex amplitude of the strongest pattern of channels between two frequencies, and the share of
    all power there.
    """
    parts, power, whole = [], 0.0, 0.0
    reach = max(0.0, _FEWEST / records.seconds - (high_hz - low_hz)) / 2
    for take in records.takes:
        spectrum, spacing = np.fft.rfft(take / records.size, axis=0), records.rate_hz / len(take)
        lines = slice(max(1, int((low_hz - reach) / spacing)), int((high_hz + reach) / spacing) + 1)
        parts.append(np.fft.ifft(spectrum[lines], axis=0) * len(spectrum[lines]) / len(take))
        power += float(np.sum(np.abs(spectrum[lines]) ** 2)) / len(take)
        whole += float(np.sum(np.abs(spectrum) ** 2)) / len(take)
    amplitude = _strongest(np.concatenate(parts))
    square = np.abs(amplitude) ** 2
    return float(np.mean(square**2) / np.mean(square) ** 2), power / whole


def _strongest(values: Complex) -> Complex:
    """Of values (samples, channels) their leading combination."""
    left, size, _ = np.linalg.svd(values, full_matrices=False)
    return np.asarray(left[:, 0] * size[0])
