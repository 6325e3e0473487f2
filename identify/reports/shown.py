"""Where a run shows what it does: a bar in a terminal; elsewhere, as in a file or a pipe, a line for every
stage and a sign of life every ten seconds.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

SILENCE_S = 10.0
"""The longest time without a sign of life."""


class Shown(Protocol):
    """Where progress is shown."""

    def tell(self, what: str, done: int | None = None, total: int | None = None, stage: object = "") -> None:
        """What is being done, how much of it, and in which stage: each new one is worth a line."""

    def say(self, sentence: str) -> None:
        """A sentence that stays."""


@contextmanager
def shown(quiet: bool, first: str) -> Iterator[Shown]:
    """A bar in a terminal, lines elsewhere, nothing where quiet; first: what is done first."""
    console = Console(stderr=True)
    if quiet:
        yield _Nothing()
    elif console.is_terminal:
        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        with Bar(*columns, console=console, transient=True) as bar:
            task = bar.add_task(first, total=None)
            yield _InTerminal(bar, task)
    else:
        lines = Lines(lambda text: console.print(text, highlight=False, soft_wrap=True))
        with lines.alive(first):
            yield lines


class _Nothing:
    """Quiet."""

    def tell(self, what: str, done: int | None = None, total: int | None = None, stage: object = "") -> None:
        """Nothing."""

    def say(self, sentence: str) -> None:
        """Nothing."""


@dataclass(frozen=True)
class _InTerminal:
    """A bar."""

    bar: Bar
    task: int

    def tell(self, what: str, done: int | None = None, total: int | None = None, stage: object = "") -> None:
        """Draw it; without a total it moves to and fro."""
        row = next(row for row in self.bar.tasks if row.id == self.task)
        row.total = total
        self.bar.update(row.id, description=what, completed=done or 0)

    def say(self, sentence: str) -> None:
        """Above the bar."""
        self.bar.console.print(sentence, highlight=False)


@dataclass
class Lines:
    """Lines of text, through `write`; now: the time, s."""

    write: Callable[[str], None]
    now: Callable[[], float] = time.monotonic
    _began: float = field(init=False)
    _last: float = field(init=False)
    _text: str = field(init=False, default="")
    _stage: object = field(init=False, default=None)
    _lock: threading.Lock = field(init=False, default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self._began = self._last = self.now()

    def tell(self, what: str, done: int | None = None, total: int | None = None, stage: object = "") -> None:
        """A line for a new stage; the rest is kept for the next sign of life."""
        with self._lock:
            self._text = what
            if stage != self._stage:
                self._stage = stage
                self._write(self._text)

    def say(self, sentence: str) -> None:
        """A line."""
        with self._lock:
            self._write(sentence)

    def beat(self) -> None:
        """The sign of life, where nothing was written for long enough."""
        with self._lock:
            if self.now() - self._last >= SILENCE_S:
                self._write(f"{self._text} ({self.now() - self._began:.0f} s)")

    @contextmanager
    def alive(self, first: str) -> Iterator[None]:
        """Signs of life as long as it is open; first: what is done, said where it takes long."""
        self._text = first
        ended = threading.Event()

        def beating() -> None:
            while not ended.wait(SILENCE_S / 10):
                self.beat()

        thread = threading.Thread(target=beating, daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def _write(self, text: str) -> None:
        self._last = self.now()
        self.write(text)


@contextmanager
def working(quiet: bool, what: str) -> Iterator[None]:
    """A sign of life of what has no parts to count."""
    with shown(quiet, what):
        yield
