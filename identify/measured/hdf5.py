"""FRF sets in HDF5: datasets frequency_hz, frf, outputs, inputs, coherence; attributes quantity, unit,
averages, window_decay_per_s.

What else a file may hold, and under which names, is said in `array_files`; `variables` may lead into groups
(`group/name`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from identify.core.errors import InputError
from identify.measured.array_files import Arrays, read_arrays
from identify.measured.frf_records import FrfFileOptions, FrfRecords
from identify.measured.frf_set import UNIT, FrfSet


def read_frf(path: Path, options: FrfFileOptions) -> FrfRecords:
    """The FRFs of an HDF5 file; InputError where it is none or `array_files.read_arrays` finds fault."""
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise InputError(
            str(path),
            "no readable HDF5 file, or a truncated one",
            "an HDF5 file",
            "transfer or export it again",
        ) from error
    with file:
        return read_arrays(Arrays(lambda name: _get(file, name), options, str(path)))


def write_frf(path: Path, frf_set: FrfSet) -> None:
    """Write an FRF set in SI units, every bit of it."""
    with h5py.File(path, "w") as file:
        file["frequency_hz"] = frf_set.frequency_hz
        file["frf"] = frf_set.frf
        file["outputs"] = [str(channel) for channel in frf_set.outputs]
        file["inputs"] = [str(channel) for channel in frf_set.inputs]
        if frf_set.coherence is not None:
            file["coherence"] = frf_set.coherence
        file.attrs["quantity"] = frf_set.quantity
        file.attrs["unit"] = UNIT[frf_set.quantity]
        file.attrs["window_decay_per_s"] = frf_set.window_decay_per_s
        if frf_set.averages is not None:
            file.attrs["averages"] = frf_set.averages


def _get(file: h5py.File, name: str) -> Any:
    """A dataset or, where there is none, an attribute of that name; complex numbers may be pairs (r, i) or
    (real, imag).
    """
    found = file.get(name)
    if not isinstance(found, h5py.Dataset):
        return file.attrs.get(name)
    try:
        value = found[()]
    except OSError as error:
        raise InputError(
            f"{file.filename}, {name}", "data that cannot be read", "a whole file", "transfer it again"
        ) from error
    fields = np.asarray(value).dtype.names
    if fields is not None and len(fields) == 2:
        return value[fields[0]] + 1j * value[fields[1]]
    return value
