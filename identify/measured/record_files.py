"""Arrays of a recorded motion as they stand in files: MATLAB (v5, v7.3), HDF5, CSV, universal files (58) and
ROS 2 bags.

A name leads to an array: a variable or structure field (`rec.act_pos_deg`), a dataset (`run1/position`), a
column of a CSV file, a channel of a universal file (`12:+RZ`), or a field of a topic
(`/joint_states:effort`).  With `{joint}` in it, it names one array per joint.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.binary_input import read_hdf5, read_mat
from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.core.tree import Group, Value
from identify.measured import mat
from identify.measured.bag import METADATA, SUFFIXES, read_bag
from identify.measured.delimited import DelimitedTable, read_table
from identify.measured.loaders import FORMAT_OF_SUFFIX, load_time_history
from identify.measured.time_history import TimeHistory
from identify.measured.units import SignalUnit

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
