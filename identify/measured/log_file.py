"""Time histories out of logs of controllers, whose signals are named: `joint2:motor [N m]: rec.torque[:,1]`.

A log is any file that `record_files` reads; `[:,1]` behind a name takes a column, from 0.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.delimited import SIGNAL
from identify.measured.record_files import RecordFile
from identify.measured.time_history import (
    Signal,
    TimeHistory,
    evenly_sampled,
    mean_rate,
    sample_rate,
    to_time_history,
)
from identify.measured.units import parse_signal_unit

TIME = "time_s"
_COLUMN = re.compile(r"(.+)\[:,\s*(\d+)\]")
_LEAST = 0.99
"""Of the mean rate of uneven times: at fewer samples, what is faster would fold back."""


def read_log(path: Path, names: Mapping[str, str], rate_hz: float | None) -> TimeHistory:
    """One block of the signals whose headings, `joint2:motor [N m]`, are keys of `names`, and `time_s`.

    rate_hz: samples a second of a log without times, or to be interpolated to where they are uneven.
    InputError for headings that are none, signals that are not there or have other lengths, and times that
    are uneven or missing where no rate is given.
    """
    file = RecordFile(path)
    columns = {heading: _column(file, name) for heading, name in names.items()}
    time_s = columns.pop(TIME, None)
    if time_s is None and rate_hz is None:
        expected = f"`{TIME}` among `signals`, or `sample_rate_hz`"
        raise InputError(f"{path}, key signals", "no times", expected)
    if time_s is None or rate_hz is None:
        rate, even = rate_hz or 0.0, None
        if time_s is not None:
            rate = sample_rate(time_s, f"{path}, {TIME}", "give `sample_rate_hz`, to interpolate them to")
    else:
        rate, even = rate_hz, _even(time_s, rate_hz, f"{path}, {TIME}")
    own = [
        _signal(file, names[heading], heading, values, time_s, even) for heading, values in columns.items()
    ]
    if len({len(one.values) for one in own}) > 1:
        found = ", ".join(f"{one.channel}: {len(one.values)}" for one in own)
        raise InputError(str(path), f"signals of different lengths: {found}", "as many samples of each")
    return to_time_history(rate, own, str(path), file.sha256)


def in_blocks(histories: list[TimeHistory]) -> TimeHistory:
    """Several logs of one thing as blocks as long as the shortest; InputError where they differ in signals or
    sample rate.
    """
    first = histories[0]
    for other in histories[1:]:
        alike = (other.channels, other.units) == (first.channels, first.units)
        if not alike or not np.isclose(other.sample_rate_hz, first.sample_rate_hz, rtol=1e-3):
            found = f"signals or a sample rate other than in {first.source}"
            raise InputError(other.source, found, "repeats of one measurement")
    samples = min(one.data.shape[1] for one in histories)
    data = np.concatenate([one.data[:, :samples] for one in histories])
    sources = " + ".join(one.source for one in histories)
    sha256 = first.sha256 if len(histories) == 1 else ""
    return TimeHistory(first.sample_rate_hz, data, first.channels, first.units, sources, sha256)


def _column(file: RecordFile, name: str) -> Array:
    """(samples,), the only column of what stands at a name, or the one asked for."""
    asked = _COLUMN.fullmatch(name)
    array = file.array(asked[1] if asked else name)
    table = array[:, None] if array.ndim == 1 else array.T if array.shape[0] == 1 else array
    number = int(asked[2]) if asked else 0
    if number >= table.shape[1] or (asked is None and table.shape[1] > 1):
        found = f"an array of shape {array.shape}"
        raise InputError(f"{file.path}, {name}", found, "one column", f"name it, such as {name}[:,0]")
    return table[:, number]


def _signal(
    file: RecordFile, name: str, heading: str, values: Array, time_s: Array | None, even: Array | None
) -> Signal:
    """A signal in the unit of its heading; at even times where its own are not."""
    where = f"{file.path}, {heading}"
    match = SIGNAL.fullmatch(heading)
    if match is None:
        raise InputError(where, f"signal {heading!r}", f"`{TIME}`, or channel [unit] as joint2:motor [N m]")
    if file.form == "bag" and time_s is not None:
        stamps = file.array(name.partition(":")[0] + ":time")
        if len(stamps) != len(time_s) or np.any(stamps != time_s):
            mean_rate(stamps, where)
            values = np.interp(time_s, stamps, values)
    if even is not None and time_s is not None:
        if len(values) != len(time_s):
            raise InputError(where, f"{len(values)} samples for {len(time_s)} times", "one for each time")
        values = scipy.interpolate.make_interp_spline(time_s - time_s[0], values, k=3)(even)
    return Signal(Channel.parse(match[1], where), parse_signal_unit(match[2], where), values, where)


def _even(time_s: Array, rate_hz: float, where: str) -> Array | None:
    """Even times, s, from the first of uneven ones; None where these are even at that rate already."""
    mean = mean_rate(time_s, where)
    if evenly_sampled(time_s) and np.isclose(mean, rate_hz, rtol=1e-3):
        return None
    if rate_hz < _LEAST * mean:
        found = f"sample_rate_hz of {rate_hz:g} for {mean:.6g} samples a second"
        raise InputError(where, found, "as many or more")
    return np.arange(int((time_s[-1] - time_s[0]) * rate_hz * (1 + 1e-12)) + 1) / rate_hz
