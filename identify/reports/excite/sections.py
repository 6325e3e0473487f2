"""The report of an exciting motion: the motion over time, its limits, what it promises and whether that came
true in the rehearsal.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, Table, digits, number, ready, several, unit, words
from identify.reports.kit.report import EVERYWHERE, Bullets, Report, Section, Tabular, Tiles, origin
from identify.results.excite import ExciteResult


def report(result: ExciteResult) -> Report:
    """What is said of an exciting motion."""
    sheet = Bullets(
        [
            f"Send the table beside this result, one period of {result.period_s:g} s,"
            f" {result.periods} times without a stop between; it begins and ends at rest.",
            "Run it at a tenth of its speed first, and watch for obstacles.",
            "Record motor positions and torques (of transmission errors: link positions) over all periods.",
        ]
    )
    limits = Tabular(limit_table(result), heading=True, on=EVERYWHERE)
    promised = Tabular(promised_table(result), on=EVERYWHERE)
    sections = [
        Section("motion", "The motion", [_motion(result).drawing(), sheet, limits], "Motion"),
        Section("promised", "Promised intervals", [_promised(result).drawing(), promised], "Promised"),
        Section("series", "Fourier series", [Tabular(series_table(result))], "Series"),
        *origin(result, "Asked"),
    ]
    return Report(_tiles(result), [], sections)


def _tiles(result: ExciteResult) -> Tiles:
    ratio, true = number(result.random_ratio, 3), number(result.come_true, 3)
    kept = number(100 * float(np.mean(result.promised.kept[result.promised.wanted == 1])), 3)
    scatter = f"of the promised intervals: scatter of values, median; {result.draws} runs"
    return (
        ("Motion", f"{number(result.period_s, 3)} s", f"a period, run {result.periods} times"),
        ("Against random motion", f"{ratio} times", "narrower intervals, at the median"),
        ("In the rehearsal", f"{true}", scatter),
        ("The promise holds", f"{kept} %", "of rehearsed values; 95 % were promised"),
    )


def limit_table(result: ExciteResult) -> Table:
    """What each joint does, and what it may."""
    low, high, speed, acceleration, moves = result.limits
    most, three = (
        (np.degrees(np.abs(one).max(axis=0)) for one in (result.velocity, result.acceleration)),
        digits(3),
    )
    fastest, hardest = most
    columns = [
        words("Joint", [n if m else f"{n} (stands)" for n, m in zip(result.joints, moves, strict=True)]),
        Column("Angle", "°", map(_range, result.position.T), ready),
        Column("Limits", "°", map(_range, np.stack([low, high], axis=1)), ready),
        Column("Speed", "°/s", fastest, three),
        Column("Most speed", "°/s", np.degrees(speed), three),
        Column("Acceleration", "°/s²", hardest, three),
        Column("Most acceleration", "°/s²", np.degrees(acceleration), three),
    ]
    note = "The motion begins and ends at rest; speeds and accelerations are largest values."
    if np.isfinite(result.room_m):
        note += f" Points stay {number(1e3 * result.room_m, 3)} mm or more inside their workspace."
    return Table("Limits", columns, note)


def _range(values: Array) -> str:
    low, high = np.degrees([values.min(), values.max()])
    return f"{number(low, 4)} to {number(high, 4)}"


def promised_table(result: ExciteResult) -> Table:
    """What each parameter's interval will be, would be after motion at random, and was in the rehearsal."""
    p = result.promised
    columns = [
        words("Parameter", [n + ("" if w else " *") for n, w in zip(p.name, p.wanted, strict=True)]),
        Column("Expected", "", p.expected),
        words("Unit", map(unit, p.unit)),
        Column("± promised", "", p.promised),
        Column("± random", "", p.random),
        Column("± rehearsed", "", p.scatter),
        Column("Mean error", "", p.error, digits(2)),
        Column("Own interval holds", "%", 100 * p.held, digits(3)),
        Column("Promised one holds", "%", 100 * p.kept, digits(3)),
    ]
    note = (
        "Half the 95 % interval. Random: the median of 40 motions within the same limits. Rehearsed: 1.96"
        f" standard deviations over {result.draws} simulated runs."
    )
    if not p.wanted.all():
        note += " * estimated as well, but not what the motion was optimised for."
    return Table("Promised intervals", columns, note)


def series_table(result: ExciteResult) -> Table:
    """The coefficients, from which the motion can be made at any rate."""
    terms = range(1, len(result.sine) + 1)
    names = ["centre", *(f"{kind} {k}" for kind in ("sine", "cosine") for k in terms)]
    values = np.degrees(np.vstack([result.centre, result.sine, result.cosine]))
    note = f"Angle = centre + sum of terms; term k turns k times in {number(result.period_s, 6)} s."
    return Table(
        "Fourier series", [words("Term", names), *several(result.joints, "°", values, digits(7))], note
    )


def _motion(result: ExciteResult) -> Plot:
    parts = (
        ("Angle", "°", result.position),
        ("Speed", "°/s", result.velocity),
        ("Acceleration", "°/s²", result.acceleration),
    )
    moving = [(n, joint) for n, joint in enumerate(result.joints) if result.limits[4][n] > 0]
    panels = [
        Panel(Column(name, of), [Line(j, result.time_s, np.degrees(values[:, n])) for n, j in moving])
        for name, of, values in parts
    ]
    return Plot("motion-plot", Column("Time", "s"), panels, "One period of the motion.")


def _promised(result: ExciteResult) -> Plot:
    p = result.promised
    place = np.arange(1.0, len(p.name) + 1)
    kinds = (("promised", p.promised), ("at random", p.random), ("rehearsed", p.scatter))
    lines = [Line(name, place, values / p.promised, points=True) for name, values in kinds]
    caption = "Intervals over the promised ones, in the order of the table below."
    panel = Panel(Column("Half interval over the promised one"), lines, log=True)
    return Plot("promised-plot", Column("Parameter", "number"), [panel], caption)
