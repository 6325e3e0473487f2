"""The HTML report of a modal analysis, from the parts it shares with the page of a fit (`html`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.reports.fit import measurement_tables, pick
from identify.reports.fit.html import STAGES, frf_data, render, robot_data
from identify.reports.kit.cells import number, percent, unit
from identify.reports.kit.shapes import analysed_views
from identify.reports.modes import tables as modes_tables
from identify.results.modes import AnalysedMeasurement, ModesResult
from identify.results.tables import Geometry

NO_SHAPES = (
    "Shapes are not drawn: where the measured points are is not known. They are in the modal table and the"
    " universal file."
)
_SECTIONS = (
    ("verdict", "Verdict"),
    ("modes", "Modes"),
    ("robot", "Shapes"),
    ("stabilisation", "Stabilisation"),
    ("frf", "FRFs"),
    ("gap", "Gap map"),
    ("errors", "Errors"),
    ("rejected", "Rejected"),
    ("asked", "Settings"),
    ("provenance", "Provenance"),
)


def page(result: ModesResult) -> str:
    """The whole page of a modal analysis."""
    measurements = list(result.measurements.values())
    moving = [m for m in measurements if m.geometry is not None and m.shapes is not None and len(m.shapes)]
    return render(
        "modes.html.j2",
        "modes.js",
        {
            "measurements": [_measurement(m) for m in measurements],
            "curves": {"measured": "measured", "fitted": "rebuilt from the modes"},
        },
        result=result,
        measurements=measurements,
        sections=_SECTIONS,
        moving=moving,
        stages=[("measured", STAGES["measured"])] if moving else [],
        no_shapes=NO_SHAPES,
        tiles=modes_tables.tiles(result),
        modes_tables=modes_tables,
        frf_tables=[measurement_tables.frf_table(m.name, m.frf) for m in measurements],
    )


def _measurement(m: AnalysedMeasurement) -> dict[str, Any]:
    return {
        "name": m.name,
        "use": "",
        "robot": None if m.geometry is None or m.shapes is None else _robot(m, m.geometry),
        "frf": frf_data(m.frf),
        "mac": _auto_mac(m),
        "diagram": _diagram(m),
    }


def _robot(m: AnalysedMeasurement, geometry: Geometry) -> dict[str, Any]:
    shaped = robot_data(
        geometry, m.frf, analysed_views(m), pick.nodes(m.modes.references), ("references", "reference")
    )
    return {**shaped, "measured": pick.nodes([*m.frf.output, *m.frf.input])}


def _auto_mac(m: AnalysedMeasurement) -> dict[str, Any] | None:
    if len(m.modes.frequency_hz) < 2:
        return None
    labels = [number(hz) for hz in m.modes.frequency_hz]
    return {
        "rows": labels,
        "columns": labels,
        "down": "Mode (Hz)",
        "across": "Mode (Hz)",
        "values": m.modes.auto_mac,
    }


def _diagram(m: AnalysedMeasurement) -> dict[str, Any]:
    d, modes = m.diagram, m.modes
    poles = {
        kind: {
            "order": d.order[rows],
            "frequency": d.frequency_hz[rows],
            "damping": 100 * d.damping_ratio[rows],
        }
        for kind, rows in (("stable", d.stable), ("unstable", ~d.stable))
    }
    chosen = [
        {"frequency": hz, "label": f"{number(hz)} Hz, damping {percent(ratio)} %"}
        for hz, ratio in zip(modes.frequency_hz, modes.damping_ratio, strict=True)
    ]
    indicator = np.where(d.indicator > 0, d.indicator, np.nan).T
    return {
        "poles": poles,
        "lines": d.line_hz,
        "indicator": indicator,
        "unit": unit(m.frf.unit),
        "modes": chosen,
        "highest": m.highest_order,
    }
