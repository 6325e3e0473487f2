"""The border for files that a library has to read (HDF5, MATLAB, xacro, MJCF): read by a child process with
limits of time and memory, so that a file that crashes or hangs the library is one sentence here.

One child is kept for all files that this process reads.  Files that this process wrote itself, and that have
not changed since, are read here.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, BinaryIO, Literal, cast

from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, check_file
from identify.core.hdf5_tree import read_tree
from identify.core.tree import Group, unpack

Form = Literal["hdf5", "mat", "made", "none"]
_START_S, _LEAST_S, _BYTES_PER_S = 60.0, 3.0, 20 * MEBIBYTE
_MEMORY, _UNPACKING = 3072 * MEBIBYTE, 8
_WALL_ONLY = find_spec("resource") is None
"""Whether the system does not count processor time: on a busy machine, a whole file may seem to hang."""
_WORDS = {"hdf5": "an HDF5 file", "mat": "a .mat file, v5 or v7.3"}
_SUFFIXES = (".h5", ".hdf5", ".mat")
_AGAIN = "export or transfer it again"
_MAKING_S = 30.0
"""Of processor time for a function that makes something of a file."""


def read_hdf5(path: Path, names: Sequence[str] | None = None, expected: str = "an HDF5 file") -> Group:
    """Everything in an HDF5 file, or what is at these names, as `hdf5_tree.read_tree`; InputError where it is
    none, is damaged, leads out of itself or takes too long or too much memory.
    """
    check_file(path, expected)
    if _signature(path) in _own():
        return read_tree(path, names)
    return _reader(os.getpid()).read(path, "hdf5", names, expected)


def read_mat(path: Path) -> Group:
    """All variables of a MATLAB file; InputError as `read_hdf5`."""
    return _reader(os.getpid()).read(path, "mat", None, _WORDS["mat"])


def made(path: Path, maker: str, arguments: Mapping[str, str], expected: str, fix: str) -> Group:
    """What a function, `module:name`, of a file and arguments makes in the child process; InputError where it
    refuses the file, and as `read_hdf5`.
    """
    check_file(path, expected)
    asked = {"maker": maker, "arguments": [dict(arguments)]}
    return _reader(os.getpid()).read(path, "made", None, expected, asked, fix)


def prepare(paths: Iterable[Path]) -> None:
    """Start the child where one of the files will need it, so that it is ready by then."""
    if any(path.suffix.lower() in _SUFFIXES for path in paths):
        _reader(os.getpid()).start()


def wrote(path: Path) -> None:
    """Remember a file as written by this process."""
    _own().add(_signature(path))


@cache
def _own() -> set[tuple[Any, ...]]:
    """What this process wrote."""
    return set()


def _signature(path: Path) -> tuple[Any, ...]:
    status = path.stat()
    return (str(path.resolve()), os.getpid(), status.st_ino, status.st_size, status.st_mtime_ns)


@cache
def _reader(pid: int) -> _Reader:
    """The reader of the process of that number: a fork does not share its parent's."""
    del pid
    reader = _Reader()
    atexit.register(reader.close)
    return reader


_Answer = tuple[dict[str, Any], Group | None]
"""What was said, and the tree of a file where it could be made."""


class _Reader:
    """A child process, started when first needed and again after it died."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.RLock()
        self._late = False

    def start(self) -> None:
        """Start the process where none runs; it is not waited for."""
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self.close()
                self._process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "identify.core.binary_child"],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
                )
                self._ready = False

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            for pipe in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    cast(BinaryIO, pipe).close()
            process.wait()

    def read(
        self,
        path: Path,
        form: Form,
        names: Sequence[str] | None,
        expected: str,
        more: Mapping[str, Any] | None = None,
        fix: str = _AGAIN,
    ) -> Group:
        """The tree of a file; InputError where the process could not make it."""
        size = check_file(path, expected)
        seconds = (_LEAST_S if form != "made" else _MAKING_S) + size / _BYTES_PER_S
        limits = {"memory": _MEMORY + _UNPACKING * size, "seconds": seconds}
        asked = {"path": str(path.resolve()), "form": form, "names": None if names is None else list(names)}
        asked |= more or {}
        answer, late, code = self._answer(asked, limits)
        if answer is None:
            late = late or code == -getattr(signal, "SIGXCPU", 0)
            raise InputError(str(path), _lost(late, seconds, code), expected, fix)
        said, tree = answer
        if tree is None:
            place = f", {said['place']}" if said["place"] else ""
            raise InputError(f"{path}{place}", said["found"], expected, fix)
        return tree

    def _answer(
        self, asked: dict[str, Any], limits: dict[str, float]
    ) -> tuple[_Answer | None, bool, int | None]:
        """The answer within limits, or None, whether the process took too long, and how it ended."""
        seconds = limits["seconds"]
        with self._lock:
            self.start()
            if not self._ready:
                self._ready = self._ask({"path": "", "form": "none", **limits}, _START_S) is not None
            patience = 3 * seconds if _WALL_ONLY else _START_S + seconds
            answer = self._ask({**asked, **limits}, patience) if self._ready else None
            code = None if answer is not None or self._process is None else self._process.wait()
            return answer, self._late, code

    def _ask(self, request: dict[str, Any], seconds: float) -> _Answer | None:
        """The answer to a request, or None where the process died or had to be killed."""
        process = self._process
        if process is None:
            return None
        self._late, answered = False, False

        def kill() -> None:
            self._late = True
            process.kill()

        clock = threading.Timer(seconds, kill)
        clock.daemon = True
        clock.start()
        try:
            cast(BinaryIO, process.stdin).write(json.dumps(request).encode() + b"\n")
            cast(BinaryIO, process.stdin).flush()
            answer = unpack(cast(BinaryIO, process.stdout))
            answered = answer is not None
        except OSError:
            answer = None
        finally:
            clock.cancel()
            if not answered:
                process.kill()  # what it still says would be taken for the next answer
        return answer


def _lost(late: bool, seconds: float, code: int | None) -> str:
    """Why there was no answer."""
    if late:
        return f"it was not read within {seconds:.0f} s of work: it is damaged"
    return f"it breaks the library that reads it (the reading process ended with {code}): it is damaged"
