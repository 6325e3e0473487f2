"""What `identify fit` on a study of joints shows in the terminal."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from identify.reports.joints.tables import value_table
from identify.results.joints import JointsResult


def print_joints(result: JointsResult) -> None:
    """The verdict, and the values of every curve with their intervals."""
    console = Console()
    console.print(*map(escape, result.verdict), sep="\n", highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)
    for label, found in result.curves.items():
        printed = value_table(label, found)
        table = Table(title=printed.title, box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
        for column in printed.columns[:-1]:
            table.add_column(column.head, justify="right" if column.numeric else "left", no_wrap=True)
        for row in printed.rows:
            table.add_row(*map(escape, row[:-1]))
        console.print(table)
