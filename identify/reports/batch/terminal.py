"""What a batch or a map shows in the terminal: a bar over its jobs, and what came of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from identify.batch.index import BatchIndex
from identify.batch.loop import Watch
from identify.results.batch import BatchResult

_FAILURES = 10


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
    with Progress(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as bar:
        task = bar.add_task("starting", total=None)

        def watch(index: BatchIndex) -> None:
            counts = index.counts()
            ended = counts["done"] + counts["failed"]
            failed = f", {counts['failed']} failed" if counts["failed"] else ""
            bar.update(
                task, description=f"{index.about['workers']}{failed}", total=len(index.jobs), completed=ended
            )

        yield watch


def print_said(verdict: Sequence[str], notes: Sequence[str]) -> None:
    """Verdict and notes."""
    console = Console()
    console.print(*verdict, sep="\n", highlight=False)
    for note in notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)


def print_batch(result: BatchResult) -> None:
    """Verdict, what depends on posture, and the first failures."""
    print_said(result.verdict, result.notes)
    d = result.dependence
    table = Table(
        "parameter",
        "mean",
        "unit",
        "scatter %",
        "p",
        "postures",
        "verdict",
        title=f"{result.name}: posture",
        box=SIMPLE_HEAD,
    )
    for row, name in enumerate(d.parameter):
        percent = 100 * (d.scatter[row] if result.parameters.log[row] else d.scatter[row] / abs(d.mean[row]))
        told = "" if not d.count[row] > 1 else "depends" if d.depends[row] else "the same"
        numbers = (
            f"{d.mean[row]:.4g}",
            result.parameters.unit[row],
            f"{percent:.2g}",
            f"{d.p_value[row]:.2g}",
            str(d.count[row]),
        )
        table.add_row(name, *numbers, told)
    console = Console()
    console.print(table)
    failed = [
        (n, e)
        for n, s, e in zip(result.jobs.name, result.jobs.state, result.jobs.error, strict=True)
        if s == "failed"
    ]
    for name, error in failed[:_FAILURES]:
        console.print(f"[red]failed:[/] {escape(name)}: {escape(error)}", highlight=False)
    if len(failed) > _FAILURES:
        console.print(f"and {len(failed) - _FAILURES} more, in the index and the report", highlight=False)
