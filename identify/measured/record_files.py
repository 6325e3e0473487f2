"""Arrays of a recorded motion as they stand in files: MATLAB (v5, v7.3), HDF5, CSV, universal files (58) and
ROS 2 bags.

A name leads to an array: a variable or structure field (`rec.act_pos_deg`), a dataset (`run1/position`), a
column of a CSV file, a channel of a universal file (`12:+RZ`), or a field of a topic
(`/joint_states:effort`).  With `{joint}` in it, it names one array per joint.

Signals of ROS 2 bags: MCAP and SQLite files, or the folder of a recording.

A name is `topic:field`, such as `/joint_states:effort`, an array (messages, joints), or with the name of a
joint behind it `/joint_states:effort:elbow_joint`, (messages,); a field inside another is `actual.positions`,
and `topic:time` the times of the messages, s, as their headers say, else as they were recorded.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import reduce
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.binary_input import made, read_hdf5, read_mat
from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.core.hdf5_tree import Refused
from identify.core.tree import Group, Value
from identify.measured import mat
from identify.measured.delimited import DelimitedTable, read_table
from identify.measured.loaders import FORMAT_OF_SUFFIX, load_time_history
from identify.measured.time_history import TimeHistory
from identify.measured.units import SignalUnit

SUFFIXES = (".mcap", ".db3")
METADATA = "metadata.yaml"
"""What the folder of a recording has in it, which stands for the folder."""
_TIME, _FIELDS_OF_NAMES = "time", ("name", "joint_names")
_EXPECTED = "a ROS 2 bag: .mcap, .db3, or the folder of a recording"


def read_bag(path: Path, names: list[str]) -> dict[str, Value | Group]:
    """The arrays at some names of a bag; InputError where one is not there, where the file is no bag, or
    where nothing is installed that reads it.
    """
    if find_spec("rosbags") is None:
        raise InputError(
            str(path),
            "a ROS 2 bag, and no library to read it",
            "the package rosbags",
            'pip install "robot-identify[ros]"',
        )
    fix = "write it with `ros2 bag record`, or name topics, fields and joints that it has"
    tree = made(path, "identify.measured.record_files:messages", {"names": json.dumps(names)}, _EXPECTED, fix)
    return tree.members


def messages(path: Path, arguments: dict[str, str]) -> Group:
    """What `read_bag` asks for, in the process that reads; Refused where something is not there."""
    from rosbags.highlevel import AnyReader  # noqa: PLC0415  a file of this kind is rare
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415

    names = json.loads(arguments["names"])
    place = path.parent if path.name == METADATA else path
    with AnyReader([place], default_typestore=get_typestore(Stores.LATEST)) as reader:
        found = {topic: _series(reader, topic) for topic in {name.partition(":")[0] for name in names}}
    return Group({name: _signal(name, *found[name.partition(":")[0]]) for name in names})


def _series(reader: Any, topic: str) -> tuple[list[Any], Array]:
    """The messages of a topic and their times, s."""
    connections = [one for one in reader.connections if one.topic == topic]
    if not connections:
        known = ", ".join(sorted({f"{one.topic} ({one.msgtype})" for one in reader.connections}))
        raise Refused(topic, f"no such topic; the bag has {known}")
    read = [(reader.deserialize(raw, one.msgtype), at) for one, at, raw in reader.messages(connections)]
    if not read:
        raise Refused(topic, "no message")
    stamps = [getattr(getattr(message, "header", None), "stamp", None) for message, _ in read]
    stamped = [0 if stamp is None else 10**9 * stamp.sec + stamp.nanosec for stamp in stamps]
    times = stamped if all(stamped) else [at for _, at in read]
    return [message for message, _ in read], 1e-9 * np.array(times, dtype=float)


def _signal(name: str, series: list[Any], times: Array) -> Array:
    """The array at a name of a topic's messages."""
    _, _, rest = name.partition(":")
    field, _, joint = rest.partition(":")
    if field == _TIME and not joint:
        return times
    try:
        values = [np.ravel(reduce(getattr, field.split("."), message)) for message in series]
    except AttributeError:
        known = ", ".join(one for one in vars(series[0]) if not one.startswith("_"))
        raise Refused(name, f"no field {field!r}; a message has {known}") from None
    if joint:
        return np.array([row[_place(name, joint, one, row)] for row, one in zip(values, series, strict=True)])
    if len({row.size for row in values}) > 1 or not values[0].size:
        raise Refused(name, "messages with different numbers of values, or none")
    if len({_names(message) for message in series}) > 1:
        raise Refused(name, f"joints whose order changes: name one, {name}:{_names(series[0])[0]}")
    return np.array(values)


