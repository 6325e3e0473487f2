"""Ctrl-C and a polite kill: the signal sets a flag, which long work reads between two steps.

So nothing is ever cut in two: no exception comes out of the middle of a write.  A second signal ends the
process at once, which is as safe as a power failure: files are whole at every moment, and what is under way
can be resumed.  Signals belong to the process, and so does the flag.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

from identify.core.errors import EXIT_INTERRUPTED

_SHOW_CURSOR = "\x1b[?25h"
_SIGNALS = ("SIGINT", "SIGTERM", "SIGBREAK")
"""Those of them that the system has; SIGBREAK is Ctrl-Break on Windows."""


class Interrupted(BaseException):
    """The user asked the run to end; no `except Exception` may swallow it."""


@dataclass
class _Flag:
    """Whether the end was asked for, and what to say where it cannot wait."""

    asked: bool = False
    sentence: str = "interrupted"


_flag = _Flag()


def check() -> None:
    """Raise Interrupted where the end was asked for; called between two steps of long work."""
    if _flag.asked:
        raise Interrupted


def ask() -> None:
    """Ask this process to end at its next step, as Ctrl-C does."""
    _flag.asked = True


@contextmanager
def listening(sentence: str = "interrupted") -> Iterator[None]:
    """Inside, signals ask for the end instead of raising; the handlers of before return afterwards.

    sentence: what is said where a second signal ends the process.

    Only in the main thread, as Python demands of signal handlers.
    """
    _flag.asked, _flag.sentence = False, sentence
    numbers = [getattr(signal, name) for name in _SIGNALS if hasattr(signal, name)]
    before = [(number, signal.signal(number, _heard)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
        _flag.asked = False


@contextmanager
def children_unasked() -> Iterator[None]:
    """Processes started inside do not hear Ctrl-C, which a terminal sends to all: their parent decides.

    A signal to this process waits until the end.  Where a system cannot do this, they hear it until they
    begin to ignore it themselves.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _heard(number: int, frame: FrameType | None) -> None:
    """The first signal asks, the next ones end the process now."""
    if not _flag.asked:
        _flag.asked = True
        return
    end = f"\n{_SHOW_CURSOR if sys.stderr.isatty() else ''}{_flag.sentence}\n"
    os.write(2, end.encode())  # past all buffers: a print may be under way
    os._exit(EXIT_INTERRUPTED)
