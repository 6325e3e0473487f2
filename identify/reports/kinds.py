"""Which result is reported by which list of sections: as the table of analyses says."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from identify.core.analyses import OF_KIND, load
from identify.core.errors import InputError
from identify.reports.kit.report import Report
from identify.results import file as result_file
from identify.results.fit import FitResult


def report_of(result: Any) -> Report:
    """The sections from which the kit makes page, PDF, export and what the terminal shows."""
    report: Report = import_module(OF_KIND[result.KIND].report).report(result)
    return report


def read_any(path: Path) -> Any:
    """The result in a file, whichever kind it is; InputError for a file that is no result of a reported
    kind.
    """
    kind = result_file.kind_of(path)
    if kind in OF_KIND:
        return result_file.read(path, load(OF_KIND[kind].result))
    if kind in ("", result_file.UNFINISHED):
        return result_file.read(path, FitResult)  # says what is wrong with it
    raise InputError(str(path), f"a result of kind {kind!r}", "one of " + ", ".join(OF_KIND))
