"""The HTML report of identified joints, from the parts it shares with the page of a fit (`html`)."""

from __future__ import annotations

from typing import Any

from identify.reports.fit.html import render
from identify.reports.joints import tables as joints_tables
from identify.reports.joints.figure import scale
from identify.results.joints import CurveResult, JointsResult, Panel


def page(result: JointsResult) -> str:
    """The whole page of identified joints."""
    labels = [
        (f"curve{number}", label, found) for number, (label, found) in enumerate(result.curves.items(), 1)
    ]
    return render(
        "joints.html.j2",
        "joints.js",
        {"curves": [_curve(anchor, found) for anchor, _, found in labels]},
        result,
        sections=[
            ("verdict", "Verdict"),
            *((anchor, label) for anchor, label, _ in labels),
            ("asked", "Study"),
            ("provenance", "Provenance"),
        ],
        tiles=joints_tables.tiles(result),
        labels=labels,
        value_table=joints_tables.value_table,
    )


def _curve(anchor: str, found: CurveResult) -> dict[str, Any]:
    return {
        "id": anchor,
        "panels": [
            _panel(name if len(found.panels) > 1 else "", panel) for name, panel in found.panels.items()
        ],
    }


def _panel(name: str, panel: Panel) -> dict[str, Any]:
    (x_factor, x_unit), (y_factor, y_unit) = scale(panel.x_unit), scale(panel.y_unit)
    series = [
        {"name": n, "look": s.look, "x": x_factor * s.x, "y": y_factor * s.y} for n, s in panel.series.items()
    ]
    return {
        "title": name,
        "x": f"{panel.x_label} ({x_unit})",
        "y": f"{panel.y_label} ({y_unit})",
        "series": series,
    }
