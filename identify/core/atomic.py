"""Files that are whole or not there: written aside, flushed to disk, renamed; and the lock on an output."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from identify.core.errors import InputError

ELSEWHERE = "choose another with `--out`"
"""What to do where a command cannot write its output."""


def write_text(path: Path, text: str, fix: str = ELSEWHERE) -> None:
    """Write a text in UTF-8 with the same ends of lines on every system, whole or not at all, as
    `write_atomically` does.
    """
    write_atomically(path, partial(Path.write_text, data=text, encoding="utf-8", newline="\n"), fix)


def write_atomically(path: Path, fill: Callable[[Path], object], fix: str = ELSEWHERE) -> None:
    """Let `fill` write a file aside and put it in place of `path`; where that is not possible, an InputError
    with `fix`, and no trace.
    """
    aside = _aside(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fill(aside)
        with aside.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(aside, path)
    except OSError as error:
        raise _not_written(path, error, fix) from error
    finally:
        with contextlib.suppress(OSError):
            aside.unlink()


def check_writable(path: Path, fix: str = ELSEWHERE) -> None:
    """Raise the InputError of `write_atomically` now where it could not write; what is at `path` stays."""
    check_name(path.name)
    aside = _aside(path)
    try:
        if path.is_dir():
            raise InputError(str(path), "is a folder", "a place for a file", fix)
        path.parent.mkdir(parents=True, exist_ok=True)
        aside.touch()
        aside.unlink()
    except OSError as error:
        raise _not_written(path, error, fix) from error


def check_name(name: str, system: str = os.name) -> None:
    """Raise an InputError for the name of a file that Windows does not take or, with a colon, would hide in
    another file; elsewhere all names are taken.
    """
    found = sorted(set(name) & set('<>:"|?*'))
    if system == "nt" and (found or name.endswith((".", " "))):
        what = f"{' '.join(found)} in it" if found else "a dot or a blank at its end"
        raise InputError(repr(name), f"no name of a file on Windows ({what})", "another name", "give `--out`")


def remove_asides(path: Path) -> None:
    """Take away what killed runs left of `path` and of files of the same stem beside it, half written."""
    pattern = re.compile(rf"\.{re.escape(path.stem)}\.\d+\.[A-Za-z0-9]+")
    for left in path.parent.iterdir() if path.parent.is_dir() else ():
        if pattern.fullmatch(left.name):
            with contextlib.suppress(OSError):
                left.unlink()


@contextlib.contextmanager
def locked(path: Path, fix: str) -> Iterator[None]:
    """Hold `path` as the output of this process; InputError where another one holds it.

    The lock goes with the process, however that ends, and leaves no file behind when it is let go.
    """
    from filelock import FileLock, Timeout  # noqa: PLC0415  takes as long to import as the rest of `core`

    lock = FileLock(path.with_name(f".{path.name}.lock"), timeout=0)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout as error:
        raise InputError(str(path), "another run is writing it", "an output of its own", fix) from error
    except OSError as error:
        raise _not_written(path, error, fix) from error
    try:
        yield
    finally:
        with contextlib.suppress(
            OSError
        ):  # before the release: afterwards it may be another's (Windows: fails)
            Path(lock.lock_file).unlink()
        lock.release()


def _aside(path: Path) -> Path:
    """Hidden, and with the suffix, by which some writers tell the format."""
    return path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")


def _not_written(path: Path, error: OSError, fix: str) -> InputError:
    return InputError(str(path), f"cannot be written ({error})", "a folder with room and permission", fix)
