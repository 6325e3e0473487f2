"""The kinds of reports: which result is reported by which list of sections.  A new kind is one more entry of
`KINDS`.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.reports.kit.report import Report
from identify.results import file as result_file
from identify.results.batch import BatchResult
from identify.results.comparison import Comparison
from identify.results.discovery import DiscoveryResult
from identify.results.explain import ExplainResult
from identify.results.fit import FitResult
from identify.results.joints import JointsResult
from identify.results.map import MapResult
from identify.results.modes import ModesResult
from identify.results.motion import MotionResult


@dataclass(frozen=True)
class ReportKind:
    """result: the class of the result (`KIND` names it, `identify.results.file` reads it); module: where
    `report(result)` is, imported when it is needed.
    """

    result: type[Any]
    module: str

    def report(self, result: Any) -> Report:
        """The sections from which the kit makes page, PDF, export and what the terminal shows."""
        made: Report = import_module(self.module).report(result)
        return made


_ALL = (
    ReportKind(FitResult, "identify.reports.fit.sections"),
    ReportKind(MotionResult, "identify.reports.motion.sections"),
    ReportKind(ExplainResult, "identify.reports.explain.sections"),
    ReportKind(JointsResult, "identify.reports.joints.sections"),
    ReportKind(ModesResult, "identify.reports.modes.sections"),
    ReportKind(DiscoveryResult, "identify.reports.discovery.sections"),
    ReportKind(Comparison, "identify.reports.compare.sections"),
    ReportKind(BatchResult, "identify.reports.batch.sections"),
    ReportKind(MapResult, "identify.reports.map.sections"),
)
KINDS: dict[str, ReportKind] = {kind.result.KIND: kind for kind in _ALL}


def report_of(result: Any) -> Report:
    """The report of a result of any kind."""
    return KINDS[result.KIND].report(result)


def read_any(path: Path) -> Any:
    """The result in a file, whichever kind it is; InputError for a file that is no result of a reported
    kind.
    """
    kind = result_file.kind_of(path)
    if kind in KINDS:
        return result_file.read(path, KINDS[kind].result)
    if kind in ("", result_file.UNFINISHED):
        return result_file.read(path, FitResult)  # says what is wrong with it
    raise InputError(str(path), f"a result of kind {kind!r}", "one of " + ", ".join(KINDS))
