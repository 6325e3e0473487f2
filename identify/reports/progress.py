"""What a run shows in the terminal while it goes on: a bar over its starts, its candidates or its jobs."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar

from identify.batch.index import BatchIndex
from identify.batch.loop import Watch
from identify.fitting.fit import Progress
from identify.fitting.selection.workbench import Story

_BEAT_S = 9.0
"""Between two lines of a run whose output is piped."""


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """A bar over the starts of a fit with the best cost so far and the time left; nothing where quiet."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[best]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    with Bar(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as bar:
        task = bar.add_task("reading", total=None, best="")
        lowest = [np.inf]

        def show(start: int, starts: int, kind: str, evaluations: int, best: float) -> None:
            lowest[0] = min(lowest[0], best)
            text = f"best cost {lowest[0]:.4g}"
            bar.update(
                task,
                description=f"start {start + 1} of {starts}, {kind}",
                total=starts,
                completed=start,
                best=text,
            )

        yield Progress(show)


@contextmanager
def story(quiet: bool) -> Iterator[Story]:
    """The turns of a discovery as they come, and a bar over the candidates of a step; nothing where quiet."""
    console = Console(stderr=True)
    columns = (
        TextColumn("trying candidates"),
        BarColumn(),
        TextColumn("{task.completed} of {task.total}"),
        TimeElapsedColumn(),
    )
    with Bar(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as bar:
        task = bar.add_task("", total=None)

        def say(sentence: str) -> None:
            if not quiet:
                bar.console.print(sentence, highlight=False)

        def done(number: int, total: int) -> None:
            count[0] += 1
            bar.update(task, completed=number, total=total or None)

        count, ended = [0], threading.Event()
        heart = threading.Thread(target=_beat, args=(console, count, ended), daemon=True)
        if not quiet and not console.is_terminal:
            heart.start()
        try:
            yield Story(say, done)
        finally:
            ended.set()


def _beat(console: Console, count: list[int], ended: threading.Event) -> None:
    """A line every few seconds for a reader who sees no bar: that it goes on, and how far it is."""
    began = time.monotonic()
    while not ended.wait(_BEAT_S):
        console.print(
            f"... {time.monotonic() - began:.0f} s, {count[0]} looks at places and candidates so far",
            highlight=False,
        )


@contextmanager
def batch_bar(quiet: bool) -> Iterator[Watch]:
    """A bar over the jobs, with how many failed and the time left; nothing where quiet."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as bar:
        task = bar.add_task("starting", total=None)

        def watch(index: BatchIndex) -> None:
            counts = index.counts()
            ended = counts["done"] + counts["failed"]
            failed = f", {counts['failed']} failed" if counts["failed"] else ""
            bar.update(
                task, description=f"{index.about['workers']}{failed}", total=len(index.jobs), completed=ended
            )

        yield watch
