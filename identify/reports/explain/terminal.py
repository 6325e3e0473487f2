"""What `identify explain` shows in the terminal."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from identify.reports.explain.tables import effect_table, residual_table
from identify.reports.kit.cells import Table as Printed
from identify.results.explain import ExplainResult


def print_explained(result: ExplainResult) -> None:
    """The verdict, the effects by evidence, and what cannot be known; values are in the report."""
    console = Console()
    console.print(*map(escape, result.verdict), sep="\n", highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)
    for found in result.targets.values():
        for table, columns in ((residual_table(found), None), (effect_table(found), 2 + len(found.joints))):
            if table.rows:
                console.print(_table(table, columns))
        for name, reading in zip(found.effects.name, found.effects.reading, strict=True):
            if reading:
                console.print(f"{name}: {escape(reading)}", highlight=False)
    console.print("These records cannot say:", highlight=False)
    for sentence in result.unknown:
        console.print(f"- {escape(sentence)}", highlight=False)


def _table(printed: Printed, columns: int | None) -> Table:
    """The first columns of a table."""
    table = Table(title=printed.title, box=SIMPLE_HEAD, pad_edge=False)
    for column in printed.columns[:columns]:
        table.add_column(
            column.head, justify="right" if column.numeric else "left", no_wrap=not column.numeric
        )
    for row in printed.rows:
        table.add_row(*map(escape, row[:columns]))
    return table
