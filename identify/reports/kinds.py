"""The kinds of reports: which result gives which page and which document.  A new kind is one more entry of
`KINDS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.reports.batch import html as batch_html
from identify.reports.batch import pdf as batch_pdf
from identify.reports.compare import html as compare_html
from identify.reports.compare import pdf as compare_pdf
from identify.reports.discovery import html as discovery_html
from identify.reports.discovery import pdf as discovery_pdf
from identify.reports.explain import html as explain_html
from identify.reports.explain import pdf as explain_pdf
from identify.reports.fit import html, pdf
from identify.reports.joints import html as joints_html
from identify.reports.joints import pdf as joints_pdf
from identify.reports.kit.document import Document
from identify.reports.map import html as map_html
from identify.reports.map import pdf as map_pdf
from identify.reports.modes import html as modes_html
from identify.reports.modes import pdf as modes_pdf
from identify.reports.motion import html as motion_html
from identify.reports.motion import pdf as motion_pdf
from identify.results import file as result_file
from identify.results import fit as results
from identify.results.batch import BatchResult
from identify.results.comparison import Comparison
from identify.results.discovery import DiscoveryResult
from identify.results.explain import ExplainResult
from identify.results.joints import JointsResult
from identify.results.map import MapResult
from identify.results.modes import ModesResult
from identify.results.motion import MotionResult


@dataclass(frozen=True)
class ReportKind:
    """result: the class of the result (`KIND` names it, `identify.results.fit` reads it); page: its HTML;
    document: its PDF in the making, from which figures and data are exported too.  Both print the same
    tables.
    """

    result: type[Any]
    page: Callable[[Any], str]
    document: Callable[[Any], Document]


_ALL = (
    ReportKind(results.FitResult, html.page, pdf.document),
    ReportKind(MotionResult, motion_html.page, motion_pdf.document),
    ReportKind(ExplainResult, explain_html.page, explain_pdf.document),
    ReportKind(JointsResult, joints_html.page, joints_pdf.document),
    ReportKind(ModesResult, modes_html.page, modes_pdf.document),
    ReportKind(DiscoveryResult, discovery_html.page, discovery_pdf.document),
    ReportKind(Comparison, compare_html.page, compare_pdf.document),
    ReportKind(BatchResult, batch_html.page, batch_pdf.document),
    ReportKind(MapResult, map_html.page, map_pdf.document),
)
KINDS: dict[str, ReportKind] = {kind.result.KIND: kind for kind in _ALL}


def read_any(path: Path) -> Any:
    """The result in a file, whichever kind it is; InputError for a file that is no result of a reported
    kind.
    """
    kind = result_file.kind_of(path)
    if kind in KINDS:
        return result_file.read(path, KINDS[kind].result)
    if kind in ("", result_file.UNFINISHED):
        return result_file.read(path, results.FitResult)  # says what is wrong with it
    raise InputError(str(path), f"a result of kind {kind!r}", "one of " + ", ".join(KINDS))
