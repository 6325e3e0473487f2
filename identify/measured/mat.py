"""FRF sets in MATLAB files, v5 and v7.3: the names of `array_files` as variables; `variables` may lead into
structures (`test.H`).
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

from pymatreader import read_mat
from scipy.io.matlab import MatReadError

from identify.core.errors import InputError
from identify.measured.array_files import Arrays, read_arrays
from identify.measured.frf_records import FrfFileOptions, FrfRecords

_DAMAGED = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    RuntimeError,
    MemoryError,
    struct.error,
    zlib.error,
    MatReadError,
)
"""What scipy and h5py raise on damaged files."""


def read_frf(path: Path, options: FrfFileOptions) -> FrfRecords:
    """The FRFs of a MATLAB file; InputError where it is none or `array_files.read_arrays` finds fault."""
    content = read_variables(path)
    return read_arrays(Arrays(lambda name: variable(content, name), options, str(path)))


def read_variables(path: Path) -> dict[str, Any]:
    """All variables of a MATLAB file; InputError where it cannot be read."""
    try:
        content: dict[str, Any] = read_mat(str(path))
    except _DAMAGED as error:
        found = f"no readable MATLAB file ({type(error).__name__})"
        raise InputError(str(path), found, "a .mat file, v5 or v7.3", "save it again") from error
    return content


def variable(content: dict[str, Any], name: str) -> Any:
    """The variable or structure field of that name, or None."""
    value: Any = content
    for part in name.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return value
