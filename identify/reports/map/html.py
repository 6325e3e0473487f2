"""The HTML report of a map of postures, from the parts it shares with the page of a fit (`html`) and of a
batch (`batch_html`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.reports.batch.html import posture_data
from identify.reports.fit.html import render
from identify.reports.kit.posture_pick import map_postures_of
from identify.reports.map import tables as map_tables
from identify.results.map import MapResult

FRFS = 40
"""Postures whose FRFs are on the page, evenly chosen; all are in the result file."""
_SECTIONS = (
    ("verdict", "Verdict"),
    ("postures", "Maps"),
    ("frf", "Tool FRFs"),
    ("table", "Postures"),
    ("asked", "Study"),
    ("provenance", "Provenance"),
)


def page(result: MapResult) -> str:
    """The whole page of a map."""
    rows = chosen(result, FRFS)
    data = {
        "postures": posture_data(map_postures_of(result), "frequency of mode 1"),
        "tool": tool_data(result, rows),
    }
    return render(
        "map.html.j2",
        "postures.js",
        data,
        result,
        sections=_SECTIONS,
        tiles=map_tables.tiles(result),
        map_tables=map_tables,
        shown=len(rows),
        total=len(result.rows.name),
    )


def chosen(result: MapResult, count: int) -> NDArray[np.intp]:
    """At most so many postures, evenly from the stiffest tool to the softest."""
    order = np.argsort(result.rows.peak_m_per_n.max(axis=1), kind="stable")
    return np.asarray(
        order[np.unique(np.linspace(0, len(order) - 1, min(count, len(order))).round().astype(int))]
    )


def tool_data(result: MapResult, rows: NDArray[np.intp]) -> dict[str, Any]:
    """Direct receptances of the tool at chosen postures, µm/N, with half their bands."""
    r = result.rows
    axes = range(3)
    return {
        "names": [r.name[row] for row in rows],
        "line": result.line_hz,
        "magnitude": 1e6
        * np.abs(r.receptance_m_per_n[rows][:, :, axes, axes]).astype(float).transpose(0, 2, 1),
        "phase": np.rad2deg(np.angle(r.receptance_m_per_n[rows][:, :, axes, axes]))
        .astype(float)
        .transpose(0, 2, 1),
        "band": 1e6 * r.band_95[rows][:, :, axes, axes].astype(float).transpose(0, 2, 1),
    }
