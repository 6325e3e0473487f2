"""Write the reports of a run beside its result file, from that file alone."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from identify import results
from identify.modes_result import ModesResult
from identify.reports import html, modes_html, modes_pdf, pdf
from identify.whole import write_whole


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
    for target, content in ((page, made[0].encode()), (document, made[1])):
        write_whole(target, partial(Path.write_bytes, data=content), "move the result file there")
    return [page, document]
