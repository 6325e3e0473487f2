"""Write the reports of a run beside its result file, from that file alone; of several runs, the report of
their comparison.

On demand also everything a report shows as files: figures as PNG and SVG, tables and the numbers behind
figures as CSV with units in their headers; it works on any document, so a new kind of report has it for
nothing.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from identify.core.atomic import check_writable, write_atomically
from identify.core.interruption import check
from identify.core.text_input import csv_text
from identify.reports.kinds import read_any, report_of
from identify.reports.kit import figures
from identify.reports.kit.cells import Curves, Number, Table
from identify.reports.kit.document import Document, document, png
from identify.reports.kit.page import page
from identify.results.comparison import compared

_ELSEWHERE = "move the result file there"
_FOLDER = "choose another folder with `--export`"
_DPI = 200
_DIGITS = ".9g"
Contents = Iterator[tuple[str, bytes]]


def write_reports(path: Path, *others: Path, export: Path | None = None) -> list[Path]:
    """Write `<stem>.html` and `<stem>.pdf` beside the result file `path` and return their paths; with others,
    of their comparison.

    export: a folder for every figure as PNG and SVG and all data as CSV.  The same result gives the same
    bytes. Raises InputError for a file that is no result, and where a report cannot be written, before
    anything is.
    """
    return list(reports(path, *others, export=export))


def reports(path: Path, *others: Path, export: Path | None = None) -> Iterator[Path]:
    """The same, each path as soon as it is written: the page, which takes a fifth of the time, first."""
    files = (path, *others)
    check()
    result = compared(files) if others else read_any(path)
    stem = path.with_name(_together(files)) if others else path.with_suffix("")
    page_path, pdf_path = (stem.with_name(f"{stem.name}{suffix}") for suffix in (".html", ".pdf"))
    report = report_of(result)
    for target in (page_path, pdf_path):
        check_writable(target, _ELSEWHERE)
    if export:
        check_writable(export / "tables.csv", _FOLDER)
    _write(page_path, page(result, report).encode(), _ELSEWHERE)
    yield page_path
    printed = document(result, report)
    _write(pdf_path, printed.compile(result), _ELSEWHERE)
    yield pdf_path
    if export:
        yield from _export(list(contents(printed)), export)


def _together(files: Sequence[Path]) -> str:
    """The name of a comparison's report."""
    stems = [file.stem for file in files]
    return "_".join(stems if len(stems) <= 3 else [*stems[:1], f"{len(stems) - 1}_others"]) + "_compare"


def _export(found: Sequence[tuple[str, bytes]], folder: Path) -> list[Path]:
    for name, content in found:
        _write(folder / name, content, _FOLDER)
    return [folder]


def _write(target: Path, content: bytes, fix: str) -> None:
    check()
    write_atomically(target, partial(Path.write_bytes, data=content), fix)


def contents(document: Document) -> Contents:
    """Names and contents of all files, in reading order: `figure03_parameters.svg`, `.png`, `.csv`,
    `table05_parameters.csv`.
    """
    for number, one in enumerate(document.drawn, 1):
        name = f"figure{number:02d}_{_slug(one.title or 'overview')}"
        with figures.style():
            yield f"{name}.svg", figures.outlined(one.figure)
        width, height = one.figure.get_size_inches()
        yield f"{name}.png", png(one.svg, width, height, _DPI)
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
    if isinstance(data, Table):
        return csv_text(_table(data)).encode()
    stream = io.StringIO()
    stream.writelines(f"# {line}\n" for line in data.note.splitlines())
    stream.write(csv_text([[column.head for column in data.columns]]))
    np.savetxt(stream, data.values, delimiter=",", fmt=f"%{_DIGITS}")
    return stream.getvalue().encode()


def _table(table: Table) -> Iterable[list[str]]:
    yield [column.head for column in table.columns]
    for row in table.rows:
        yield [_cell(cell) for cell in row]


def _cell(cell: str) -> str:
    if isinstance(cell, Number):
        return "" if np.isnan(cell.value) else repr(cell.value)
    return cell
