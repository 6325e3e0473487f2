"""Write the reports of a run beside its result file, from that file alone."""

from __future__ import annotations

import os
from pathlib import Path

from identify import results
from identify.errors import InputError
from identify.reports import html, pdf


def write_reports(path: Path) -> list[Path]:
    """Write `<stem>.html` and `<stem>.pdf` beside the result file `path` and return their paths.

    The same result gives the same bytes.  Raises InputError for a file that is no result, and where a report cannot be written.
    """
    result = results.read(path, results.Result)
    page, document = path.with_suffix(".html"), path.with_suffix(".pdf")
    _write(page, html.page(result).encode())
    _write(document, pdf.document(result))
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
