"""From a record to a motion: resampled, differentiated behind a zero-phase low-pass, and said so.

Speed and acceleration come from the recorded speed where there is one, else from the position; both through a
Butterworth filter of fourth order run forwards and backwards (eighth order in all, no phase), then by central
differences.  Positions and torques are not filtered, so that what is explained is what was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Mask
from identify.core.errors import InputError
from identify.measured.records import MotionRecord

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


def condition(
    record: MotionRecord,
    lowpass_hz: float,
    resample_hz: float | None = None,
    torque_constant: Array | None = None,
) -> ConditionedMotion:
    """The motion of a record; torque_constant (joints,), N m/A, turns a motor current into a torque.

    InputError where the low-pass is not below half the sample rate, or neither torque nor current with its
    constant is there.
    """
    said = []
    time_s, signals, rate = record.time_s, dict(record.signals), record.sample_rate_hz
    if resample_hz is not None:
        time_s, signals = _resampled(record, resample_hz)
        said.append(
            f"resampled from {rate:g} to {resample_hz:g} Hz by cubic splines{_guard(rate, resample_hz)}"
        )
        rate = resample_hz
    if not 0 < lowpass_hz < rate / 2:
        raise InputError(
            "lowpass_hz",
            f"{lowpass_hz:g} Hz at {rate:g} samples a second",
            f"a frequency below {rate / 2:g} Hz",
        )
    position = record.signal("motor_position") if resample_hz is None else signals["motor_position"]
    measured = signals.get("motor_velocity")
    origin = "the recorded motor speed" if measured is not None else "the motor position, differentiated"
    velocity = _lowpass(
        measured if measured is not None else np.gradient(position, 1 / rate, axis=0), lowpass_hz, rate
    )
    said.append(
        f"speed from {origin}, and acceleration as its central differences, behind a zero-phase Butterworth"
        f" low-pass of {lowpass_hz:g} Hz (fourth order, forwards and backwards); positions and torques"
        " unfiltered"
    )
    reach = int(np.ceil(rate / lowpass_hz))
    inside = np.zeros(len(time_s), dtype=bool)
    inside[reach : len(time_s) - reach] = True
    said.append(f"{reach / rate:.3g} s at either end left out, where the filter has no past or future")
    return ConditionedMotion(
        record.name,
        rate,
        time_s,
        position,
        velocity,
        np.gradient(velocity, 1 / rate, axis=0),
        _torque(record, signals, torque_constant),
        signals.get("link_position"),
        signals.get("command_position"),
        inside,
        tuple(said),
    )


def _torque(record: MotionRecord, signals: dict[str, Array], constant: Array | None) -> Array:
    if "motor_torque" in signals:
        return signals["motor_torque"]
    if "motor_current" in signals and constant is not None:
        return signals["motor_current"] * constant
    fix = "name `motor_torque`, or `motor_current` and drives.torque_constant_nm_per_a"
    raise InputError(f"{record.source}, key signals", "no motor torque", fix=fix)


def _guard(old: float, new: float) -> str:
    return f" behind a zero-phase low-pass of {0.4 * new:g} Hz" if new < old else ""


def _resampled(record: MotionRecord, rate: float) -> tuple[Array, dict[str, Array]]:
    """All signals at another rate; joints without a signal stay NaN."""
    duration = record.time_s[-1]
    time_s = np.arange(int(np.floor(duration * rate * (1 + 1e-12))) + 1) / rate
    found = {}
    for quantity, values in record.signals.items():
        there = np.isfinite(values).all(axis=0)
        fine = values[:, there]
        if rate < record.sample_rate_hz:
            fine = _lowpass(fine, 0.4 * rate, record.sample_rate_hz)
        found[quantity] = np.full((len(time_s), values.shape[1]), np.nan)
        found[quantity][:, there] = scipy.interpolate.make_interp_spline(record.time_s, fine, k=3)(time_s)
    return time_s, found


def _lowpass(values: Array, cutoff_hz: float, rate: float) -> Array:
    sections = scipy.signal.butter(_ORDER, cutoff_hz, fs=rate, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, values, axis=0))
