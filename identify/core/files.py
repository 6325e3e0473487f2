"""The border for files: what comes from outside is a regular file of a stated size, or refused before it
is opened.

Text goes on through `text_input`, YAML through `yaml_input`, XML through `xml_input`, and what a C library
reads (HDF5, MATLAB) through `binary_input`.
"""

from __future__ import annotations

import hashlib
import re
import stat
from pathlib import Path

from identify.core.errors import InputError

MEBIBYTE = 2**20
_DISGUISES = (
    (rb"\x1f\x8b", "it is compressed by gzip", "unpack it"),
    (rb"PK\x03\x04", "it is a zip archive, such as a workbook of a spreadsheet", "unpack or export it"),
    (
        rb"version https://git-lfs",
        "it is a pointer of Git LFS, which stands for the file",
        "run `git lfs pull`",
    ),
    (rb"\s*<(!doctype )?html", "it is a web page", "download the file itself"),
)
"""How other files begin that come under any name, what they are, and what to do."""
LARGEST = 4096 * MEBIBYTE
"""Bytes of the largest file that is read at all."""


def check_file(path: Path, expected: str, largest: int = LARGEST, fix: str = "check the path") -> int:
    """The bytes of a regular file; InputError for what is missing, no regular file (a folder, a device, a
    pipe), larger than `largest`, or begins as another kind of file does.
    """
    try:
        status = path.stat()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise unreadable(path, error, expected, fix) from error
    if not stat.S_ISREG(status.st_mode):
        kind = "a folder" if stat.S_ISDIR(status.st_mode) else "a device or a pipe"
        raise InputError(str(path), f"the file cannot be read (it is {kind})", expected, fix)
    if status.st_size > largest:
        found = f"the file has {status.st_size / MEBIBYTE:,.1f} MiB"
        raise InputError(str(path), found, f"{expected} of at most {largest / MEBIBYTE:,.0f} MiB")
    _check_beginning(path, expected, fix)
    return status.st_size


def _check_beginning(path: Path, expected: str, fix: str) -> None:
    """Raise an InputError for a file that is plainly something else, whatever its name says."""
    try:
        with path.open("rb") as file:
            begins = file.read(64)
    except OSError as error:
        raise unreadable(path, error, expected, fix) from error
    for pattern, found, remedy in _DISGUISES:
        if re.match(pattern, begins, re.IGNORECASE):
            raise InputError(str(path), f"the file cannot be read ({found})", expected, remedy)


def read_bytes(path: Path, expected: str, largest: int = LARGEST, fix: str = "check the path") -> bytes:
    """The content of a file; InputError as `check_file`."""
    check_file(path, expected, largest, fix)
    try:
        return path.read_bytes()
    except OSError as error:
        raise unreadable(path, error, expected, fix) from error


def sha256_of(path: Path, expected: str, largest: int = LARGEST, fix: str = "check the path") -> str:
    """The sha256 of a file's content, read piece by piece; InputError as `check_file`."""
    check_file(path, expected, largest, fix)
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise unreadable(path, error, expected, fix) from error


def unreadable(path: Path, error: OSError | ValueError, expected: str, fix: str) -> InputError:
    """What the operating system said, as a sentence."""
    why = (error.strerror if isinstance(error, OSError) else None) or error
    return InputError(repr(str(path))[1:-1], f"the file cannot be read ({why})", expected, fix)
