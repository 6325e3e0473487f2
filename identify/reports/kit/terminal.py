"""What the terminal shows of a report: verdict, notes, and the parts that are meant for it."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table as Rich

from identify.reports.kit.cells import Table
from identify.reports.kit.report import TERMINAL, Bullets, Heading, Part, Report, Tabular, Text, visible
from identify.results.header import Header


def show(result: Header, report: Report) -> None:
    """Print what a result says."""
    console = Console()
    for said in result.verdict:
        console.print(escape(said), highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)
    sections = [report.opening, *(section.parts for section in report.sections)]
    for part in (part for parts in sections for part in visible(parts, TERMINAL)):
        _show(console, part)


def _show(console: Console, part: Part) -> None:
    if isinstance(part, Tabular):
        console.print(rich_table(part.table, part.terminal, part.rows))
        if part.rows is not None and len(part.table.rows) > part.rows:
            console.print(f"and {len(part.table.rows) - part.rows} more, in the report", highlight=False)
    elif isinstance(part, Heading):
        console.print(f"\n[bold]{escape(part.text)}[/]", highlight=False)
    elif isinstance(part, Text):
        console.print(escape(part.text), highlight=False)
    elif isinstance(part, Bullets):
        console.print(*map(escape, part.items), sep="\n", highlight=False)


def rich_table(table: Table, headings: tuple[str, ...] = (), rows: int | None = None) -> Rich:
    """The columns of a table with these headings, without headings all of them; rows: only so many."""
    shown = [k for k, column in enumerate(table.columns) if not headings or column.heading in headings]
    made = Rich(title=table.title, box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for k in shown:
        numeric = table.columns[k].numeric
        made.add_column(table.columns[k].head, justify="right" if numeric else "left", no_wrap=numeric)
    for row in table.rows[:rows]:
        made.add_row(*(escape(row[k]) for k in shown))
    return made
