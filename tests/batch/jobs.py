"""Jobs for the tests of executors: good ones, and every way to go wrong.  Workers import them by name."""

from __future__ import annotations

import errno
import os
import signal
import time
from pathlib import Path

from identify.core.threads import threads


def square(x: float, attempt: int) -> dict[str, float]:
    """x squared, said aloud as libraries do."""
    print("a library prints")
    return {"value": x * x}


def slow(seconds: float, attempt: int, mark: str = "") -> dict[str, int]:
    """Takes its time, and may leave a file when it has ended."""
    time.sleep(seconds)
    if mark:
        Path(mark).touch()
    return {"pid": os.getpid()}


def held_up(mark: str, attempt: int) -> dict[str, int]:
    """Leaves its process number in a file, and takes its time."""
    Path(mark).write_text(str(os.getpid()))
    time.sleep(600)
    return {}


def endless(attempt: int) -> dict[str, int]:
    """Never returns."""
    while True:
        time.sleep(1)


def wrong(attempt: int) -> dict[str, int]:
    """Fails in its own words."""
    raise ValueError("the numbers do not add up")


def dies(attempt: int) -> dict[str, int]:
    """Takes its process along."""
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


def dies_at_first(attempt: int) -> dict[str, int]:
    """Its worker is lost twice."""
    return dies(attempt) if attempt < 3 else {"value": attempt}


def fails_at_first(attempt: int) -> dict[str, int]:
    """Fails once."""
    return wrong(attempt) if attempt < 2 else {"value": attempt}


def no_room(attempt: int) -> dict[str, int]:
    """Finds the disk full."""
    raise OSError(errno.ENOSPC, "No space left on device")


def no_room_until(there: str, attempt: int) -> dict[str, int]:
    """Finds the disk full until a file is there."""
    return {} if Path(there).exists() else no_room(attempt)


def of_threads(attempt: int) -> dict[str, object]:
    """What a worker is told of threads, and in how many it works."""
    return {"OMP_NUM_THREADS": os.environ["OMP_NUM_THREADS"], "own": threads()}
