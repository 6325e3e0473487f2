"""Response records as the analysis takes them: of a file, in a band, at the rate that the band needs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.time_history import TimeHistory
from identify.measured.units import parse_signal_unit

_RATE = 2.5
"""Samples per period of the highest frequency of the band that are kept."""
_SLOW = 0.2, 0.8
"""Of the lowest frequency of the band: below the first all is taken out, above the second nothing."""
_WIDEST = 100.0
"""Highest over lowest frequency of a band that was not stated."""
_TOLD = 0.2
"""Relative standard deviation of a damping ratio that counts as determined."""
_POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True)
class Records:
    """Responses (samples,) of several channels at once, in one or more takes.

    takes: each (samples, channels), SI, means removed; power (channels,): of s, of what was measured over a
    displacement; band_hz: of the analysis.
    """

    rate_hz: float
    takes: tuple[Array, ...]
    channels: tuple[Channel, ...]
    units: tuple[str, ...]
    power: Array
    band_hz: tuple[float, float]
    source: str = ""
    sha256: str = ""

    @property
    def seconds(self) -> float:
        """Of all takes together."""
        return sum(len(take) for take in self.takes) / self.rate_hz

    @property
    def size(self) -> Array:
        """RMS of every channel over all takes, (channels,)."""
        power = sum(np.sum(take**2, axis=0) for take in self.takes)
        return np.asarray(np.sqrt(power / sum(len(take) for take in self.takes)))


def records_of(
    history: TimeHistory, band_hz: tuple[float, float] | None, least_damping: float
) -> tuple[Records, tuple[str, ...]]:
    """The responses of a time history, with sentences on what was left out.

    band_hz: by default as much as the sample rate and the length allow; least_damping: the smallest damping
    ratio that is to be estimated.  InputError for fewer than two responses, a response that does not move, a
    band beyond the samples, and a record too short for that damping at the lowest frequency.
    """
    where, chosen = history.source or "records", history.responses
    if len(chosen) < 2:
        raise InputError(
            where,
            f"{len(chosen)} response record{'s' * (len(chosen) != 1)}",
            "two or more, recorded at once: shapes come from their ratios",
        )
    band, notes = _band(history, band_hz, least_damping)
    if history.forces:
        names = ", ".join(str(history.channels[i]) for i in history.forces)
        notes.append(f"{where}: the force {names} was left out; its FRFs would also give modal masses")
    units = [parse_signal_unit(history.units[i], where) for i in chosen]
    takes = [_moving(take[:, chosen], [history.channels[i] for i in chosen], where) for take in history.data]
    whole = Records(
        rate_hz=history.sample_rate_hz,
        takes=tuple(takes),
        channels=tuple(history.channels[i] for i in chosen),
        units=tuple(history.units[i] for i in chosen),
        power=np.array([_POWER[unit.kind] for unit in units]),
        band_hz=band,
        source=history.source,
        sha256=history.sha256,
    )
    return _slowed(_without_drift(whole)), tuple(notes)


def _moving(take: Array, channels: list[Channel], where: str) -> Array:
    centred = take - np.mean(take, axis=0)
    still = np.max(np.abs(centred), axis=0) <= 1e-12 * np.max(np.abs(take), axis=0)
    if still.any():
        name = channels[int(np.argmax(still))]
        fix = "leave it out, or look at its sensor"
        raise InputError(
            f"{where}, channel {name}", "a signal that stays the same throughout", "one that moves", fix
        )
    return np.asarray(centred)


def _band(
    history: TimeHistory, asked: tuple[float, float] | None, least_damping: float
) -> tuple[tuple[float, float], list[str]]:
    """The band of the analysis, and what is to be said of it."""
    where = history.source or "records"
    highest = history.sample_rate_hz / _RATE
    seconds = history.data.shape[0] * history.data.shape[1] / history.sample_rate_hz
    # A damped oscillation driven by noise tells its decay to 1 / sqrt(decay x time) (Whittle's likelihood).
    enough = 1 / (2 * np.pi * least_damping * _TOLD**2 * seconds)
    if asked is None:
        low = max(highest / _WIDEST, enough)
        if low >= highest / 2:
            raise _too_short(where, seconds, least_damping, highest / 2)
        said = (
            f"below {low:.4g} Hz a record of {seconds:.4g} s is too short for damping ratios of"
            f" {least_damping:.3g}: with `--band` or a larger `--damping` more is analysed"
        )
        return (low, highest), [f"{where}: {said}"] if low == enough else []
    low, high = asked
    if high > highest:
        found = f"a band up to {high:g} Hz of records with {history.sample_rate_hz:g} samples a second"
        raise InputError("band_hz", found, f"at most {highest:g} Hz")
    if low < enough:
        raise _too_short(where, seconds, least_damping, low)
    return (low, high), []


def _too_short(where: str, seconds: float, damping: float, low: float) -> InputError:
    needed = 1 / (2 * np.pi * damping * _TOLD**2 * max(low, 1e-9))
    return InputError(
        where,
        f"a record of {seconds:.4g} s for a damping ratio of {damping:.3g} at {low:.4g} Hz",
        f"{needed:.3g} s or more, for an accuracy of {_TOLD:.0%}",
        "record longer, begin the band (`--band`) higher, or ask for a larger `--damping`",
    )


def _without_drift(records: Records) -> Records:
    """The records without what is slow, which velocities and displacements are full of."""
    low, takes = records.band_hz[0], []
    for take in records.takes:
        hz = np.fft.rfftfreq(len(take), 1 / records.rate_hz)
        rise = np.clip((hz / low - _SLOW[0]) / (_SLOW[1] - _SLOW[0]), 0.0, 1.0)
        gain = np.sin(np.pi / 2 * rise) ** 2
        takes.append(np.fft.irfft(np.fft.rfft(take, axis=0) * gain[:, None], len(take), axis=0))
    return replace(records, takes=tuple(takes))


def _slowed(records: Records) -> Records:
    """The records at the lowest rate that the band allows."""
    factor = int(records.rate_hz / (_RATE * records.band_hz[1]))
    if factor < 2:
        return records
    taps = scipy.signal.firwin(20 * factor + 1, 1 / factor, window="hamming")
    takes = tuple(scipy.signal.resample_poly(take, 1, factor, axis=0, window=taps) for take in records.takes)
    return replace(records, takes=takes, rate_hz=records.rate_hz / factor)
