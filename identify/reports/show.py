"""Print what a run found: what its report has for the terminal; and the findings of a check."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.console import Console

from identify.measured.finding import STUDY, Finding
from identify.reports.kinds import report_of
from identify.reports.kit.terminal import show

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
