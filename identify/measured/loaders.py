"""FRF files and time histories of any format, found by suffix or by name in one registry; third parties add
readers to `identify.loaders`.

A reader is a function `(path: Path, options: FrfFileOptions) -> FrfRecords`; what all formats share is done
in `frf_records`. A reader of time histories is `(path: Path, units: Units) -> (sample rate in Hz, list of
Signal)`, see `time_history`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.core.plugin import blamed
from identify.core.registry import Registry
from identify.measured.frf_records import FrfFileOptions, to_frf_set
from identify.measured.frf_set import FrfSet
from identify.measured.time_history import TimeHistory, Units, to_time_history

__all__ = [
    "FORMAT_OF_SUFFIX",
    "LOADERS",
    "TIME_LOADERS",
    "FrfFileOptions",
    "load_frf_set",
    "load_time_history",
]

LOADERS = Registry(
    "FRF file format",
    "identify.loaders",
    {
        "uff": "identify.measured.uff.read:read_frf",
        "csv": "identify.measured.delimited:read_frf",
        "hdf5": "identify.measured.hdf5:read_frf",
        "mat": "identify.measured.mat:read_frf",
    },
)
"""Readers of FRF files by format."""

TIME_LOADERS = Registry(
    "time history format",
    "identify.time_loaders",
    {"uff": "identify.measured.uff.read:read_time", "csv": "identify.measured.delimited:read_time"},
)
"""Readers of time histories by format."""

FORMAT_OF_SUFFIX = {
    **dict.fromkeys((".uff", ".unv", ".58", ".ufb", ".bunv"), "uff"),
    **dict.fromkeys((".csv",), "csv"),
    **dict.fromkeys((".h5", ".hdf5"), "hdf5"),
    **dict.fromkeys((".mat",), "mat"),
}
"""Format by file suffix, lower case."""


def load_frf_set(path: Path, options: FrfFileOptions | None = None) -> FrfSet:
    """The FRFs of a file in SI units, with the path as source and the sha256 of the file.

    InputError for a missing file, an unknown format, anything unreadable, and whatever the file leaves open
    and the options do not say.
    """
    options = options or FrfFileOptions()
    reader, sha256 = _open(path, options.format, LOADERS)
    with blamed(reader):
        return to_frf_set(reader(path, options), options, str(path), sha256)


def load_time_history(path: Path, units: Units | None = None, format: str | None = None) -> TimeHistory:
    """The signals of a file in SI units, in blocks; units say what the file leaves open, such as
    {"acceleration": "g"}.

    InputError as for `load_frf_set`.
    """
    reader, sha256 = _open(path, format, TIME_LOADERS)
    with blamed(reader):
        rate, signals = reader(path, units or {})
        return to_time_history(rate, signals, str(path), sha256)


def _open(path: Path, name: str | None, registry: Registry) -> tuple[Any, str]:
    """The reader for a file, and the file's sha256."""
    name = name or FORMAT_OF_SUFFIX.get(path.suffix.lower())
    if name is None:
        raise InputError(
            str(path),
            f"suffix {path.suffix!r}",
            "one of " + ", ".join(FORMAT_OF_SUFFIX),
            "add the key format, such as format: uff",
        )
    reader = registry.get(name, where=f"{path}, key format")
    return reader, sha256_of(path, "a measured file")
