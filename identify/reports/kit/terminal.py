"""What the terminal shows of a report: verdict, notes, and the parts that are meant for it."""

from __future__ import annotations

from typing import Literal

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table as Rich

from identify.reports.kit.cells import Table
from identify.reports.kit.report import TERMINAL, Bullets, Heading, Part, Report, Tabular, Text
from identify.results.header import Header

_NAME, _ANY = 30, 10_000
"""Characters that the first column keeps for names; that no table needs."""


def show(result: Header, report: Report) -> None:
    """Print what a result says."""
    console = Console()
    for said in result.verdict:
        console.print(escape(said), highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)
    for part in report.shown(TERMINAL):
        _show(console, part)


def _show(console: Console, part: Part) -> None:
    if isinstance(part, Tabular):
        print_table(console, part.table.part(slice(part.rows), part.terminal))
        if part.rows is not None and len(part.table.rows) > part.rows:
            console.print(f"and {len(part.table.rows) - part.rows} more, in the report", highlight=False)
    elif isinstance(part, Heading):
        console.print(f"\n[bold]{escape(part.text)}[/]", highlight=False)
    elif isinstance(part, Text):
        console.print(escape(part.text), highlight=False)
    elif isinstance(part, Bullets):
        console.print(*map(escape, part.items), sep="\n", highlight=False)


def print_table(console: Console, table: Table) -> None:
    """Print a table; where it does not fit, with the headings of numbers in several lines, and wider than the
    console where that still would cut numbers off: a terminal breaks lines, and a file has room.
    """
    anything = console.options.update(max_width=_ANY)
    made = _rich(table)
    if Measurement.get(console, anything, made).maximum > console.width:
        made = _rich(table, tight=True)
        least = Measurement.get(console, anything, made).minimum
        console = Console(file=console.file, width=max(console.width, least))
    console.print(made)


def _rich(table: Table, *, tight: bool = False) -> Rich:
    """tight: columns of numbers no wider than these and a word of their heading."""
    made = Rich(title=table.title, box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for k, column in enumerate(table.columns):
        # A name stays in one line where it can, a number always.
        longest = max(map(len, column.cells), default=0)
        name = None if k else min(_NAME, longest)
        wide = max(longest, *map(len, column.head.split())) if tight and column.numeric else None
        side: Literal["left", "right"] = "right" if column.numeric else "left"
        made.add_column(column.head, justify=side, overflow="fold", min_width=name, width=wide)
    for row in table.rows:
        made.add_row(*map(escape, row))
    return made
