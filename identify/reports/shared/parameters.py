"""Parameters: where they lie between their bounds, their intervals, and their table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.fitting.uncertainty import BOUNDS
from identify.reports.kit.cells import Column, Table, digits, unit, words
from identify.results.tables import ParameterTable

PARAMETERS_TERMINAL = ("Parameter", "Fitted", "Unit", "95 % from", "to", "±", "Identifiability")
"""The columns of the table of parameters that a terminal has room for."""


def parameter_table(p: ParameterTable) -> Table:
    """Fitted values with intervals, start values and bounds."""
    columns = [
        words("Parameter", p.name),
        Column("Fitted", "", p.value),
        words("Unit", map(unit, p.unit)),
        *interval_columns(p, range(len(p.name))),
        Column("Start", "", p.initial),
        Column("Lower bound", "", p.lower),
        Column("Upper bound", "", p.upper),
        words("Identifiability", p.status),
    ]
    note = (
        "± is half the 95 % interval over the value. Determined: the interval stays within a factor of two;"
        " not determined: it reaches beyond a factor of seven. At a bound: the fit would exceed the bound,"
        " and the interval is one-sided."
    )
    return Table("Parameters", columns, note)


def interval_columns(p: ParameterTable, rows: Sequence[int]) -> list[Column]:
    """The 95 % intervals of some parameters, none of fixed ones and on the side of a bound."""
    low, high = (np.array([status == side for status in p.status]) for side in BOUNDS)
    sides = (
        ("95 % from", "", np.where(low, np.nan, p.low_95), digits(4)),
        ("to", "", np.where(high, np.nan, p.high_95), digits(4)),
        ("±", "%", 100 * half_interval(p), digits(2)),
    )
    return [
        Column(heading, of, np.where(p.free, values, np.nan)[list(rows)], form)
        for heading, of, values, form in sides
    ]


def free_names(p: ParameterTable) -> list[str]:
    """Of the free parameters, in their order."""
    return [name for name, free in zip(p.name, p.free, strict=True) if free]


def between_bounds(table: ParameterTable, values: Array) -> Array:
    """Where values (..., p) lie between their bounds, 0 lower to 1 upper, on the scale they are searched
    on.
    """
    lower, upper = table.lower, table.upper
    with np.errstate(divide="ignore", invalid="ignore"):
        linear = (values - lower) / (upper - lower)
        logarithmic = np.log(values / lower) / np.log(upper / lower)
    return np.clip(np.where(table.log, logarithmic, linear), 0.0, 1.0)


def half_interval(table: ParameterTable) -> Array:
    """Half the 95 % interval over the value, (p,); NaN where fixed, or at a bound."""
    known = np.array([status not in BOUNDS for status in table.status]) & (table.value != 0)
    size = np.where(known, np.abs(table.value), np.nan)
    return np.asarray((table.high_95 - table.low_95) / 2 / size)
