"""Arrays of a recorded motion as they stand in files: MATLAB (v5, v7.3), HDF5, CSV and universal files (58).

A name leads to an array: a variable or structure field (`rec.act_pos_deg`), a dataset (`run1/position`), a
column of a CSV file, or a channel of a universal file (`12:+RZ`).  With `{joint}` in it, it names one array
per joint.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured import mat
from identify.measured.delimited import DelimitedTable, read_table
from identify.measured.loaders import FORMAT_OF_SUFFIX, load_time_history
from identify.measured.time_history import TimeHistory
from identify.measured.units import SignalUnit

Lookup = Callable[[str, SignalUnit | None], Any]
"""The array of that name, or None; a file that keeps units gives the one of that unit in SI."""
JOINT = "{joint}"


class RecordFile:
    """An open-and-read file: `array` gives what is at a name, as floats."""

    def __init__(self, path: Path) -> None:
        form = FORMAT_OF_SUFFIX.get(path.suffix.lower())
        if form is None:
            raise InputError(str(path), f"suffix {path.suffix!r}", "one of " + ", ".join(FORMAT_OF_SUFFIX))
        self.path = path
        try:
            self.sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            fix = "put the data there, or say in `records` where they are"
            raise InputError(
                str(path), f"the file cannot be read ({error.strerror})", "a recorded motion", fix
            ) from error
        self.in_si = form == "uff"
        self._lookup = _READERS[form](path)

    def array(self, name: str, joint: int | None = None, unit: SignalUnit | None = None) -> Array:
        """The numbers at a name; InputError where nothing is there or it is no array of numbers."""
        written = name.replace(JOINT, str(joint))
        value = self._lookup(written, unit)
        where = f"{self.path}, {written}"
        if value is None:
            raise InputError(
                where, "nothing of that name is in the file", "the name of an array", "correct `signals`"
            )
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" or array.ndim not in (1, 2):
            raise InputError(
                where,
                f"{array.dtype} of {array.ndim} dimensions",
                "real numbers over time, for one or all joints",
            )
        if not np.isfinite(array.astype(float)).all():
            raise InputError(
                where,
                "values that are not finite",
                "numbers",
                "export it again, or name only the joints that were recorded",
            )
        return array.astype(float)


def _of_mat(path: Path) -> Lookup:
    content = mat.read_variables(path)
    return lambda name, unit: mat.variable(content, name)


def _of_hdf5(path: Path) -> Lookup:
    try:
        with h5py.File(path, "r") as file:
            arrays: dict[str, Any] = {}
            file.visititems(
                lambda name, item: arrays.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
            )
    except OSError as error:
        raise InputError(
            str(path), f"no readable HDF5 file ({error})", "an HDF5 file", "transfer or export it again"
        ) from error
    return lambda name, unit: arrays.get(name.strip("/"))


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


_READERS: dict[str, Callable[[Path], Lookup]] = {
    "mat": _of_mat,
    "hdf5": _of_hdf5,
    "csv": _of_csv,
    "uff": _of_uff,
}
