"""FRF sets in HDF5: datasets frequency_hz, frf, outputs, inputs, coherence; attributes quantity, unit,
averages, window_decay_per_s, record_s.

What else a file may hold, and under which names, is said in `array_files`; `variables` may lead into groups
(`group/name`).
"""

from __future__ import annotations

from pathlib import Path

from identify.core.binary_input import read_hdf5
from identify.measured.array_files import Arrays, paths_of, read_arrays
from identify.measured.frf_records import FrfFileOptions, FrfRecords


def read_frf(path: Path, options: FrfFileOptions) -> FrfRecords:
    """The FRFs of an HDF5 file; InputError where it is none or `array_files.read_arrays` finds fault."""
    content = read_hdf5(path, paths_of(options))
    return read_arrays(Arrays(content.value, options, str(path), lambda: read_hdf5(path), "/"))
