"""Write the reports of a run beside its result file, from that file alone."""

from __future__ import annotations

import os
from pathlib import Path

from identify import results
from identify.errors import InputError
from identify.modes_result import ModesResult
from identify.reports import html, modes_html, modes_pdf, pdf


def write_reports(path: Path) -> list[Path]:
    """Write `<stem>.html` and `<stem>.pdf` beside the result file `path` and return their paths.

    The same result gives the same bytes.  Raises InputError for a file that is no result, and where a report cannot be written.
    """
    page, document = path.with_suffix(".html"), path.with_suffix(".pdf")
    if results.kind_of(path) == ModesResult.KIND:
        modes = results.read(path, ModesResult)
        made = modes_html.page(modes), modes_pdf.document(modes)
    else:
        result: results.Result = results.read(path)
        made = html.page(result), pdf.document(result)
    _write(page, made[0].encode())
    _write(document, made[1])
    return [page, document]


def _write(path: Path, content: bytes) -> None:
    """Write aside and rename, so that a report is whole or not there."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        aside.write_bytes(content)
        os.replace(aside, path)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise InputError(
            str(path), f"cannot be written ({error})", "a folder with room and permission", "move the result file there"
        ) from error
