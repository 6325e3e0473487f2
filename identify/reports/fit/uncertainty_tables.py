"""What was told and how far the data say that it is off; how much of each interval is noise."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import NONE, Column, Table, number, percent, signed, words
from identify.results.fit import FitResult, StatedUncertainty

_UNITS = {"m": ("mm", 1e3), "rad": ("°", 180 / np.pi), "1": ("%", 100.0), "s": ("µs", 1e6)}
"""Unit and factor in which errors of each SI unit are printed."""


def error_table(stated: StatedUncertainty) -> Table:
    """A row for each error of what was told, the largest first in units of what was stated."""
    rows = []
    for n in np.argsort(-np.abs(stated.shift)):
        unit, factor = _UNITS[stated.unit[n]]
        std = factor * stated.stated[n]
        rows.append(
            (
                stated.kind[n],
                stated.place[n],
                stated.change[n],
                signed(stated.shift[n] * std, 3),
                unit,
                number(std, 3),
                signed(stated.shift[n], 3),
                percent(stated.spread[n]),
            )
        )
    columns = (
        words("Error of"),
        words("Where"),
        words("What"),
        Column("Fitted"),
        words("Unit"),
        Column("Stated ±"),
        Column("Over stated"),
        Column("Left of ±", "%"),
    )
    note = (
        "Fitted along with the parameters where the cost is the likelihood, with what was stated as their"
        " standard deviation. Beyond 3 the statement was too small, or something is missing from the model;"
        " 100 % left: the data say nothing."
    )
    return Table("Errors of what was told", columns, tuple(rows), note)


def part_table(result: FitResult, stated: StatedUncertainty) -> Table:
    """Of each free parameter, the part of the variance behind its interval that comes from each kind of
    error, and from noise.
    """
    p, rows = result.parameters, []
    for row, name in enumerate(p.name):
        parts = stated.parts[row]
        if p.free[row]:
            noise = max(1.0 - float(parts.sum()), 0.0)
            rows.append((name, number(100 * noise, 2), *(number(100 * part, 2) for part in parts)))
    columns = (words("Parameter"), Column("Noise", "%"), *(Column(kind, "%") for kind in stated.kinds))
    note = "Parts of the variance. What a column says would be gone if that were measured exactly."
    return Table("Where the intervals come from", columns, tuple(rows or [(NONE,) * len(columns)]), note)
