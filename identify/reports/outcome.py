"""A result as it is handled in Python: its tables as mappings of columns, its figures, and how a notebook
shows it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identify.core.analyses import OF_KIND
from identify.core.errors import InputError
from identify.reports.kinds import read_any, report_of
from identify.reports.kit.cells import NONE, Number, Table
from identify.reports.kit.report import (
    PRINT,
    TERMINAL,
    Bullets,
    Drawing,
    Heading,
    Report,
    Tabular,
    Text,
    visible,
)
from identify.results.labels import tree_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import DataTree


class Columns(dict[str, list[Any]]):
    """A table as a mapping of columns, `{"Frequency (Hz)": [...]}`, which `pandas.DataFrame` takes as it is.

    Numbers are those of the result, not rounded; NaN where there is none.  printed: as a report has it.
    """

    def __init__(self, table: Table) -> None:
        super().__init__()
        self.printed = table
        for column in table.columns:
            self[column.head] = [_value(c) for c in column.cells] if column.numeric else list(column.cells)

    def _repr_html_(self) -> str:
        return _html(self.printed)


@dataclass(frozen=True)
class Result:
    """What a run found.

    data: everything, as arrays (`identify.results`); written: the files, the result file first.
    """

    data: Any
    written: tuple[Path, ...]

    @property
    def path(self) -> Path:
        """The result file."""
        return self.written[0]

    @property
    def name(self) -> str:
        """Of the study."""
        return str(self.data.name)

    @property
    def verdict(self) -> tuple[str, ...]:
        """What was found, in sentences."""
        return tuple(self.data.verdict)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must be warned of."""
        return tuple(self.data.notes)

    @cached_property
    def report(self) -> Report:
        """The sections of its report."""
        return report_of(self.data)

    @cached_property
    def tables(self) -> Mapping[str, Columns]:
        """The tables of its report by title; a title that occurs again has a number behind it."""
        found: dict[str, Columns] = {}
        for part in self.report.shown(PRINT):
            if isinstance(part, Tabular):
                found[_new(part.table.title, found)] = Columns(part.table)
        return found

    @property
    def parameters(self) -> Columns:
        """The table of parameters with their 95 % intervals; InputError for a result that has none."""
        title = "Parameters"
        if title not in self.tables:
            found = f"{OF_KIND[self.data.KIND].holds} has no table of parameters"
            fix = f"its tables are in `tables`: {', '.join(self.tables)}"
            raise InputError(str(self.path), found, "a result with fitted parameters", fix)
        return self.tables[title]

    def to_xarray(self) -> DataTree:
        """Everything as labelled arrays with units; InputError where xarray is not installed."""
        return tree_of(self.data)

    @cached_property
    def figures(self) -> tuple[str, ...]:
        """What `plot` can draw."""
        return tuple(self._drawings)

    def plot(self, figure: str = "") -> Figure:
        """A figure of its report, by default the first; InputError for a name that is not in `figures`."""
        from identify.reports.kit.figures import plain_powers, style  # noqa: PLC0415  drawing takes time to import

        wanted = figure or self.figures[0]
        if wanted not in self._drawings:
            raise InputError("figure", repr(figure), "one of " + ", ".join(self.figures))
        make = self._drawings[wanted].figure
        assert make is not None
        with style():
            return plain_powers(make())

    @cached_property
    def _drawings(self) -> dict[str, Drawing]:
        found: dict[str, Drawing] = {}
        for section in self.report.sections:
            for part in visible(section.parts, PRINT):
                if isinstance(part, Drawing) and part.figure is not None:
                    found[_new(section.title, found)] = part
        return found

    def __repr__(self) -> str:
        return "\n".join([f"<{self.data.KIND} of {self.name}, {self.path}>", *self.verdict, *self.notes])

    def _repr_html_(self) -> str:
        """Verdict, notes, and the tables that a terminal has room for."""
        said = "".join(f"<p>{escape(text)}</p>" for text in self.verdict)
        warned = "".join(f"<p><em>Note:</em> {escape(text)}</p>" for text in self.notes)
        shown = map(_part, self.report.shown(TERMINAL))
        return f"<h4>{escape(self.name)}</h4>{said}{warned}{''.join(shown)}"


def read_result(path: Path | str) -> Result:
    """The result in a file, of whichever kind; InputError for a file that is none."""
    return Result(read_any(Path(path)), (Path(path),))


def _part(part: Any) -> str:
    if isinstance(part, Tabular):
        return _html(part.table.part(headings=part.terminal))
    if isinstance(part, Heading):
        return f"<h5>{escape(part.text)}</h5>"
    if isinstance(part, Bullets):
        return "".join(f"<p>{escape(text)}</p>" for text in part.items)
    return f"<p>{escape(part.text)}</p>" if isinstance(part, Text) else ""


def _html(table: Table) -> str:
    head = "".join(f"<th>{escape(column.head)}</th>" for column in table.columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    title = f"<caption>{escape(table.title)}</caption>"
    return f"<table>{title}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _value(cell: str) -> Any:
    if isinstance(cell, Number):
        return cell.value
    return math.nan if cell in (NONE, "") else cell


def _new(title: str, taken: Mapping[str, Any]) -> str:
    """The title, or with the least number that makes it new."""
    number = 2
    name = title
    while name in taken:
        name, number = f"{title} {number}", number + 1
    return name
