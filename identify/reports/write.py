"""Write the reports of a run beside its result file, from that file alone; of several runs, the report of
their comparison.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from identify.core.atomic import write_atomically
from identify.core.interruption import check
from identify.reports.kinds import read_any, report_of
from identify.reports.kit.document import document
from identify.reports.kit.export import contents
from identify.reports.kit.page import page
from identify.results.comparison import compared

_ELSEWHERE = "move the result file there"


def write_reports(path: Path, *others: Path, export: Path | None = None) -> list[Path]:
    """Write `<stem>.html` and `<stem>.pdf` beside the result file `path` and return their paths; with others,
    of their comparison.

    export: a folder for every figure as PNG and SVG and all data as CSV.  The same result gives the same
    bytes. Raises InputError for a file that is no result, and where a report cannot be written.
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
        _write(folder / name, content, "choose another folder with `--export`")
    return [folder]


def _write(target: Path, content: bytes, fix: str) -> None:
    check()
    write_atomically(target, partial(Path.write_bytes, data=content), fix)
