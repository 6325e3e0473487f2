"""What `check` says of recorded motion before it is fitted or explained: numbers that are missing, signals
that never change, speeds that are not those of the positions, joints beyond their limits.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.text import listed
from identify.measured.finding import STUDY, Finding
from identify.measured.records import FARTHEST, MotionRecord
from identify.measured.time_history import evenly_sampled

_OFF = 0.1
"""Relative error of a slope that is no longer one of calibration or of filters; wrong units, gear ratios and
signs are far beyond it.
"""
_MOVED = np.radians(1.0)
"""A joint that turned less than this tells nothing of slopes."""
_SLACK = np.radians(0.5)
"""How far encoders may read beyond a limit."""


def check_records(
    records: Sequence[MotionRecord], limits: Array | None = None, joints: Sequence[int] | None = None
) -> dict[str, list[Finding]]:
    """The findings by record, and under `STUDY` those on all records.

    limits (2, joints), rad: least and most angle of the robot's joints, where it is known; joints: numbers of
    those in use, from 0; default: all.
    """
    used = np.zeros(_joints(records), dtype=bool)
    used[list(joints) if joints is not None else slice(None)] = True
    found: dict[str, list[Finding]] = {STUDY: list(_same_data(records))}
    for record in records:
        found.setdefault(record.name, []).extend(_of_record(record, limits, used))
    return found


def _joints(records: Sequence[MotionRecord]) -> int:
    return max((values.shape[1] for r in records for values in r.signals.values()), default=0)


def _of_record(record: MotionRecord, limits: Array | None, used: Mask) -> Iterator[Finding]:
    yield from _not_numbers(record, used)
    yield from _never_changing(record, used)
    yield from _turns(record, used)
    yield from _slopes(record, used)
    if limits is not None:
        yield from _beyond_limits(record, limits, used)
    if not evenly_sampled(record.time_s):
        low, high = 1e3 * np.diff(record.time_s).min(), 1e3 * np.diff(record.time_s).max()
        sentence = f"Time steps differ, from {low:.3g} to {high:.3g} ms."
        yield Finding("info", "uneven-steps", (), sentence, high)
    length = f"{len(record.time_s)} samples, {record.time_s[-1]:.4g} s at {record.sample_rate_hz:.4g} Hz"
    signals = ", ".join(f"{name} of {_named(_there(v) & used)}" for name, v in record.signals.items())
    yield Finding("info", "record", (), f"{length}: {signals}.", record.time_s[-1])


def _there(values: Array) -> Mask:
    """(joints,): which of them a signal (samples, joints) has."""
    return np.asarray(np.isfinite(values).any(axis=0))


def _named(joints: Mask) -> str:
    """Joints (joints,) by number."""
    numbers = [str(number + 1) for number in np.flatnonzero(joints)]
    return f"joint{'s' * (len(numbers) != 1)} {listed(numbers)}" if numbers else "no joint"


def _not_numbers(record: MotionRecord, used: Mask) -> Iterator[Finding]:
    for name, values in record.signals.items():
        gone = ~np.isfinite(values) & _there(values) & used
        if gone.any():
            sample = int(np.argmax(gone.any(axis=1)))
            sentence = (
                f"{name} of {_named(np.any(gone, axis=0))} is no number at {int(gone.any(axis=1).sum())} of"
                f" {len(values)} samples, the first at {record.time_s[sample]:.4g} s: cut them off, or export"
                " the record again."
            )
            yield Finding("fail", "not-a-number", (), sentence, float(gone.sum()))


def _never_changing(record: MotionRecord, used: Mask) -> Iterator[Finding]:
    """Torques, currents and speeds that stay at one number to the last digit while their joint turns."""
    moved = _moved(record)
    for name, values in record.signals.items():
        still = _there(values) & used & moved & (np.ptp(values, axis=0) == 0)
        if still.any() and not name.endswith("position"):
            sentence = f"{name} of {_named(still)} never changes, and the joint turns: was it recorded?"
            yield Finding("warn", "never-changes", (), sentence, int(still.sum()))


def _moved(record: MotionRecord) -> Mask:
    """(joints,): which of them turned by more than a degree."""
    positions = [values for name, values in record.signals.items() if name.endswith("position")]
    turned = [np.ptp(values, axis=0) > _MOVED for values in positions]  # False where it is no number
    return np.asarray(np.any(turned, axis=0)) if turned else np.zeros(_joints([record]), dtype=bool)


def _turns(record: MotionRecord, used: Mask) -> Iterator[Finding]:
    """Joints that turn farther than any does: degrees, or turns of the motor, that were said to be rad."""
    for name, values in record.signals.items():
        farthest = np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=0)
        far = used & (farthest > FARTHEST)
        if name.endswith("position") and far.any():
            largest = float(farthest[far].max())
            sentence = (
                f"{name} of {_named(far)} goes to {largest / (2 * np.pi):.3g} turns: are its numbers degrees,"
                " or the motor's before its gear?"
            )
            yield Finding("warn", "many-turns", (), sentence, largest)


def _slopes(record: MotionRecord, used: Mask) -> Iterator[Finding]:
    """Speeds against the positions' own, and link against motor positions."""
    signals, moved = record.signals, _moved(record) & used
    for what in ("motor", "link", "command"):
        if {f"{what}_position", f"{what}_velocity"} <= signals.keys():
            turned = np.gradient(signals[f"{what}_position"], record.time_s, axis=0)
            yield from _slope(
                f"{what}_velocity", signals[f"{what}_velocity"], "the positions' own", turned, moved
            )
    if {"motor_position", "link_position"} <= signals.keys():
        yield from _slope(
            "link_position", signals["link_position"], "motor_position", signals["motor_position"], moved
        )


def _slope(name: str, values: Array, other: str, expected: Array, moved: Mask) -> Iterator[Finding]:
    """A signal (samples, joints) that is not in proportion 1 to another where the two go together."""
    for joint in np.flatnonzero(moved & _there(values) & _there(expected)):
        rows = np.isfinite(values[:, joint]) & np.isfinite(expected[:, joint])
        one, two = (column[rows, joint] - column[rows, joint].mean() for column in (values, expected))
        together = abs(one @ two) / max(float(np.sqrt((one @ one) * (two @ two))), 1e-300)
        slope = float(one @ two) / max(float(one @ one), 1e-300)
        if together > 1 - _OFF and abs(slope - 1) > _OFF:
            sentence = (
                f"{name} of joint {joint + 1} times {slope:.3g} is {other}: check units, signs and gear"
                " ratios."
            )
            yield Finding("warn", "slope", (), sentence, slope)


def _beyond_limits(record: MotionRecord, limits: Array, used: Mask) -> Iterator[Finding]:
    for name in ("link_position", "motor_position"):
        if name in record.signals:
            values = record.signals[name]
            outside = (values < limits[0] - _SLACK) | (values > limits[1] + _SLACK)
            beyond = outside.any(axis=0) & used
            if beyond.any():
                sentence = (
                    f"{name} of {_named(beyond)} goes beyond the limits of the robot's file: check unit, sign"
                    " and zero."
                )
                yield Finding("warn", "joint-limit", (), sentence, int(beyond.sum()))
            return


def _same_data(records: Sequence[MotionRecord]) -> Iterator[Finding]:
    """Records of the same content under several names."""
    same = defaultdict(list)
    for record in records:
        same[record.sha256].append(record.name)
    for names in same.values():
        if len(names) > 1:
            sentence = f"Records {listed(names)} hold the same data: is one file named twice?"
            yield Finding("fail", "duplicate-data", (), sentence, len(names))
