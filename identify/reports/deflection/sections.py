"""The report of deflections: along the path, where to go instead, ellipsoids, and what oscillation does."""

from __future__ import annotations

import numpy as np

from identify.reports.deflection import tables
from identify.reports.kit.banded import SCRIPTS, Line, Panel, Plot
from identify.reports.kit.cells import Column
from identify.reports.kit.report import EVERYWHERE, Part, Report, Section, Tabular, origin
from identify.results.deflection import DeflectionResult

_PRINTED = 40


def report(result: DeflectionResult) -> Report:
    """What is said of deflections."""
    along, dynamic = _along(result), _dynamic(result)
    several = len(result.rows.name) > 1
    table = Tabular(tables.deflection_table(result), sort="deflections", limit=20, rows=_PRINTED)
    first: list[Part] = [along.drawing()] if several else []
    target = Tabular(tables.target_table(result), limit=20, rows=_PRINTED)
    ellipsoids = Tabular(tables.ellipsoid_table(result), limit=21, rows=_PRINTED, on=EVERYWHERE)
    sections = [
        Section("deflections", "Deflections", [*first, table], "", along.data() if several else {}, SCRIPTS),
        Section("path", "The compensated path", [target], "Path"),
        Section("ellipsoids", "Compliance ellipsoids", [ellipsoids], "Ellipsoids"),
        Section(
            "dynamic", "A force that oscillates", [dynamic.drawing()], "Oscillation", dynamic.data(), SCRIPTS
        ),
        *origin(result),
    ]
    return Report(tables.tiles(result), [], sections)


def _along(result: DeflectionResult) -> Plot:
    rows, place = result.rows, np.arange(1.0, len(result.rows.name) + 1)
    lines = []
    for k, axis in enumerate("xyz"):
        moved, low, high = (1e6 * one[:, k] for one in (rows.deflection_m, rows.low_95, rows.high_95))
        lines.append(Line(f"along {axis}", place, moved, low, high))
    panel = Panel(Column("Deflection", "µm"), lines)
    caption = f"Static deflection of {result.place} along the base's axes, with 95 % bands."
    return Plot("along-plot", Column("Place", "number"), [panel], caption)


def _dynamic(result: DeflectionResult) -> Plot:
    found, lines = result.dynamic, []
    for k, axis in enumerate("xyz"):
        size, half = 1e6 * found.amplitude_m[:, k], 1e6 * found.band_95[:, k]
        size = np.maximum(size, 1e-9)
        lines.append(
            Line(f"along {axis}", found.line_hz, size, np.maximum(size - half, 1e-3 * size), size + half)
        )
    caption = (
        f"Amplitude of {result.place} if the force at {result.rows.name[0]} oscillated, with 95 % bands."
    )
    return Plot(
        "dynamic-plot",
        Column("Frequency", "Hz"),
        [Panel(Column("Amplitude", "µm"), lines, log=True)],
        caption,
    )
