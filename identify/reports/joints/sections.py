"""The report of identified joints: a section per curve."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.core.text import capital
from identify.reports.joints import tables
from identify.reports.joints.figure import curve, scale
from identify.reports.kit.cells import Column, Curves, sentence
from identify.reports.kit.report import (
    EVERYWHERE,
    Bullets,
    Drawing,
    Part,
    Report,
    Section,
    Tabular,
    Text,
    origin,
)
from identify.results.joints import CurveResult, JointsResult, Panel

_TERMINAL = ("Value", "Identified", "95 %", "Unit", "Identifiability", "Described")


def report(result: JointsResult) -> Report:
    """What is said of identified joints."""
    sections = [_section(f"curve{k}", *one) for k, one in enumerate(result.curves.items(), 1)]
    return Report(tables.tiles(result), (), [*sections, *origin(result)])


def _section(anchor: str, label: str, found: CurveResult) -> Section:
    parts: list[Part] = [
        Drawing(
            f"{anchor}-plot",
            partial(curve, found),
            f"{found.title}: measured and identified.",
            lambda: _curves(label, found),
        ),
        Tabular(tables.value_table(label, found), sort=anchor, terminal=_TERMINAL, on=EVERYWHERE),
        *_said([sentence(text) for text in found.said]),
    ]
    panels = [_panel(name if len(found.panels) > 1 else "", panel) for name, panel in found.panels.items()]
    data = {"curves": [{"id": anchor, "panels": panels}]}
    return Section(anchor, label, parts, data=data, scripts=("joints.js",))


def _said(sentences: list[str]) -> list[Part]:
    """Remarks: one as a note, several as a list."""
    return [Bullets(sentences)] if len(sentences) > 1 else [Text(one, "note") for one in sentences]


def _panel(name: str, panel: Panel) -> dict[str, Any]:
    (x_factor, x_unit), (y_factor, y_unit) = scale(panel.x_unit), scale(panel.y_unit)
    series = [
        {"name": n, "look": s.look, "x": x_factor * s.x, "y": y_factor * s.y} for n, s in panel.series.items()
    ]
    x, y = f"{capital(panel.x_label)} ({x_unit})", f"{capital(panel.y_label)} ({y_unit})"
    return {"title": name, "x": x, "y": y, "series": series}


def _curves(label: str, found: CurveResult) -> list[Curves]:
    """The numbers behind a figure, in SI: a set per series."""
    sets = []
    for name, panel in found.panels.items():
        for what, series in panel.series.items():
            title = ", ".join(part for part in (label, name, what) if part)
            columns = (Column(panel.x_label, panel.x_unit), Column(panel.y_label, panel.y_unit))
            sets.append(Curves(title, columns, np.column_stack([series.x, series.y])))
    return sets
