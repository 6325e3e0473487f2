"""The report of a plan: the sheet of the test, and what it promises."""

from __future__ import annotations

from functools import partial

import numpy as np

from identify.reports.fit.data import geometry
from identify.reports.fit.page_data import robot_data
from identify.reports.fit.parts import stage
from identify.reports.fit.pick import nodes
from identify.reports.kit import robot_figure
from identify.reports.kit.banded import SCRIPTS, Line, Panel, Plot
from identify.reports.kit.cells import Column
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    Bullets,
    Code,
    Drawing,
    Part,
    Report,
    Section,
    Tabular,
    Text,
    origin,
)
from identify.reports.kit.shapes import ModeView, model_view
from identify.reports.plan import tables
from identify.results.plan import PlannedPlace, PlanResult

_MODES = 8


def report(result: PlanResult) -> Report:
    """What is said of a plan."""
    plot = _promised(result)
    robot = [_robot(result)] if result.places else []
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
        *robot,
        Section("sheet", "Test sheet", sheet, "Sheet"),
        Section(
            "promised", "Promised intervals", [plot.drawing(), promised], "Promised", plot.data(), SCRIPTS
        ),
        Section("study", "The study of this test", [Code(result.study)], "Study"),
        *origin(result, "Asked"),
    ]
    return Report(tables.tiles(result), [], sections)


def _robot(result: PlanResult) -> Section:
    """The test on the robot: where to hit, and where the sensors are, at every posture."""
    places = list(result.places.values())
    seen = [f"{node}:+{axis}" for node in result.sensors for axis in "XYZ"], list(result.impacts)
    views = [robot_figure.PostureView(one.name, one.geometry, *seen) for one in places]
    kept = "" if len(views) <= robot_figure.POSTURES else f" The first {robot_figure.POSTURES} postures."
    caption = f"Sensors (blue) and impacts (orange, longer) of the test; floor grid 0.5 m.{kept}"
    figure = partial(robot_figure.postures, views)
    drawn = Drawing("", figure, caption, lambda: [geometry(one.name, one.geometry) for one in places])
    hit = nodes(result.impacts)
    pages = [
        {
            "name": one.name,
            "use": "modes as expected",
            "robot": robot_data(one.geometry, seen, _modes(one), hit, ("where to hit", "hit here")),
        }
        for one in places
    ]
    shown = [("model", "the robot at the posture of the test, moving in the chosen mode")]
    said = Text("Blue arrows: sensors. Orange arrows: impacts.", "note", PAGE)
    return Section(
        "robot",
        "The test on the robot",
        [stage(places, shown), said, drawn],
        "Robot",
        {"measurements": pages},
    )


def _modes(place: PlannedPlace) -> list[ModeView]:
    """The first modes at a posture."""
    return [model_view(place.modes, row) for row in range(min(_MODES, len(place.modes.frequency_hz)))]


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
