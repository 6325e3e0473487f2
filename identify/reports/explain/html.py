"""The HTML report of an explained motion, from the parts it shares with the page of a fit (`html`)."""

from __future__ import annotations

from typing import Any

from identify.reports.explain import tables as explain_tables
from identify.reports.explain.pick import bars, history
from identify.reports.fit.html import render
from identify.results.explain import Curves, ExplainResult, TargetResult


def page(result: ExplainResult) -> str:
    """The whole page of an explained motion."""
    targets = list(result.targets.values())
    return render(
        "explain.html.j2",
        "explain.js",
        {"targets": [_target(found) for found in targets]},
        result,
        sections=_sections(targets),
        targets=targets,
        tiles=explain_tables.tiles(result),
        explain_tables=explain_tables,
    )


def _sections(targets: list[TargetResult]) -> list[tuple[str, str]]:
    own = [(found.target, explain_tables.title(found).split(" (")[0]) for found in targets]
    return [
        ("verdict", "Verdict"),
        *own,
        ("unknown", "Cannot say"),
        ("asked", "Study"),
        ("provenance", "Provenance"),
    ]


def _target(found: TargetResult) -> dict[str, Any]:
    names, values = bars(found)
    return {
        "name": found.target,
        "unit": explain_tables.scale(found)[1],
        "joints": found.joints,
        "records": [_record(found, curves) for curves in found.curves.values()],
        "steps": list(names),
        "shares": values.T,
        "gap": [found.gap_start, found.gap],
    }


def _record(found: TargetResult, curves: Curves) -> dict[str, Any]:
    use = "held out" if curves.use == "validate" else "fitted"
    joints = [vars(history(found, curves, row)) for row in range(len(found.joints))]
    time_s = joints[0]["time_s"]
    return {
        "name": f"{curves.name}, {use}",
        "time": time_s,
        "joints": [{k: v for k, v in one.items() if k != "time_s"} for one in joints],
    }
