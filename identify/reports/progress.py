"""What a run shows in the terminal while it goes on: a bar over its starts, its candidates or its jobs."""

from __future__ import annotations

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

        yield Story(say, lambda number, total: bar.update(task, completed=number, total=total))


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
