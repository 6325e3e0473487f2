"""From a record to a motion: resampled, differentiated behind a low-pass, and said so.

Speed and acceleration come from the recorded speed where there is one, else from the position, by central
differences of which only the cosines up to `lowpass_hz` are kept, made as large as derivatives are.
Positions and torques are not filtered, so that what is explained is what was measured.

Cosines, because they are orthogonal: what a column P x made of them explains of a signal y by least squares,
<P x, y> / <P x, P x>, is what P x explains of P y, wherever P cuts.  A filter H that falls gradually is no
projection; where it has fallen to a half, <H x, y> / <H x, H x> is twice what it should be, so that a
resonance near `lowpass_hz` would look twice as soft.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from identify.core.arrays import Array, Mask
from identify.core.errors import InputError
from identify.measured.records import MotionRecord
from identify.measured.time_history import evenly_sampled

_ORDER = 4


@dataclass(frozen=True)
class ConditionedMotion:
    """A conditioned record, arrays (samples, joints), SI; inside: samples (samples,) that the ends of the
    filter do not reach.

    link_position and command_position are None where they were not recorded; said: what was done to the
    record, in sentences.
    """

    name: str
    sample_rate_hz: float
    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    link_position: Array | None
    command_position: Array | None
    inside: Mask
    said: tuple[str, ...]
    starts: tuple[int, ...] = (0,)
    """First sample of each record, where there are several in a row."""
    names: tuple[str, ...] = ()
    """Of the several records."""
    lowpass_hz: float = np.inf
    """Up to which speed and acceleration are known."""
    turning: Array | None = None
    """Speed behind a filter that falls gradually, which rings less where a joint stops: for its direction,
    and whether it moves at all.
    """
    link_velocity: Array | None = None
    link_acceleration: Array | None = None


def condition(
    record: MotionRecord,
    lowpass_hz: float,
    resample_hz: float | None = None,
    torque_constant: Array | None = None,
) -> ConditionedMotion:
    """The motion of a record; torque_constant (joints,), N m/A, turns a motor current into a torque.

    InputError where the low-pass is not below half the sample rate, the record is too short for it, or
    neither torque nor current with its constant is there.
    """
    said = []
    time_s, signals, rate = record.time_s, dict(record.signals), record.sample_rate_hz
    _check_length(record.name, len(time_s), rate, lowpass_hz)
    gaps = np.zeros((0, 2))
    if resample_hz is not None:
        if not evenly_sampled(time_s):
            gaps, sentence = _jitter(time_s, lowpass_hz)
            said.append(sentence)
            record = _evened(record)
        time_s, signals = _resampled(record, resample_hz)
        said.append(
            f"resampled from {rate:.6g} to {resample_hz:g} Hz by cubic splines{_guard(rate, resample_hz)}"
        )
        rate = resample_hz
        _check_length(record.name, len(time_s), rate, lowpass_hz)
    if not 0 < lowpass_hz < rate / 2:
        raise InputError(
            "lowpass_hz",
            f"{lowpass_hz:g} Hz at {rate:g} samples a second",
            f"a frequency below {rate / 2:g} Hz",
        )
    position = record.signal("motor_position") if resample_hz is None else signals["motor_position"]
    said.append(_origin("motor_velocity" in signals, lowpass_hz))
    velocity, acceleration = moved(position, signals.get("motor_velocity"), lowpass_hz, rate)
    link = signals.get("link_position")
    of_link: tuple[Array | None, Array | None] = (None, None)
    if link is not None:
        of_link = moved(link, signals.get("link_velocity"), lowpass_hz, rate)
    reach = int(np.ceil(rate / lowpass_hz))
    said.append(f"{reach / rate:.3g} s at either end left out, where the filter has no past or future")
    return ConditionedMotion(
        record.name,
        rate,
        time_s,
        position,
        velocity,
        acceleration,
        _torque(record, signals, torque_constant),
        link,
        signals.get("command_position"),
        _inside(time_s, reach, rate, gaps),
        tuple(said),
        lowpass_hz=lowpass_hz,
        turning=_lowpass(_speed(position, signals.get("motor_velocity"), rate), lowpass_hz, rate),
        link_velocity=of_link[0],
        link_acceleration=of_link[1],
    )


def moved(position: Array, measured: Array | None, lowpass_hz: float, rate: float) -> tuple[Array, Array]:
    """Speeds and accelerations (samples, joints) up to the low-pass, of recorded speeds if there are any;
    joints without a signal stay NaN.
    """
    speed, times = _speed(position, measured, rate), 1 if measured is None else 0
    acceleration = np.gradient(speed, 1 / rate, axis=0)
    return slow_part(speed, lowpass_hz, rate, times), slow_part(acceleration, lowpass_hz, rate, times + 1)


def _speed(position: Array, measured: Array | None, rate: float) -> Array:
    return np.gradient(position, 1 / rate, axis=0) if measured is None else measured


def _origin(recorded: bool, lowpass_hz: float) -> str:
    """In words where speeds come from."""
    origin = "the recorded motor speed" if recorded else "the motor position, differentiated"
    return (
        f"speed from {origin}, and acceleration as its central differences, both of cosines up to"
        f" {lowpass_hz:g} Hz alone (no phase); positions and torques unfiltered"
    )


def slow_part(values: Array, cutoff_hz: float, rate: float, differences: int = 0) -> Array:
    """Values (samples, ...) of cosines up to a frequency alone: an orthogonal projection.

    differences: how often central differences were taken of them, which make a wave of w radians a sample
    smaller than its derivative, by sin w / w; that is put right.
    """
    waves = scipy.fft.dct(values, axis=0, norm="ortho")
    angle = np.arange(len(values)) * np.pi / len(values)
    kept = angle * rate <= 2 * np.pi * cutoff_hz
    gain = np.where(kept, 1.0 / np.sinc(np.where(kept, angle, 0.0) / np.pi) ** differences, 0.0)
    return np.asarray(scipy.fft.idct((waves.T * gain).T, axis=0, norm="ortho"))


def _check_length(name: str, samples: int, rate: float, lowpass_hz: float) -> None:
    """A filter needs a past and a future, and that of scipy more than three times its coefficients."""
    least = max(3 * (_ORDER + 1), 2 * int(np.ceil(rate / lowpass_hz)) if lowpass_hz > 0 else 0)
    if samples <= least:
        found = f"{samples} samples at {rate:g} a second"
        expected = f"more than {least} for a low-pass of {lowpass_hz:g} Hz"
        raise InputError(f"record {name}", found, expected, "record longer")


def _inside(time_s: Array, reach: int, rate: float, gaps: Array) -> Mask:
    """(samples,): where the filter has a past and a future, further than `reach` samples from either end and
    from gaps (g, 2), s.
    """
    inside = np.zeros(len(time_s), dtype=bool)
    inside[reach : len(time_s) - reach] = True
    for begin, end in gaps:
        inside &= (time_s < begin - reach / rate) | (time_s > end + reach / rate)
    return inside


def in_a_row(motions: Sequence[ConditionedMotion]) -> ConditionedMotion:
    """Several motions as one, each beginning a sample after the last; named `A, B`.

    What one of them does not have, the whole does not have.  InputError where sample rates differ.
    """
    if len(motions) == 1:
        return motions[0]
    rates = [motion.sample_rate_hz for motion in motions]
    if max(rates) > 1.001 * min(rates):
        found = ", ".join(f"{motion.name}: {motion.sample_rate_hz:.6g} Hz" for motion in motions)
        raise InputError("records", f"different sample rates ({found})", "one of all", "set `resample_hz`")
    counts = [len(motion.time_s) for motion in motions]

    def joined(name: str) -> Any:
        parts = [getattr(motion, name) for motion in motions]
        return None if any(part is None for part in parts) else np.concatenate(parts)

    arrays = [
        *("position", "velocity", "acceleration", "torque", "inside", "command_position", "turning"),
        *("link_position", "link_velocity", "link_acceleration"),
    ]
    return replace(
        motions[0],
        name=", ".join(motion.name for motion in motions),
        names=tuple(motion.name for motion in motions),
        time_s=np.arange(sum(counts)) / rates[0],
        starts=tuple(int(start) for start in np.cumsum([0, *counts[:-1]])),
        **{name: joined(name) for name in arrays},
    )


def _torque(record: MotionRecord, signals: dict[str, Array], constant: Array | None) -> Array:
    if "motor_torque" in signals:
        return signals["motor_torque"]
    if "motor_current" in signals and constant is not None:
        return signals["motor_current"] * constant
    fix = "name `motor_torque`, or `motor_current` and drives.torque_constant_nm_per_a"
    raise InputError(f"{record.source}, key signals", "no motor torque", fix=fix)


def _jitter(time_s: Array, lowpass_hz: float) -> tuple[Array, str]:
    """Gaps (gaps, 2) between stamps, s, that are too long for what the low-pass lets through; and how uneven
    the stamps are, in a sentence.
    """
    steps = np.diff(time_s)
    longest = 0.5 / lowpass_hz
    wide = np.flatnonzero(steps > longest)
    low, high, mean, spread = 1e3 * np.array([steps.min(), steps.max(), steps.mean(), steps.std()])
    said = f"time stamps {low:.3g} to {high:.3g} ms apart (mean {mean:.4g}, standard deviation {spread:.2g})"
    if len(wide):
        said += (
            f"; {len(wide)} gaps longer than {1e3 * longest:g} ms, half a period of the low-pass, left out"
            " with what the filter takes from them"
        )
    return np.stack([time_s[wide], time_s[wide + 1]], axis=1), said


def _evened(record: MotionRecord) -> MotionRecord:
    """The record at its mean rate, by cubic splines through its stamps."""
    count = int(np.floor(record.time_s[-1] * record.sample_rate_hz * (1 + 1e-12))) + 1
    even = np.arange(count) / record.sample_rate_hz
    return replace(record, time_s=even, signals=_at(record, record.signals, even))


def _at(record: MotionRecord, signals: Mapping[str, Array], time_s: Array) -> dict[str, Array]:
    """Signals of the record at other times, by cubic splines; joints without a signal stay NaN."""
    found = {}
    for quantity, values in signals.items():
        there = np.isfinite(values).all(axis=0)
        found[quantity] = np.full((len(time_s), values.shape[1]), np.nan)
        spline = scipy.interpolate.make_interp_spline(record.time_s, values[:, there], k=3)
        found[quantity][:, there] = spline(time_s)
    return found


def _guard(old: float, new: float) -> str:
    return f" behind a zero-phase low-pass of {0.4 * new:g} Hz" if new < old else ""


def _resampled(record: MotionRecord, rate: float) -> tuple[Array, dict[str, Array]]:
    """All signals at another rate; joints without a signal stay NaN."""
    duration = record.time_s[-1]
    time_s = np.arange(int(np.floor(duration * rate * (1 + 1e-12))) + 1) / rate
    signals = dict(record.signals)
    if rate < record.sample_rate_hz:
        for quantity, values in signals.items():
            there = np.isfinite(values).all(axis=0)
            signals[quantity] = np.full_like(values, np.nan)
            signals[quantity][:, there] = _lowpass(values[:, there], 0.4 * rate, record.sample_rate_hz)
    return time_s, _at(record, signals, time_s)


def _lowpass(values: Array, cutoff_hz: float, rate: float) -> Array:
    sections = scipy.signal.butter(_ORDER, cutoff_hz, fs=rate, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, values, axis=0))
