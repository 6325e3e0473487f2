"""The HTML report of a motion, from the parts it shares with the page of a fit (`html`)."""

from __future__ import annotations

from typing import Any

from identify.reports.fit import tables
from identify.reports.fit.html import render
from identify.reports.motion import tables as motion_tables
from identify.reports.motion.pick import Panel, moving, panels
from identify.results.motion import MotionResult, RecordResult


def page(result: MotionResult) -> str:
    """The whole page of a simulated or fitted motion."""
    return render(
        "motion.html.j2",
        "motion.js",
        {"joints": list(result.joints), "records": [_record(record) for record in result.records.values()]},
        result,
        sections=_sections(result),
        tiles=motion_tables.tiles(result),
        motion_tables=motion_tables,
        parameters=None if result.parameters is None else tables.parameter_rows(result.parameters),
    )


def _sections(result: MotionResult) -> list[tuple[str, str]]:
    fitted = [("parameters", "Parameters")] if result.parameters is not None else []
    compared = [("errors", "Errors")] if any(record.comparisons for record in result.records.values()) else []
    return [
        ("verdict", "Verdict"),
        ("motion", "Motion"),
        *compared,
        *fitted,
        ("asked", "Study"),
        ("provenance", "Provenance"),
    ]


def _record(record: RecordResult) -> dict[str, Any]:
    use = ", not fitted" if record.use == "validate" else ""
    return {
        "name": record.name + use,
        "moving": moving(record),
        "panels": [_panel(panel) for panel in panels(record)],
    }


def _panel(panel: Panel) -> dict[str, Any]:
    curves = [{"name": curve.name, "time": curve.time, "values": curve.values.T} for curve in panel.curves]
    return {"label": panel.label, "unit": panel.unit, "curves": curves}
