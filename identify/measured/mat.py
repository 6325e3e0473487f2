"""FRF sets in MATLAB files, v5 and v7.3: the names of `array_files` as variables; `variables` may lead into
structures (`test.H`).
"""

from __future__ import annotations

from pathlib import Path

from identify.core.binary_input import read_mat
from identify.core.tree import Group, Value
from identify.measured.array_files import Arrays, read_arrays
from identify.measured.frf_records import FrfFileOptions, FrfRecords


def read_frf(path: Path, options: FrfFileOptions) -> FrfRecords:
    """The FRFs of a MATLAB file; InputError where it is none or `array_files.read_arrays` finds fault."""
    content = read_mat(path)
    return read_arrays(Arrays(lambda name: variable(content, name), options, str(path), lambda: content, "."))


def variable(content: Group, name: str) -> Value | None:
    """The variable or structure field of that name, or None."""
    value: Group | Value | None = content
    for part in name.split("."):
        value = value.members.get(part) if isinstance(value, Group) else None
    return None if isinstance(value, Group) else value
