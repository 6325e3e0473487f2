"""Files that are whole or not there: written aside, flushed to disk, renamed."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from pathlib import Path

from identify.core.errors import InputError


def write_whole(path: Path, fill: Callable[[Path], object], fix: str) -> None:
    """Let `fill` write a file aside and put it in place of `path`; where that is not possible, an InputError
    with `fix`, and no trace.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fill(aside)
        with aside.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(aside, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            aside.unlink()
        raise _not_written(path, error, fix) from error


def check_writable(path: Path, fix: str) -> None:
    """Raise the InputError of `write_whole` now where it could not write; what is at `path` stays."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        aside.touch()
        aside.unlink()
    except OSError as error:
        raise _not_written(path, error, fix) from error


def _not_written(path: Path, error: OSError, fix: str) -> InputError:
    return InputError(str(path), f"cannot be written ({error})", "a folder with room and permission", fix)
