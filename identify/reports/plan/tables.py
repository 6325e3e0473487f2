"""The tables of a planned test, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import Column, Table, number, percent, unit, words
from identify.results.plan import PlanResult


def tiles(result: PlanResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first."""
    promised = result.promised
    there = [int(count) for count in result.candidates]
    return (
        (
            "Test",
            f"{len(result.posture_deg)} / {len(result.impacts)} / {len(result.sensors)}",
            f"postures, impacts, sensors, of {there[0]}, {there[1]} and {there[2]}",
        ),
        (
            "Against random tests",
            f"{number(result.random_ratio, 3)} times",
            "narrower intervals, at the median",
        ),
        (
            "Promised",
            f"± {number(100 * float(np.median(promised.promised)), 2)} %",
            f"95 % interval, at the median; the widest ± {number(100 * float(promised.promised.max()), 2)} %",
        ),
        (
            "Record",
            f"{number(1 / result.resolution_hz, 3)} s",
            f"for {number(result.resolution_hz, 3)} Hz, {number(result.band_hz[0], 3)} to"
            f" {number(result.band_hz[1], 3)} Hz",
        ),
    )


def posture_table(result: PlanResult) -> Table:
    """Joint angles, in the order of the test."""
    worth, head, note = _worth(result, "postures")
    rows = [
        (f"planned{k}", *map(number, row), *more)
        for k, (row, more) in enumerate(zip(result.posture_deg, worth, strict=True), 1)
    ]
    heads = words("Posture"), *(Column(joint, "°") for joint in result.joints), *head
    return Table("Postures", heads, tuple(rows), note)


def _worth(result: PlanResult, what: str) -> tuple[list[tuple[str, ...]], tuple[Column, ...], str]:
    """What each of the `postures`, `impacts` or `sensors` is worth: a cell a row, its column, and a note;
    nothing where it was not kept.
    """
    rows = {"postures": len(result.posture_deg), "impacts": len(result.impacts)}.get(
        what, len(result.sensors)
    )
    if result.worth is None:
        return [()] * rows, (), ""
    cells: list[tuple[str, ...]] = [(number(value, 3),) for value in getattr(result.worth, what)]
    note = "Without it: by how much the intervals would be wider, at the median, if it were left out."
    return cells, (Column("Without it", "times"),), note


def impact_table(result: PlanResult) -> Table:
    """Where to hit, and what to expect there."""
    rows = []
    worth, head, _ = _worth(result, "impacts")
    for k, name in enumerate(result.impacts):
        level = result.level[:, k]
        levels = (number(value, 3) for value in (level.min(), float(np.median(level)), level.max()))
        rows.append((name, *levels, *worth[k]))
    heads = (
        words("Impact"),
        *(Column(f"{what} level", "m/s²/N") for what in ("Lowest", "Median", "Highest")),
        *head,
    )
    note = "In every posture. Levels: RMS accelerance over the band at the sensors, over all postures."
    return Table("Impacts", heads, tuple(rows), note)


def sensor_table(result: PlanResult) -> Table:
    """Where to put the sensors, and how they look."""
    rows = []
    worth, head, _ = _worth(result, "sensors")
    for k, node in enumerate(result.sensors):
        x, y, z = (
            ", ".join(f"{value + 0.0:.3g}" for value in axis) for axis in np.round(result.sensor_axes[k], 6)
        )
        place = map(number, 1e3 * result.sensor_m[k])
        rows.append((str(node), result.sensor_names[k], result.sensor_links[k], *place, x, y, z, *worth[k]))
    heads = (
        words("Node"),
        words("Name"),
        words("Link"),
        *(Column(axis, "mm") for axis in "xyz"),
        *(words(f"Its {axis} along") for axis in "XYZ"),
        *head,
    )
    return Table("Sensors", heads, tuple(rows), "Triaxial; places and axes in the link's frame.")


def promised_table(result: PlanResult) -> Table:
    """What each parameter's interval is now, will be, and would be after a test at random."""
    promised = result.promised
    rows = []
    for k, name in enumerate(promised.name):
        halves = (promised.now[k], promised.promised[k], promised.random[k])
        rows.append((name, number(promised.value[k]), unit(promised.unit[k]), *map(percent, halves)))
    heads = (
        words("Parameter"),
        Column("Value"),
        words("Unit"),
        Column("± now", "%"),
        Column("± promised", "%"),
        Column("± random test", "%"),
    )
    note = "Half the 95 % interval. Random: the median of tests of the same size."
    return Table("Promised intervals", heads, tuple(rows), note)
