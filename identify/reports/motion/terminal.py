"""What `identify simulate`, and `identify fit` on a study of motion, show in the terminal."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from identify.reports.fit.terminal import parameter_rows
from identify.reports.kit.cells import Table as Printed
from identify.reports.motion.tables import circle_tables, rms_tables, trial_table
from identify.results.motion import MotionResult


def print_motion(result: MotionResult) -> None:
    """The verdict, what was fitted and tried, and the RMS of the differences to what was recorded."""
    console = Console()
    console.print(*result.verdict, sep="\n", highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)
    if result.parameters is not None:
        console.print(parameter_rows(f"{result.name}: parameters", result.parameters))
    trials = trial_table(result)
    for table in ([trials] if trials is not None else []) + circle_tables(result) + rms_tables(result):
        console.print(_table(table))


def _table(printed: Printed) -> Table:
    table = Table(
        *(column.head for column in printed.columns), title=printed.title, box=SIMPLE_HEAD, pad_edge=False
    )
    for row in printed.rows:
        table.add_row(*map(escape, row))
    return table
