"""The kinds of reports: which result gives which page and which document.  A new kind is one more entry of `KINDS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identify import results
from identify.batch_result import BatchResult
from identify.comparison import Comparison
from identify.discovery.result import DiscoveryResult
from identify.errors import InputError
from identify.joints.result import JointsResult
from identify.map_result import MapResult
from identify.modes_result import ModesResult
from identify.motion.explain_result import ExplainResult
from identify.motion_result import MotionResult
from identify.reports import (
    batch_html,
    batch_pdf,
    compare_html,
    compare_pdf,
    discovery_html,
    discovery_pdf,
    explain_html,
    explain_pdf,
    html,
    joints_html,
    joints_pdf,
    map_html,
    map_pdf,
    modes_html,
    modes_pdf,
    motion_html,
    motion_pdf,
    pdf,
)
from identify.reports.document import Document


@dataclass(frozen=True)
class ReportKind:
    """result: the class of the result (`KIND` names it, `identify.results` reads it); page: its HTML; document: its PDF in the making,
    from which figures and data are exported too.  Both print the same tables.
    """

    result: type[Any]
    page: Callable[[Any], str]
    document: Callable[[Any], Document]


_ALL = (
    ReportKind(results.Result, html.page, pdf.document),
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
    """The result in a file, whichever kind it is; InputError for a file that is no result of a reported kind."""
    kind = results.kind_of(path)
    if kind in KINDS:
        return results.read(path, KINDS[kind].result)
    if kind in ("", results.UNFINISHED):
        return results.read(path)  # says what is wrong with it
    raise InputError(str(path), f"a result of kind {kind!r}", "one of " + ", ".join(KINDS))
