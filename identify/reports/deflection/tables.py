"""The tables of deflections, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import Column, Table, number, words
from identify.results.deflection import DeflectionResult


def tiles(result: DeflectionResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first."""
    rows = result.rows
    most = int(np.argmax(rows.size_m))
    size, low, high = (
        number(1e6 * one[most], 3) for one in (rows.size_m, rows.size_low_95, rows.size_high_95)
    )
    peak = int(np.argmax(np.linalg.norm(result.dynamic.amplitude_m, axis=1)))
    top = 1e6 * float(np.linalg.norm(result.dynamic.amplitude_m[peak]))
    return (
        ("Largest deflection", f"{size} µm", f"95 %: {low} to {high} µm, at {result.place}"),
        ("Force there", f"{number(float(np.linalg.norm(rows.force_n[most])), 3)} N", rows.name[most]),
        (
            "Softest direction",
            f"{number(1e6 * rows.compliance[most, 0], 3)} µm/N",
            f"least: {number(1e6 * rows.compliance[most, 2], 3)} µm/N",
        ),
        (
            "At resonance",
            f"{number(top, 3)} µm",
            f"if the first force oscillated at {number(result.dynamic.line_hz[peak], 3)} Hz",
        ),
    )


def deflection_table(result: DeflectionResult) -> Table:
    """Every place."""
    rows = result.rows
    columns = [*rows.force_n.T]
    for k in range(3):
        columns += [1e6 * one[:, k] for one in (rows.deflection_m, rows.low_95, rows.high_95)]
    heads = [words("Place"), *(Column(f"Force {axis}", "N") for axis in "xyz")]
    for axis in "xyz":
        heads += [Column(f"Moves {axis}", "µm"), Column("95 % low", "µm"), Column("95 % high", "µm")]
    cells = zip(rows.name, np.column_stack(columns), strict=True)
    return Table("Deflections", tuple(heads), tuple((name, *map(number, values)) for name, values in cells))


def target_table(result: DeflectionResult) -> Table:
    """Where to send the tip instead."""
    rows = result.rows
    columns = np.column_stack([rows.target_deg, 1e3 * rows.target_m, 1e3 * rows.tip_m])
    heads = [words("Place"), *(Column(joint, "°") for joint in result.joints)]
    heads += [Column(f"{what} {axis}", "mm") for what in ("Send", "Wanted") for axis in "xyz"]
    note = "Under the force the tip then comes to where it was wanted; all of it is in the CSV."
    cells = zip(rows.name, columns, strict=True)
    made = tuple((name, *(number(value, 6) for value in values)) for name, values in cells)
    return Table("The compensated path", tuple(heads), made, note)


def ellipsoid_table(result: DeflectionResult) -> Table:
    """The principal compliances, and where they point."""
    rows, found = result.rows, []
    for k, name in enumerate(rows.name):
        for which in range(3):
            limits = (
                one[k, which] for one in (rows.compliance, rows.compliance_low_95, rows.compliance_high_95)
            )
            found.append(
                (name, *(number(1e6 * v) for v in limits), *(number(v, 3) for v in rows.directions[k, which]))
            )
    heads = [
        words("Place"),
        Column("Compliance", "µm/N"),
        Column("95 % low", "µm/N"),
        Column("95 % high", "µm/N"),
    ]
    heads += [Column(f"Along {axis}") for axis in "xyz"]
    note = "Axes of the compliance ellipsoid, the softest first, in the base's axes."
    return Table("Compliance ellipsoids", tuple(heads), tuple(found), note)
