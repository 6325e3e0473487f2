"""Recorded motion: what was commanded, where motors and links were, how fast, and the motors' torque, per
joint over time, in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, field_validator

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.measured.record_files import JOINT, RecordFile
from identify.measured.time_history import mean_rate, sample_rate
from identify.measured.units import SignalUnit, parse_signal_unit

Quantity = Literal[
    "command_position",
    "command_velocity",
    "motor_position",
    "motor_velocity",
    "motor_torque",
    "motor_current",
    "link_position",
    "link_velocity",
]
FARTHEST = 5 * 2 * np.pi
"""No joint of an arm turns as far, rad, for its cables."""
_ALIKE = 1e-4
"""Difference of two recorded signals, in standard deviations of them, up to which they are one: noise is
more."""
_SI: dict[str, str] = {"position": "rad", "velocity": "rad/s", "torque": "N m", "current": "A"}


class TimeAxis(Settings):
    """Where the time of the samples stands."""

    at: str = Field(description="name of the time axis in the files; `time` in universal files")
    unit: Literal["s", "ms"] = Field("s", description="unit of its numbers")


class SignalSettings(Settings):
    """Where a signal stands in the files, and in which unit."""

    at: str = Field(
        description=(
            "name of the array; with {joint} in it one array per joint, else one array with all of them"
        )
    )
    unit: str = Field(description="deg, rad, deg/s, rad/s, N m, or A")

    @field_validator("at")
    @classmethod
    def _one_placeholder(cls, at: str) -> str:
        if set(at.replace(JOINT, "")) & set("{}"):
            raise ValueError(
                f"braces other than {JOINT} in {at!r}; expected {JOINT} where the joint's number stands"
            )
        return at

    joints: list[int] | None = Field(None, description="the joints that it really has; default: all")


@dataclass(frozen=True)
class MotionRecord:
    """A record: signals by quantity, (samples, joints), SI, NaN for joints that have none; positions count
    from the robot's zero.  Where time steps differ, the sample rate is their mean.
    """

    name: str
    sample_rate_hz: float
    time_s: Array
    signals: Mapping[str, Array]
    source: str
    sha256: str

    def signal(self, quantity: str) -> Array:
        """A signal that must be there; InputError where it is not."""
        if quantity not in self.signals:
            raise InputError(
                f"{self.source}, key signals",
                f"no {quantity}",
                "where it stands in the files",
                f"add `{quantity}:`",
            )
        return self.signals[quantity]


def read_record(
    path: Path,
    name: str,
    signals: Mapping[Quantity, SignalSettings],
    time: TimeAxis | float,
    joints: int,
    zero: Array,
    *,
    even: bool = True,
) -> MotionRecord:
    """A recorded motion of a robot with so many joints.

    time: the time axis, or samples per second where the files have none; zero (joints,), rad: what is added
    to all positions, the robot's joint angles where the record counts zero; even: whether time steps that are
    not all alike are refused.  InputError for whatever is not there, has another unit or another length.
    """
    file = RecordFile(path)
    read = {quantity: _signal(file, quantity, settings, joints) for quantity, settings in signals.items()}
    lengths = {quantity: len(values) for quantity, values in read.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(str(path), f"signals of different lengths: {lengths}", "as many samples of each")
    samples = next(iter(lengths.values()))
    time_s, rate = _time(file, time, samples, even)
    moved = {
        quantity: values + zero if quantity.endswith("position") else values
        for quantity, values in read.items()
    }
    return MotionRecord(
        name,
        rate,
        time_s,
        {str(quantity): values for quantity, values in moved.items()},
        str(path),
        file.sha256,
    )


def check_different(runs: Sequence[tuple[str, Mapping[str, Array]]]) -> None:
    """Raise an InputError where two of these runs, name and signals, are one: what was measured is alike in
    both but for rounding, whatever their files are called.  Commands may well be the same.
    """
    for (one, first), (other, second) in combinations(runs, 2):
        names = [name for name in first if name in second and not name.startswith("command")]
        if names and all(_alike(first[name], second[name]) for name in names):
            raise InputError(
                other,
                f"what was measured is that of {one}",
                "a record of its own, or it would count twice or judge itself",
                "name another file, or take one of the two out of the study",
            )


def _alike(one: Array, other: Array) -> bool:
    """Whether two signals (samples, joints) are one, perhaps with fewer digits."""
    size = np.nanstd(one) if one.size else 0.0
    return one.shape == other.shape and np.allclose(one, other, rtol=0, atol=_ALIKE * size, equal_nan=True)


def _time(file: RecordFile, time: TimeAxis | float, samples: int, even: bool) -> tuple[Array, float]:
    if not isinstance(time, TimeAxis):
        return np.arange(samples) / time, time
    time_s = np.ravel(file.array(time.at)) * (1e-3 if time.unit == "ms" else 1.0)
    if len(time_s) != samples:
        raise InputError(
            f"{file.path}, {time.at}", f"{len(time_s)} times for {samples} samples", "a time for each sample"
        )
    where, fix = f"{file.path}, {time.at}", "resample them, here with `resample_hz`"
    return time_s - time_s[0], sample_rate(time_s, where, fix) if even else mean_rate(time_s, where)


def _signal(file: RecordFile, quantity: str, settings: SignalSettings, joints: int) -> Array:
    """(samples, joints) in SI."""
    unit = _unit(quantity, settings, f"signals.{quantity}.unit")
    present = settings.joints or list(range(1, joints + 1))
    where = f"{file.path}, {settings.at}"
    if JOINT in settings.at:
        columns = [np.ravel(file.array(settings.at, joint, unit)) for joint in present]
        if len({len(column) for column in columns}) > 1:
            raise InputError(where, "joints with different numbers of samples", "as many of each")
        found = np.full((len(columns[0]), joints), np.nan)
        found[:, [joint - 1 for joint in present]] = np.stack(columns, axis=1)
    else:
        found = _by_joint(file.array(settings.at, None, unit), joints, where)
        found[:, [joint for joint in range(joints) if joint + 1 not in present]] = np.nan
    return found if file.in_si or unit is None else unit.factor * found


def _by_joint(array: Array, joints: int, where: str) -> Array:
    """(samples, joints) whichever way round the array stands."""
    array = array[:, None] if array.ndim == 1 else array
    if array.shape[1] == joints and array.shape[0] != joints:
        return array.copy()
    if array.shape[0] == joints and array.shape[1] != joints:
        return array.T.copy()
    raise InputError(
        where,
        f"an array of shape {array.shape}",
        f"one side of {joints}, a value per joint, and more samples than joints",
    )


def _unit(quantity: str, settings: SignalSettings, where: str) -> SignalUnit | None:
    """The unit, None for amperes; InputError where it does not fit the quantity."""
    wanted = _SI[quantity.rsplit("_", 1)[1]]
    if wanted == "A" or settings.unit == "A":
        if wanted != settings.unit:
            raise InputError(where, f"{settings.unit!r} for {quantity}", wanted)
        return None
    unit = parse_signal_unit(settings.unit, where)
    if unit.si != wanted:
        raise InputError(where, f"{settings.unit!r} for {quantity}", f"a unit of the kind of {wanted}")
    return unit
