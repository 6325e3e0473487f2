"""Which result is reported by which list of sections, as the table of analyses says, and what of it the
terminal shows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from rich.console import Console

from identify.core.analyses import OF_KIND
from identify.core.errors import InputError
from identify.core.registry import load
from identify.measured.finding import STUDY, Finding
from identify.reports.kit.report import Report
from identify.reports.kit.terminal import show
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


_MARK = {"fail": "[red]fail[/]", "warn": "[yellow]warn[/]", "info": "info"}
_MOST = 3
"""Findings of a kind that are printed; the rest is counted."""


def print_report(result: Any) -> None:
    """Verdict, notes, and the tables that a terminal has room for."""
    show(result, report_of(result))


def print_findings(findings: Mapping[str, Sequence[Finding]], *, whole: bool = True) -> None:
    """One line per finding of the checks, of a kind the first three, which are the worst.

    whole: False where a study could not be looked at as a whole.
    """
    console = Console()
    for name, found in findings.items():
        for finding, left in _shown(found):
            console.print(f"{name}: {_MARK[finding.level]} {finding.sentence}", highlight=False)
            if left:
                console.print(
                    f"{name}: {_MARK[finding.level]} ... and {left} more of this kind", highlight=False
                )
        failed = sum(finding.level == "fail" for finding in found)
        if failed or whole or name != STUDY:
            said = f"{failed} failed" if failed else "no check failed"
            console.print(f"{name}: {said}", highlight=False)


def _shown(findings: Sequence[Finding]) -> Iterator[tuple[Finding, int]]:
    """The findings to print, and behind the last of a kind how many more there are."""
    kinds = [(one.level, one.check) for one in findings]
    so_far: Counter[tuple[str, str]] = Counter()
    for finding, kind in zip(findings, kinds, strict=True):
        so_far[kind] += 1
        if so_far[kind] <= _MOST:
            last = so_far[kind] == _MOST
            yield finding, kinds.count(kind) - _MOST if last else 0
