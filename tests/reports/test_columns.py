"""Tables by columns."""

from __future__ import annotations

import math

import numpy as np
import pytest

from identify.reports.kit.cells import (
    NONE,
    Column,
    Curves,
    Number,
    Table,
    angles,
    digits,
    interval,
    limited,
    percent,
    ready,
    several,
    whole,
    words,
)

TABLE = Table(
    "Modes",
    [
        words("Mode", range(1, 4)),
        Column("Frequency", "Hz", np.array([12.0504, 27.0, math.nan])),
        Column("Damping", "%", [0.0412, math.nan, 0.01], percent),
    ],
    "by frequency",
)


def test_rows_are_the_columns_side_by_side() -> None:
    assert TABLE.rows == (("1", "12.05", "4.120"), ("2", "27.00", NONE), ("3", NONE, "1.000"))
    assert [column.numeric for column in TABLE.columns] == [False, True, True]
    assert [column.head for column in TABLE.columns] == ["Mode", "Frequency (Hz)", "Damping (%)"]


def test_numbers_keep_their_value() -> None:
    cell = TABLE.rows[0][2]
    assert isinstance(cell, Number) and cell.value == pytest.approx(4.12)


def test_values_by_row_give_the_same_table() -> None:
    heads = [words("Mode"), Column("Frequency", "Hz"), Column("Damping", "%", form=percent)]
    rows = [("1", 12.0504, 0.0412), ("2", 27.0, math.nan), ("3", math.nan, 0.01)]
    assert Table.of("Modes", heads, rows).rows == TABLE.rows
    assert Table.of("Modes", heads, []).rows == ()


def test_a_part_of_a_table_has_the_same_cells() -> None:
    part = TABLE.part(slice(1, None), ("Mode", "Damping"))
    assert part.rows == (("2", NONE), ("3", "1.000")) and part.note == ""
    assert isinstance(part.rows[1][1], Number) and not part.columns[0].numeric


def test_columns_of_different_length_are_refused() -> None:
    with pytest.raises(ValueError, match="shorter"):
        _ = Table("", [words("a", "xy"), words("b", "x")]).rows
    with pytest.raises(ValueError, match="shorter"):
        Table.of("", [words("a"), words("b")], [("x", "y"), ("z",)])


def test_columns_of_an_array_and_of_limits() -> None:
    values = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert [c.cells for c in several("xy", "m", values, whole)] == [("1", "3"), ("2", "4")]
    found = limited("Depth", "mm", values.repeat(2)[:3, None])
    assert [c.heading for c in found] == ["Depth", "95 % low", "95 % high"]
    np.testing.assert_array_equal(Curves("", several("xy", "m", values)).values, values)


def test_forms() -> None:
    assert (whole(3.0), whole(math.nan), digits(2)(306.7), ready("a to b")) == ("3", NONE, "310", "a to b")
    assert (angles([-7.6, 12.8]), angles([1.25], ".1f"), angles([])) == ("-7.6, 12.8", "1.2", "")
    assert (interval(1.5, 2.5), interval(math.nan, 1.0)) == ("1.50 to 2.50", NONE)
