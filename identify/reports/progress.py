"""What a run shows while it goes on: a bar in a terminal; elsewhere, as in a file or a pipe, a line for every
stage and a sign of life every ten seconds.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from identify.batch.index import BatchIndex
from identify.batch.loop import Watch
from identify.fitting.fit import Progress
from identify.fitting.selection.workbench import Story

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
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """The starts of a fit with the best cost so far, which is that of the result."""
    with shown(quiet, "reading") as where:
        yield Progress(StartCount(where))


@dataclass
class StartCount:
    """Shows starts and stages of a fit, told as `Progress.show` is."""

    where: Shown
    _lowest: float = np.inf
    _stage: int = 0
    _before: tuple[int, int] = (0, 0)

    def __call__(self, start: int, starts: int, kind: str, evaluations: int, best: float) -> None:
        """Cost: NaN in a stage whose cost is not that of the result."""
        self._stage += (start, evaluations) < self._before or start != self._before[0]
        self._before = (start, evaluations)
        self._lowest = float(np.fmin(self._lowest, best))
        which = f"start {start + 1} of {starts}" if start < starts else "one more start"
        cost = f", best cost {self._lowest:.4g}" if np.isfinite(self._lowest) else ""
        self.where.tell(f"{which}, {kind}{cost}", start, max(starts, start + 1), self._stage)


@contextmanager
def story(quiet: bool) -> Iterator[Story]:
    """The turns of a discovery as they come, and how many candidates of a turn are tried."""
    with shown(quiet, "reading, and fitting the present model") as where:

        def tried(number: int, total: int) -> None:
            if number < total or not total:
                of = f" of {total}" if total else ""
                where.tell(f"trying candidates: {number}{of}", number, total or None, "candidates")
            else:
                where.tell("comparing the best candidates", stage="best")

        yield Story(where.say, tried)


@contextmanager
def motions(quiet: bool) -> Iterator[Story]:
    """The motions of which the best is taken, as they are improved."""
    with shown(quiet, "trying motions at random") as where:
        yield Story(
            where.say, lambda number, total: where.tell(f"{number} of {total} motions", number, total)
        )


@contextmanager
def batch_bar(quiet: bool) -> Iterator[Watch]:
    """The jobs that are done, with how many failed."""
    with shown(quiet, "starting") as where:

        def watch(index: BatchIndex) -> None:
            counts = index.counts()
            failed = f", {counts['failed']} failed" if counts["failed"] else ""
            ended = counts["done"] + counts["failed"]
            told = f"{index.about['workers']}: {ended} of {len(index.jobs)} done{failed}"
            where.tell(told, ended, len(index.jobs), "jobs")

        yield watch
