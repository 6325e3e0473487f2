"""The report of a plan: the sheet of the test, and what it promises."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.banded import SCRIPTS, Line, Panel, Plot
from identify.reports.kit.cells import Column
from identify.reports.kit.report import EVERYWHERE, Bullets, Code, Part, Report, Section, Tabular, origin
from identify.reports.plan import tables
from identify.results.plan import PlanResult


def report(result: PlanResult) -> Report:
    """What is said of a plan."""
    plot = _promised(result)
    sheet: list[Part] = [
        Bullets(
            [
                "Take up each posture, brakes closed or servos holding still; every impact in every posture.",
                f"Records of {1 / result.resolution_hz:.3g} s or more from just before the impact; four"
                " impacts or more a point, for the coherence.",
                "If the response has not died away at the end, use an exponential window on force and"
                " response, and write its decay into the study (`window_decay_per_s`).",
            ]
        ),
        Tabular(tables.posture_table(result), heading=True, on=EVERYWHERE),
        Tabular(tables.impact_table(result), heading=True, on=EVERYWHERE),
        Tabular(tables.sensor_table(result), heading=True, on=EVERYWHERE, terminal=("Node", "Name", "Link")),
    ]
    promised = Tabular(tables.promised_table(result), on=EVERYWHERE)
    sections = [
        Section("sheet", "Test sheet", sheet, "Sheet"),
        Section(
            "promised", "Promised intervals", [plot.drawing(), promised], "Promised", plot.data(), SCRIPTS
        ),
        Section("study", "The study of this test", [Code(result.study)], "Study"),
        *origin(result, "Asked"),
    ]
    return Report(tables.tiles(result), [], sections)


def _promised(result: PlanResult) -> Plot:
    promised = result.promised
    place = np.arange(1.0, len(promised.name) + 1)
    lines = [
        Line(name, place, 100 * half, points=True)
        for name, half in (
            ("promised", promised.promised),
            ("at random", promised.random),
            ("now", promised.now),
        )
    ]
    panel = Panel(Column("Half interval", "%"), lines, log=True)
    caption = "Half the 95 % interval of each parameter, in the order of the table below."
    return Plot("promised-plot", Column("Parameter", "number"), [panel], caption)