def _place(name: str, joint: str, message: Any, row: Array) -> int:
    """Where a joint stands in a message's values."""
    found = _names(message)
    if joint not in found or found.index(joint) >= len(row):
        raise Refused(name, f"no value of joint {joint!r}; the message has {', '.join(found) or 'no names'}")
    return found.index(joint)


def _names(message: Any) -> tuple[str, ...]:
    """Of the joints in a message, if it has any."""
    return next((tuple(getattr(message, key)) for key in _FIELDS_OF_NAMES if hasattr(message, key)), ())


Lookup = Callable[[str, SignalUnit | None], Any]
"""The array of that name, or None; a file that keeps units gives the one of that unit in SI."""
JOINT = "{joint}"
_LARGEST, _NAMED = 1e30, 4
"""Of what is recorded, in any unit: squares of what is larger are no numbers;
columns that an error names."""


class RecordFile:
    """An open-and-read file: `array` gives what is at a name, as floats."""

    def __init__(self, path: Path) -> None:
        if (path / METADATA).exists():
            path = path / METADATA
        form = "bag" if path.name == METADATA else _FORMS.get(path.suffix.lower())
        if form is None:
            raise InputError(str(path), f"suffix {path.suffix!r}", "one of " + ", ".join(_FORMS))
        self.path, self.form = path, form
        fix = "put the data there, or say in `records` where they are"
        self.sha256 = sha256_of(path, "a recorded motion", fix=fix)
        self.in_si = form == "uff"
        self._lookup = _READERS[form](path)

    def array(self, name: str, joint: int | None = None, unit: SignalUnit | None = None) -> Array:
        """The numbers at a name; InputError where nothing is there or it is no array of numbers."""
        written = name.replace(JOINT, str(joint))
        value = self._lookup(written, unit)
        where = f"{self.path}, {written}"
        if value is None:
            found = "nothing of that name is in the file"
            raise InputError(where, found, self._known or "the name of an array", "correct `signals`")
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" or array.ndim not in (1, 2):
            raise InputError(
                where,
                f"{array.dtype} of {array.ndim} dimensions",
                "real numbers over time, for one or all joints",
            )
        values = array.astype(float)
        wrong = np.argwhere(~(np.abs(values) < _LARGEST))
        if len(wrong):
            found = f"values that are not finite, or beyond {_LARGEST:g}, at sample {wrong[0].max()} first"
            fix = "export it again, or name only the joints that were recorded"
            raise InputError(where, found, "numbers", fix)
        return values

    @property
    def _known(self) -> str:
        """Some of the names that a table has, for an error; empty for other files."""
        names = read_table(self.path).header if self.form == "csv" else ()
        return f"a column, such as {', '.join(names[:_NAMED])}" if names else ""


def _of_mat(path: Path) -> Lookup:
    content = read_mat(path)
    return lambda name, unit: mat.variable(content, name)


def _of_hdf5(path: Path) -> Lookup:
    read_hdf5(path, [])  # says now what is wrong with the file as a whole
    return lambda name, unit: read_hdf5(path, [name]).value(name)


def _of_csv(path: Path) -> Lookup:
    table = read_table(path)

    def lookup(name: str, unit: SignalUnit | None) -> Any:
        return _column(table, name)

    return lookup


def _column(table: DelimitedTable, name: str) -> Any:
    written = name if ":" in name else name.lower()
    return table.numbers(table.header.index(written)) if written in table.header else None


def _of_uff(path: Path) -> Lookup:
    history: TimeHistory = load_time_history(path)

    def lookup(name: str, unit: SignalUnit | None) -> Any:
        if unit is None:
            return np.arange(history.data.shape[1]) / history.sample_rate_hz if name == "time" else None
        for column, (channel, si) in enumerate(zip(history.channels, history.units, strict=True)):
            if str(channel) == name and si == unit.si:
                return history.data[0, :, column]
        return None

    return lookup


def _of_bag(path: Path) -> Lookup:
    known: dict[str, Value | Group] = {}

    def lookup(name: str, unit: SignalUnit | None) -> Value | Group:
        # The times of the topic come with each signal: logs ask for both, and a bag is read as a whole.
        if name not in known:
            known.update(read_bag(path, [name, f"{name.partition(':')[0]}:time"]))
        return known[name]

    return lookup


_READERS: dict[str, Callable[[Path], Lookup]] = {
    "mat": _of_mat,
    "hdf5": _of_hdf5,
    "csv": _of_csv,
    "uff": _of_uff,
    "bag": _of_bag,
}
_FORMS = {**FORMAT_OF_SUFFIX, **dict.fromkeys(SUFFIXES, "bag")}
