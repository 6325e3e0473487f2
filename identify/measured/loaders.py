"""FRF files and time histories of any format, found by suffix or by name in one registry; third parties add
readers to `identify.loaders`.

A reader is a function `(path: Path, options: FrfFileOptions) -> FrfRecords`; what all formats share is done
in `frf_records`. A reader of time histories is `(path: Path, units: Units) -> (sample rate in Hz, list of
Signal)`, see `time_history`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from identify.core.asked import key
from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.core.latest import LatestLike
from identify.core.plugin import blamed
from identify.core.registry import Registry
from identify.measured.frf_records import FrfFileOptions, FrfRecords, to_frf_set
from identify.measured.frf_set import FrfSet
from identify.measured.several import files_of, options_for, sha256_of_all, together
from identify.measured.time_history import TimeHistory, Units, to_time_history

__all__ = [
    "FORMAT_OF_SUFFIX",
    "LOADERS",
    "TIME_LOADERS",
    "FrfFileOptions",
    "frf_files",
    "load_frf_set",
    "load_of_any_unit",
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
    **dict.fromkeys((".csv", ".txt", ".asc"), "csv"),
    **dict.fromkeys((".h5", ".hdf5"), "hdf5"),
    **dict.fromkeys((".mat",), "mat"),
}
"""Format by file suffix, lower case."""
_WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".ods")


_seen = LatestLike[FrfSet](12)
"""A run reads the same files when it looks at the set-up and when it fits."""


def load_frf_set(path: Path | Sequence[Path], options: FrfFileOptions | None = None) -> FrfSet:
    """The FRFs of a file, or of all files of a list, a folder or a pattern together, in SI units, with the
    path as source and the sha256 of the file (of several, that of theirs).

    InputError for a missing file, an unknown format, anything unreadable, and whatever the files leave open
    and the options do not say.
    """
    options = options or FrfFileOptions()
    files = frf_files(path)
    source = str(path if isinstance(path, Path) else path[0])
    opened = [_opened(one, options) for one in files]
    digests = [digest for _, digest in opened]

    def loaded() -> FrfSet:
        read = [_records(one, options, reader) for one, (reader, _) in zip(files, opened, strict=True)]
        found = read[0] if len(files) == 1 else together(source, list(zip(files, read, strict=True)))
        return to_frf_set(found, options, source, sha256_of_all(digests))

    known = (source, *files, *digests, *(reader for reader, _ in opened), options.model_dump_json())
    found = _seen.of(known, loaded, size=sum(one.stat().st_size for one in files))
    coherence, noise = (None if one is None else one.copy() for one in (found.coherence, found.noise))
    frequency_hz, frf = found.frequency_hz.copy(), found.frf.copy()
    return replace(found, frequency_hz=frequency_hz, frf=frf, coherence=coherence, noise=noise)


def load_of_any_unit(files: Sequence[Path], options: FrfFileOptions) -> tuple[FrfSet, bool]:
    """The FRFs of files, and whether they only do not say their quantity or unit, as a new study then asks.

    InputError as `load_frf_set`.
    """
    source = files[0] if len(files) == 1 else files
    try:
        return load_frf_set(source, options), False
    except InputError as error:
        guess = options.model_copy(update={"quantity": "accelerance", "unit": "m/s^2/N"})
        try:
            return load_frf_set(source, guess), True
        except InputError:
            raise error from None


def frf_files(path: Path | Sequence[Path]) -> list[Path]:
    """The files of FRFs that a path, or each of several, stands for; InputError as `files_of`."""
    paths = [path] if isinstance(path, Path) else path
    return [one for part in paths for one in files_of(part, FORMAT_OF_SUFFIX)]


def _opened(path: Path, options: FrfFileOptions) -> tuple[Any, str]:
    """The reader of one file, and its sha256; InputError for options that are not for such files."""
    reader, sha256 = _open(path, options.format, LOADERS)
    form = _format(path, options.format)
    if options.columns is not None and form != "csv":
        raise InputError(f"{path}, key columns", "names of columns of a file that has none", "a text file")
    if form == "uff" and (options.frequency_start_hz, options.frequency_step_hz) != (None, None):
        found = "frequencies of a file that says them itself"
        raise InputError(f"{path}, key frequency_step_hz", found, "a text file or arrays", "leave it out")
    return reader, sha256


def _records(path: Path, options: FrfFileOptions, reader: Any) -> FrfRecords:
    """What stands in one file."""
    with blamed(reader):
        found = reader(path, options_for(path, options))
        if not isinstance(found, FrfRecords):
            raise TypeError(f"it gives {type(found).__name__}, not FrfRecords")
    return found


def load_time_history(path: Path, units: Units | None = None, format: str | None = None) -> TimeHistory:
    """The signals of a file in SI units, in blocks; units say what the file leaves open, such as
    {"acceleration": "g"}.

    InputError as for `load_frf_set`.
    """
    reader, sha256 = _open(path, format, TIME_LOADERS)
    with blamed(reader):
        rate, signals = reader(path, units or {})
        return to_time_history(rate, signals, str(path), sha256)


def _format(path: Path, name: str | None) -> str | None:
    """The format that is asked for, or that of the suffix."""
    return name or FORMAT_OF_SUFFIX.get(path.suffix.lower())


def _open(path: Path, name: str | None, registry: Registry) -> tuple[Any, str]:
    """The reader for a file, and the file's sha256."""
    name = _format(path, name)
    if path.suffix.lower() in _WORKBOOKS:
        raise InputError(str(path), "a workbook of a spreadsheet", "a text file", "save its sheet as CSV")
    if name is None:
        raise InputError(
            str(path),
            f"suffix {path.suffix!r}",
            "one of " + ", ".join(FORMAT_OF_SUFFIX),
            f"add {key('format', 'uff')}",
        )
    reader = registry.get(name, where=f"{path}, key format")
    return reader, sha256_of(path, "a measured file")
