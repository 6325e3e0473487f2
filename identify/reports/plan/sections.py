"""The report of a plan: the sheet of the test, and what it promises."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import (
    Column,
    Table,
    angles,
    digits,
    number,
    percent,
    several,
    unit,
    words,
)
from identify.reports.kit.report import (
    EVERYWHERE,
    Bullets,
    Code,
    Drawing,
    Parts,
    Report,
    Section,
    Tabular,
    Tiles,
    note,
    origin,
)
from identify.reports.shared import robot_figure
from identify.reports.shared.data import geometry
from identify.reports.shared.page_data import Channels, robot_data
from identify.reports.shared.parts import stage
from identify.reports.shared.pick import nodes
from identify.reports.shared.shapes import model_view
from identify.results.plan import PlannedPlace, PlanResult

_MODES = 8


def report(result: PlanResult) -> Report:
    """What is said of a plan."""
    sheet = [
        "Move to each posture, with brakes closed or servos on; make every impact in every posture.",
        f"Records of {1 / result.resolution_hz:.3g} s or more from just before the impact; four impacts or"
        " more a point, for the coherence.",
        "If the response has not died away at the end, use an exponential window on force and response, and"
        " write its decay into the study (`window_decay_per_s`).",
    ]
    postures, impacts = (
        Tabular(table(result), heading=True, on=EVERYWHERE) for table in (posture_table, impact_table)
    )
    sensors = Tabular(sensor_table(result), heading=True, on=EVERYWHERE, terminal=("Node", "Name", "Link"))
    promised = Tabular(promised_table(result), on=EVERYWHERE)
    sections = [
        Section("robot", "The test on the robot", _robot(result) if result.places else [], "Robot"),
        Section("sheet", "Test sheet", [Bullets(sheet), postures, impacts, sensors], "Sheet"),
        Section("promised", "Promised intervals", [_promised(result).drawing(), promised], "Promised"),
        Section("study", "The study of this test", [Code(result.study)], "Study"),
        *origin(result, "Asked"),
    ]
    return Report(_tiles(result), [], sections)


def _tiles(result: PlanResult) -> Tiles:
    postures, impacts, sensors = (int(count) for count in result.candidates)
    promised, (low, high) = 100 * result.promised.promised, result.band_hz
    taken = f"{len(result.posture_deg)} / {len(result.impacts)} / {len(result.sensors)}"
    widest = number(float(promised.max()), 2)
    band = f"for {number(result.resolution_hz, 3)} Hz, {number(low, 3)} to {number(high, 3)} Hz"
    return (
        ("Test", taken, f"postures, impacts, sensors, of {postures}, {impacts} and {sensors}"),
        (
            "Against random tests",
            f"{number(result.random_ratio, 3)} times",
            "narrower intervals, at the median",
        ),
        (
            "Promised",
            f"± {number(float(np.median(promised)), 2)} %",
            f"95 % interval, at the median; the widest ± {widest} %",
        ),
        ("Record", f"{number(1 / result.resolution_hz, 3)} s", band),
    )


def _worth(result: PlanResult, what: str) -> list[Column]:
    """What each of the `postures`, `impacts` or `sensors` is worth; nothing where it was not kept."""
    worth = None if result.worth is None else getattr(result.worth, what)
    return [] if worth is None else [Column("Without it", "times", worth, digits(3))]


def posture_table(result: PlanResult) -> Table:
    """Joint angles, in the order of the test."""
    worth = _worth(result, "postures")
    names = words("Posture", [f"planned{k}" for k in range(1, len(result.posture_deg) + 1)])
    columns = [names, *several(result.joints, "°", result.posture_deg), *worth]
    said = "Without it: by how much the intervals would be wider, at the median, if it were left out."
    return Table("Postures", columns, said if worth else "")


def impact_table(result: PlanResult) -> Table:
    """Where to hit, and what to expect there."""
    level = [result.level[:, k] for k in range(len(result.impacts))]
    kinds = (("Lowest", np.min), ("Median", np.median), ("Highest", np.max))
    columns = [
        words("Impact", result.impacts),
        *(Column(f"{kind} level", "m/s²/N", map(of, level), digits(3)) for kind, of in kinds),
        *_worth(result, "impacts"),
    ]
    said = "In every posture. Levels: RMS accelerance over the band at the sensors, over all postures."
    return Table("Impacts", columns, said)


def sensor_table(result: PlanResult) -> Table:
    """Where to put the sensors, and how they look."""
    axes = np.round(result.sensor_axes, 6) + 0.0
    columns = [
        words("Node", result.sensors),
        words("Name", result.sensor_names),
        words("Link", result.sensor_links),
        *several("xyz", "mm", 1e3 * result.sensor_m),
        *(
            words(f"Its {axis} along", [angles(own[k], ".3g") for own in axes])
            for k, axis in enumerate("XYZ")
        ),
        *_worth(result, "sensors"),
    ]
    return Table("Sensors", columns, "Triaxial; places and axes in the link's frame.")


def promised_table(result: PlanResult) -> Table:
    """What each parameter's interval is now, will be, and would be after a test at random."""
    p = result.promised
    columns = [
        words("Parameter", p.name),
        Column("Value", "", p.value),
        words("Unit", map(unit, p.unit)),
        Column("± now", "%", p.now, percent),
        Column("± promised", "%", p.promised, percent),
        Column("± random test", "%", p.random, percent),
    ]
    said = "Half the 95 % interval. Random: the median of tests of the same size."
    return Table("Promised intervals", columns, said)


def _robot(result: PlanResult) -> Parts:
    """The test on the robot: where to hit, and where the sensors are, at every posture."""
    places = list(result.places.values())
    seen = [f"{node}:+{axis}" for node in result.sensors for axis in "XYZ"], list(result.impacts)
    views = [robot_figure.PostureView(one.name, one.geometry, *seen) for one in places]
    kept = "" if len(views) <= robot_figure.POSTURES else f" The first {robot_figure.POSTURES} postures."
    caption = f"Sensors (blue) and impacts (orange, longer) of the test; floor grid 0.5 m.{kept}"
    figure = partial(robot_figure.postures, views)
    drawn = Drawing("", figure, caption, lambda: [geometry(one.name, one.geometry) for one in places])
    pages = [
        {"name": one.name, "use": "modes as expected", "robot": _view(result, one, seen)} for one in places
    ]
    shown = [("model", "the robot at the posture of the test, moving in the chosen mode")]
    moving = stage(places, shown, {"measurements": pages})
    return [moving, note("Blue arrows: sensors. Orange arrows: impacts."), drawn]


def _view(result: PlanResult, place: PlannedPlace, seen: Channels) -> dict[str, Any]:
    """The robot at a posture with its first modes."""
    modes = [model_view(place.modes, row) for row in range(min(_MODES, len(place.modes.frequency_hz)))]
    return robot_data(place.geometry, seen, modes, nodes(result.impacts), ("where to hit", "hit here"))


def _promised(result: PlanResult) -> Plot:
    p = result.promised
    place = np.arange(1.0, len(p.name) + 1)
    kinds = (("promised", p.promised), ("at random", p.random), ("now", p.now))
    lines = [Line(name, place, 100 * half, points=True) for name, half in kinds]
    panel = Panel(Column("Half interval", "%"), lines, log=True)
    caption = "Half the 95 % interval of each parameter, in the order of the table below."
    return Plot("promised-plot", Column("Parameter", "number"), [panel], caption)
