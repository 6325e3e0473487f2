"""The tables of identified joints, as finished text; terminal, HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import NONE, Column, Table, number, words
from identify.reports.kit.cells import unit as printed
from identify.results.joints import CurveResult, JointsResult


def tiles(result: JointsResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first: (what, value, what it means)."""
    status = [status for found in result.curves.values() for status in found.values.status]
    sure = sum(one == "determined" for one in status)
    return (
        ("Curves", str(len(result.curves)), "each from a run of its own"),
        ("Determined", f"{sure} of {len(status)}", "half the 95 % interval below two thirds of the value"),
    )


def value_table(label: str, found: CurveResult) -> Table:
    """Values with their intervals, and what the robot's description says where it says anything."""
    v = found.values
    described = bool(np.isfinite(v.expected).any())
    beside = (Column("Described"),) if described else ()
    columns = (
        words("Value"),
        Column("Identified"),
        Column("95 %"),
        words("Unit"),
        words("Identifiability"),
        *beside,
        words("Meaning"),
    )
    rows = []
    for row, name in enumerate(v.name):
        cells = (
            name,
            number(v.value[row]),
            _interval(v.low_95[row], v.high_95[row]),
            printed(v.unit[row]),
            v.status[row],
        )
        rows.append((*cells, *((number(v.expected[row]),) if described else ()), v.meaning[row]))
    note = f"RMS of what is left: {number(found.rms, 3)} {printed(found.unit)}, {found.samples} samples."
    if described:
        note += " Described: what the robot's file says of the same combination."
    return Table(label, columns, tuple(rows), note)


def _interval(low: float, high: float) -> str:
    if low == high:
        return "taken as known"
    return f"{number(low)} to {number(high)}" if np.isfinite([low, high]).all() else NONE
