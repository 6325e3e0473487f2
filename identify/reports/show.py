"""Print what a run found: what its report has for the terminal; and the findings of a check."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console

from identify.measured.finding import STUDY, Finding
from identify.reports.kinds import report_of
from identify.reports.kit.terminal import show

_MARK = {"fail": "[red]fail[/]", "warn": "[yellow]warn[/]", "info": "info"}


def print_report(result: Any) -> None:
    """Verdict, notes, and the tables that a terminal has room for."""
    show(result, report_of(result))


def print_findings(findings: Mapping[str, Sequence[Finding]], *, whole: bool = True) -> None:
    """One line per finding of the checks; whole: False where a study could not be looked at as a whole."""
    console = Console()
    for name, found in findings.items():
        for finding in found:
            console.print(f"{name}: {_MARK[finding.level]} {finding.sentence}", highlight=False)
        failed = sum(finding.level == "fail" for finding in found)
        if failed or whole or name != STUDY:
            said = f"{failed} failed" if failed else "no check failed"
            console.print(f"{name}: {said}", highlight=False)
