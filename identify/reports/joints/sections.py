"""The report of identified joints: a section per curve, with what was measured, and the curve over it."""

from __future__ import annotations

import numpy as np

from identify.core.text import capital
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, Curves, Table, interval, number, ready, sentence, unit, words
from identify.reports.kit.report import (
    EVERYWHERE,
    Bullets,
    Part,
    Report,
    Section,
    Tabular,
    Text,
    Tiles,
    origin,
)
from identify.results import joints as results
from identify.results.joints import CurveResult, JointsResult

_TERMINAL = ("Value", "Identified", "95 %", "Unit", "Identifiability", "Described")
_SHOWN = {"rad": (1e3, "mrad"), "": (1.0, "")}
"""How small angles are shown: factor and unit."""


def report(result: JointsResult) -> Report:
    """What is said of identified joints."""
    sections = [_section(f"curve{k}", *one) for k, one in enumerate(result.curves.items(), 1)]
    return Report(_tiles(result), (), [*sections, *origin(result)])


def _tiles(result: JointsResult) -> Tiles:
    status = [status for found in result.curves.values() for status in found.values.status]
    sure = f"{status.count('determined')} of {len(status)}"
    return (
        ("Curves", str(len(result.curves)), "each from a run of its own"),
        ("Determined", sure, "half the 95 % interval below two thirds of the value"),
    )


def _section(anchor: str, title: str, found: CurveResult) -> Section:
    several = len(found.panels) > 1
    panels = [_panel(name if several else "", panel) for name, panel in found.panels.items()]
    caption = f"{found.title}: measured and identified."
    plot = Plot(f"{anchor}-plot", Column(""), panels, caption, height=1.5 if several else 2.6)
    values = Tabular(value_table(title, found), sort=anchor, terminal=_TERMINAL, on=EVERYWHERE)
    said = [sentence(text) for text in found.said]
    remarks: list[Part] = [Bullets(said)] if len(said) > 1 else [Text(one, "note") for one in said]
    return Section(anchor, title, [plot.drawing(lambda: _curves(title, found)), values, *remarks])


def _panel(title: str, panel: results.Panel) -> Panel:
    (x_factor, x_unit), (y_factor, y_unit) = (
        _SHOWN.get(of, (1.0, unit(of))) for of in (panel.x_unit, panel.y_unit)
    )
    lines = [
        Line(name, x_factor * s.x, y_factor * s.y, points=s.look not in ("line", "noisy"), look=s.look)
        for name, s in panel.series.items()
    ]
    x, y = Column(capital(panel.x_label), x_unit), Column(capital(panel.y_label), y_unit)
    return Panel(y, lines, x=x, title=title)


def _curves(title: str, found: CurveResult) -> list[Curves]:
    """The numbers behind a figure, in SI: a set per series."""
    return [
        Curves(
            ", ".join(part for part in (title, name, what) if part),
            [Column(panel.x_label, panel.x_unit, own.x), Column(panel.y_label, panel.y_unit, own.y)],
        )
        for name, panel in found.panels.items()
        for what, own in panel.series.items()
    ]


def value_table(title: str, found: CurveResult) -> Table:
    """Values with their intervals, and what the robot's description says where it says anything."""
    v = found.values
    described = bool(np.isfinite(v.expected).any())
    ends = zip(v.low_95, v.high_95, strict=True)
    columns = [
        words("Value", v.name),
        Column("Identified", "", v.value),
        Column("95 %", "", ("taken as known" if a == b else interval(a, b, 4) for a, b in ends), ready),
        words("Unit", map(unit, v.unit)),
        words("Identifiability", v.status),
        *([Column("Described", "", v.expected)] if described else []),
        words("Meaning", v.meaning),
    ]
    said = f"RMS residual: {number(found.rms, 3)} {unit(found.unit)}, {found.samples} samples."
    more = " Described: the same combination by the robot file." if described else ""
    return Table(title, columns, said + more)
