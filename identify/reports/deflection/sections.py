"""The report of deflections: along the path, where to go instead, ellipsoids, and what oscillation does."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, Table, digits, limited, number, several, words
from identify.reports.kit.report import EVERYWHERE, Report, Section, Tabular, Tiles, origin
from identify.results.deflection import DeflectionResult

_PRINTED = 40


def report(result: DeflectionResult) -> Report:
    """What is said of deflections."""
    several_places = len(result.rows.name) > 1
    along = _along(result).drawing() if several_places else None
    table = Tabular(deflection_table(result), sort="deflections", limit=20, rows=_PRINTED)
    target = Tabular(target_table(result), limit=20, rows=_PRINTED)
    ellipsoids = Tabular(ellipsoid_table(result), limit=21, rows=_PRINTED, on=EVERYWHERE)
    sections = [
        Section("deflections", "Deflections", [along, table]),
        Section("path", "The compensated path", [target], "Path"),
        Section("ellipsoids", "Compliance ellipsoids", [ellipsoids], "Ellipsoids"),
        Section("dynamic", "A force that oscillates", [_dynamic(result).drawing()], "Oscillation"),
        *origin(result),
    ]
    return Report(_tiles(result), [], sections)


def _tiles(result: DeflectionResult) -> Tiles:
    rows, found = result.rows, result.dynamic
    most = int(np.argmax(rows.size_m))
    size, low, high = (
        number(1e6 * one[most], 3) for one in (rows.size_m, rows.size_low_95, rows.size_high_95)
    )
    force = number(float(np.linalg.norm(rows.force_n[most])), 3)
    softest, least = (number(1e6 * rows.compliance[most, which], 3) for which in (0, 2))
    peaks = np.linalg.norm(found.amplitude_m, axis=1)
    hz = number(found.line_hz[int(np.argmax(peaks))], 3)
    return (
        ("Largest deflection", f"{size} µm", f"95 %: {low} to {high} µm, at {result.place}"),
        ("Force there", f"{force} N", rows.name[most]),
        ("Softest direction", f"{softest} µm/N", f"least: {least} µm/N"),
        ("At resonance", f"{number(1e6 * peaks.max(), 3)} µm", f"if the first force oscillated at {hz} Hz"),
    )


def deflection_table(result: DeflectionResult) -> Table:
    """Every place."""
    rows, columns = result.rows, several([f"Force {axis}" for axis in "xyz"], "N", result.rows.force_n)
    for k, axis in enumerate("xyz"):
        moved = (1e6 * one[:, k] for one in (rows.deflection_m, rows.low_95, rows.high_95))
        columns += limited(f"Moves {axis}", "µm", moved)
    return Table("Deflections", [words("Place", rows.name), *columns])


def target_table(result: DeflectionResult) -> Table:
    """Where to send the tip instead."""
    rows, six = result.rows, digits(6)
    send, wanted = ([f"{what} {axis}" for axis in "xyz"] for what in ("Send", "Wanted"))
    columns = [
        words("Place", rows.name),
        *several(result.joints, "°", rows.target_deg, six),
        *several(send, "mm", 1e3 * rows.target_m, six),
        *several(wanted, "mm", 1e3 * rows.tip_m, six),
    ]
    note = "With this path the tip reaches the wanted place under the force; the whole path is in the CSV."
    return Table("The compensated path", columns, note)


def ellipsoid_table(result: DeflectionResult) -> Table:
    """The principal compliances, and where they point: three rows a place."""
    rows = result.rows
    sizes = (1e6 * one.ravel() for one in (rows.compliance, rows.compliance_low_95, rows.compliance_high_95))
    along, ways = [f"Along {axis}" for axis in "xyz"], rows.directions.reshape(-1, 3)
    columns = [
        words("Place", np.repeat(rows.name, 3)),
        *limited("Compliance", "µm/N", sizes),
        *several(along, "", ways, digits(3)),
    ]
    note = "Axes of the compliance ellipsoid, the most compliant first, in the base's axes."
    return Table("Compliance ellipsoids", columns, note)


def _along(result: DeflectionResult) -> Plot:
    rows, place = result.rows, np.arange(1.0, len(result.rows.name) + 1)
    lines = []
    for k, axis in enumerate("xyz"):
        moved, low, high = (1e6 * one[:, k] for one in (rows.deflection_m, rows.low_95, rows.high_95))
        lines.append(Line(f"along {axis}", place, moved, low, high))
    caption = f"Static deflection of {result.place} along the base's axes, with 95 % bands."
    return Plot("along-plot", Column("Place", "number"), [Panel(Column("Deflection", "µm"), lines)], caption)


def _dynamic(result: DeflectionResult) -> Plot:
    found = result.dynamic
    lines = [
        Line.within(f"along {axis}", found.line_hz, 1e6 * size, 1e6 * half)
        for axis, size, half in zip("xyz", found.amplitude_m.T, found.band_95.T, strict=True)
    ]
    panel = Panel(Column("Amplitude", "µm"), lines, log=True)
    first = result.rows.name[0]
    caption = f"Amplitude of {result.place} if the force at {first} oscillated, with 95 % bands."
    return Plot("dynamic-plot", Column("Frequency", "Hz"), [panel], caption)
