"""The PDF report of identified joints: the same tables as its HTML page, and printed figures."""

from __future__ import annotations

import numpy as np

from identify.reports.joints import figure as joints_figure
from identify.reports.joints import tables as joints_tables
from identify.reports.kit import figures
from identify.reports.kit.cells import Column, Curves, sentence
from identify.reports.kit.document import Document
from identify.results.joints import CurveResult, JointsResult


def document(result: JointsResult) -> Document:
    """The PDF of identified joints, in the making."""
    made = Document()
    with figures.style():
        made.opening(result, joints_tables.tiles(result))
        for label, found in result.curves.items():
            made.add("heading", label)
            made.figure(
                joints_figure.curve(found), f"{found.title}: measured and identified.", *_data(label, found)
            )
            made.table(joints_tables.value_table(label, found))
            for said in found.said:
                made.add("paragraph", sentence(said))
    made.sources(result)
    return made


def _data(label: str, found: CurveResult) -> list[Curves]:
    """The numbers behind a figure, in SI: a set per series."""
    sets = []
    for name, panel in found.panels.items():
        for what, series in panel.series.items():
            title = ", ".join(part for part in (label, name, what) if part)
            columns = (Column(panel.x_label, panel.x_unit), Column(panel.y_label, panel.y_unit))
            sets.append(Curves(title, columns, np.column_stack([series.x, series.y])))
    return sets
