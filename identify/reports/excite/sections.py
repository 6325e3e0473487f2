"""The report of an exciting motion: the motion over time, its limits, what it promises and whether that came
true in the rehearsal.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.excite import tables
from identify.reports.kit.banded import SCRIPTS, Line, Panel, Plot
from identify.reports.kit.cells import Column
from identify.reports.kit.report import EVERYWHERE, Bullets, Report, Section, Tabular, origin
from identify.results.excite import ExciteResult


def report(result: ExciteResult) -> Report:
    """What is said of an exciting motion."""
    motion, promised = _motion(result), _promised(result)
    sheet = Bullets(
        [
            f"Send the table beside this result, one period of {result.period_s:g} s,"
            f" {result.periods} times without a stop between; it begins and ends at rest.",
            "Run it at a tenth of its speed first, and watch what stands around.",
            "Record motor positions and torques (of transmission errors: link positions) over all periods.",
        ]
    )
    sections = [
        Section(
            "motion",
            "The motion",
            [motion.drawing(), sheet, Tabular(tables.limit_table(result), heading=True, on=EVERYWHERE)],
            "Motion",
            motion.data(),
            SCRIPTS,
        ),
        Section(
            "promised",
            "Promised intervals",
            [promised.drawing(), Tabular(tables.promised_table(result), on=EVERYWHERE)],
            "Promised",
            promised.data(),
            SCRIPTS,
        ),
        Section("series", "Fourier series", [Tabular(tables.series_table(result))], "Series"),
        *origin(result, "Asked"),
    ]
    return Report(tables.tiles(result), [], sections)


def _motion(result: ExciteResult) -> Plot:
    parts = (
        ("Angle", "°", result.position),
        ("Speed", "°/s", result.velocity),
        ("Acceleration", "°/s²", result.acceleration),
    )
    panels = [Panel(Column(name, unit), _lines(result, values)) for name, unit, values in parts]
    return Plot("motion-plot", Column("Time", "s"), panels, "One period of the motion.")


def _lines(result: ExciteResult, values: Array) -> list[Line]:
    moves = result.limits[4] > 0
    return [
        Line(joint, result.time_s, np.degrees(values[:, n]))
        for n, joint in enumerate(result.joints)
        if moves[n]
    ]


def _promised(result: ExciteResult) -> Plot:
    p = result.promised
    place = np.arange(1.0, len(p.name) + 1)
    lines = [
        Line(name, place, values / p.promised, points=True)
        for name, values in (
            ("promised", p.promised),
            ("at random", p.random),
            ("rehearsed", p.scatter),
        )
    ]
    caption = "Intervals over the promised ones, in the order of the table below."
    panel = Panel(Column("Half interval over the promised one"), lines, log=True)
    return Plot("promised-plot", Column("Parameter", "number"), [panel], caption)
