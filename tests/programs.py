"""The program in a process of its own that has imported it already, so that what is done to it hits its work
and not its imports; and files compared dataset by dataset.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path

import h5py
import numpy as np

from identify import cli
from identify.__main__ import main
from identify.core import part_file
from identify.core.registry import installed

_OF_TIME = re.compile(r"/(seconds|written|checksum|workers|realtime_factor|jobs/file)$")
_OF_SCALES = ("DIMENSION_LIST", "REFERENCE_LIST")
"""References within the file."""
_OF_RUN = re.compile(r"\d[\d.e+-]* s\b|; \d+ (was|were) kept from before")
"""What a result tells of its run rather than of what was found."""


def programs() -> ForkServerContext:
    """Starts processes that have imported the program already."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.preloaded", "tests.programs"])
    return context


@dataclass(frozen=True)
class Trouble:
    """What befalls a run from within: a signal at its n-th write to the disk, no file above so many bytes,
    and whether its journal is written at each record rather than about once a second.
    """

    signal_at_write: tuple[int, int] | None = None
    largest_file: int | None = None
    each_record: bool = False


@dataclass(frozen=True)
class Run:
    """A run under way; said: the file that its standard error goes to."""

    process: BaseProcess
    said: Path

    def signal(self, number: int) -> None:
        """Send it a signal, unless it has ended: then its exit code says that it was not hit."""
        assert self.process.pid is not None
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.process.pid, number)

    def ended(self) -> int | None:
        """Its exit code, or the signal that ended it, negative; waits for it."""
        self.process.join(timeout=600)
        return self.process.exitcode


def begun(context: ForkServerContext, words: list[str], said: Path, trouble: Trouble | None = None) -> Run:
    """A run of `identify` with these words, which has come to its command."""
    ready = said.with_suffix(".ready")
    ready.unlink(missing_ok=True)
    process = context.Process(target=_main, args=(words, said, ready, trouble or Trouble()))
    process.start()
    while process.is_alive() and not ready.exists():
        time.sleep(0.005)
    return Run(process, said)


def ran(*words: str, cwd: Path, packages: Path | None = None) -> subprocess.CompletedProcess[str]:
    """`identify` with these words in a folder, ended: its exit code and what it said; packages: a folder in
    which more are installed.
    """
    with tempfile.TemporaryDirectory() as folder:
        said = [Path(folder) / name for name in ("out", "err")]
        process = programs().Process(target=_captured, args=(words, cwd, *said, packages))
        process.start()
        process.join(timeout=300)
        assert process.exitcode is not None, "it hangs"
        return subprocess.CompletedProcess(words, process.exitcode, *(one.read_text() for one in said))


def _captured(words: tuple[str, ...], cwd: Path, out: Path, err: Path, packages: Path | None) -> None:
    os.chdir(cwd)
    if packages is not None:
        sys.path.insert(0, str(packages))
        os.environ["PYTHONPATH"] = str(packages)  # for the processes that it starts
        installed.cache_clear()
    sys.argv = ["identify", *words]
    sys.stdout, sys.stderr = out.open("w"), err.open("w")
    for number, stream in enumerate((sys.stdout, sys.stderr), start=1):
        os.dup2(stream.fileno(), number)
    main()


def _main(words: list[str], said: Path, ready: Path, trouble: Trouble) -> None:
    sys.argv, sys.stderr = ["identify", *words], said.open("w")
    os.dup2(sys.stderr.fileno(), 2)  # what is said past Python too
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - as long as the process
    if trouble.signal_at_write is not None:
        _at_write(*trouble.signal_at_write)
    if trouble.each_record:
        part_file._EVERY_S = 0.0
    if trouble.largest_file is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (trouble.largest_file, resource.RLIM_INFINITY))
    command = cli.app

    def marked() -> None:
        ready.touch()
        command()

    marked.registered_commands = command.registered_commands  # type: ignore[attr-defined]
    cli.app = marked  # type: ignore[assignment]
    main()


def _at_write(number: int, which: int) -> None:
    """A signal in the middle of a write: its bytes are there, and not yet safe on the disk."""
    real, left = os.fsync, [which]

    def fsync(file: int) -> None:
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), number)
        real(file)

    os.fsync = fsync


def wait_for_more(run: Run, *watched: Path) -> None:
    """Until the run has put something new into one of the files, or has ended."""

    def sizes() -> list[tuple[int, int]]:
        return [(p.stat().st_size, p.stat().st_mtime_ns) if p.exists() else (0, 0) for p in watched]

    before, end = sizes(), time.monotonic() + 300
    while run.process.is_alive() and time.monotonic() < end and sizes() == before:
        time.sleep(0.01)


def part_of(out: Path) -> Path:
    """Where a run that writes `out` keeps what it has done so far."""
    return out.with_name(f"{out.name}.part")


def differences(one: Path, other: Path) -> list[str]:
    """The names of what is not the same in two result files; times and what tells them are left out."""
    a, b = dict(_content(one)), dict(_content(other))
    return sorted(set(a) ^ set(b)) + [name for name in a if name in b and not _equal(a[name], b[name])]


def _content(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    with h5py.File(path, "r") as file:
        names = ["/"]
        file.visit(names.append)
        for name in names:
            for key, value in file[name].attrs.items():
                if key not in _OF_SCALES and not _OF_TIME.search(f"/{key}"):
                    yield f"{name}@{key}", np.asarray(value)
            if isinstance(file[name], h5py.Dataset) and not _OF_TIME.search(f"/{name}"):
                value = np.asarray(file[name][()])
                yield name, value[:, :4] if name.endswith("history") else value  # the last column is time


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    if a.dtype.kind in "OSU":
        told = [[_OF_RUN.sub("", str(text)) for text in array.ravel().tolist()] for array in (a, b)]
        return told[0] == told[1]
    return a.shape == b.shape and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc")
