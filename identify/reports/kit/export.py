"""Everything a report shows as files: figures as PNG and SVG, tables and the numbers behind figures as CSV
with units in their headers.

It works on any document (`identify.reports.kit.document`), so a new kind of report has it for nothing.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator

import numpy as np

from identify.reports.kit import figures, typeset
from identify.reports.kit.cells import Curves, Number, Table
from identify.reports.kit.document import Document

_DPI = 200
_DIGITS = ".9g"
Contents = Iterator[tuple[str, bytes]]


def contents(document: Document) -> Contents:
    """Names and contents of all files, in reading order: `figure03_parameters.svg`, `.png`, `.csv`,
    `table05_parameters.csv`.
    """
    for number, one in enumerate(document.drawn, 1):
        name = f"figure{number:02d}_{_slug(one.title or 'overview')}"
        with figures.style():
            yield f"{name}.svg", figures.outlined(one.figure)
        width, height = one.figure.get_size_inches()
        yield f"{name}.png", typeset.png(one.svg, width, height, _DPI)
        for ending, part in zip(_endings([part.title for part in one.data]), one.data, strict=True):
            yield f"{name}{ending}.csv", _csv(part)
    for number, table in enumerate(document.tables, 1):
        yield f"table{number:02d}_{_slug(table.title)}.csv", _csv(table)


def _endings(titles: list[str]) -> list[str]:
    """What tells the files of a figure's parts apart: nothing for one, their titles, or numbers too where
    titles come out alike.
    """
    endings = ["_" + _slug(title) for title in titles] if len(titles) > 1 else [""] * len(titles)
    return (
        endings
        if len(set(endings)) == len(endings)
        else [f"{ending}_{number}" for number, ending in enumerate(endings, 1)]
    )


def _slug(text: str) -> str:
    """A title as part of a file's name."""
    return re.sub(r"[^a-z0-9.+-]+", "_", text.lower()).strip("_")[:60]


def _csv(data: Table | Curves) -> bytes:
    """One header line with units; numbers of a table as they are in the result, nine digits of a curve; notes
    as comments above.
    """
    stream = io.StringIO()
    if isinstance(data, Curves):
        stream.writelines(f"# {line}\n" for line in data.note.splitlines())
        csv.writer(stream, lineterminator="\n").writerow(column.head for column in data.columns)
        np.savetxt(stream, data.values, delimiter=",", fmt=f"%{_DIGITS}")
    else:
        csv.writer(stream, lineterminator="\n").writerows(_table(data))
    return stream.getvalue().encode()


def _table(table: Table) -> Iterable[list[str]]:
    yield [column.head for column in table.columns]
    for row in table.rows:
        yield [_cell(cell) for cell in row]


def _cell(cell: str) -> str:
    if isinstance(cell, Number):
        return "" if np.isnan(cell.value) else repr(cell.value)
    return cell
