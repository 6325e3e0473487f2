"""How numbers, units and tables are written in every report, so that two reports of one result cannot differ.

Numbers have four significant digits and a decimal point, so that they can be pasted into a study.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.text import capital

NONE = "\N{EN DASH}"
"""What stands where there is no number."""


class Number(str):
    """A number as it is printed, with the value behind it, so that exported tables are not rounded."""

    value: float

    def __new__(cls, text: str, value: float) -> Number:
        """The text of a value."""
        made = super().__new__(cls, text)
        made.value = value
        return made


def number(value: float, digits: int = 4) -> Number:
    """A number with that many significant digits: `12.05`, `2.214e6`; NONE for NaN."""
    return Number(_text(float(value), digits), float(value))


def _text(value: float, digits: int) -> str:
    if math.isnan(value):
        return NONE
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    if value == 0:
        return "0"
    if -3 <= power < 4:
        return f"{float(f'{mantissa}e{power}'):.{max(digits - 1 - power, 0)}f}"
    return f"{mantissa}e{power}"


def turns_per_minute(rpm: float) -> Number:
    """A spindle speed, in whole turns where that says enough: `10034`, `12.50`."""
    return Number(f"{rpm:.0f}", float(rpm)) if 1000 <= rpm < math.inf else number(rpm)


def percent(ratio: float) -> Number:
    """A ratio in per cent, without the sign: the column says it."""
    return number(100 * ratio)


def signed(value: float, digits: int = 4) -> Number:
    """A difference, with its sign."""
    shown = number(value, digits)
    return Number(f"+{shown}", shown.value) if value > 0 else shown


def digits(count: int) -> Callable[[Any], Number]:
    """How numbers of so many significant digits are written."""
    return partial(number, digits=count)


def whole(value: float) -> str:
    """A count: `12`; NONE for NaN."""
    return NONE if math.isnan(value) else str(int(value))


def ready(text: str) -> str:
    """A cell of a column of numbers that is written already."""
    return text


def angles(values: Iterable[float], form: str = ".4g") -> str:
    """Numbers in one cell: `-7.6, 12.8, 44.5`."""
    return ", ".join(f"{value:{form}}" for value in values)


def interval(low: float, high: float, digits: int = 3) -> str:
    """`1.5 to 2.5`; NONE where an end is not known."""
    return f"{number(low, digits)} to {number(high, digits)}" if np.isfinite([low, high]).all() else NONE


@dataclass(frozen=True, eq=False)
class Column:
    """A column: heading, unit (empty: none), the values of its rows, and how each of them is written; texts
    (`form` is `str`) are set to the left, numbers to the right.
    """

    heading: str
    unit: str = ""
    values: Iterable[Any] = ()
    form: Callable[[Any], str] = number

    @property
    def numeric(self) -> bool:
        """Whether it holds numbers."""
        return self.form is not str

    @property
    def head(self) -> str:
        """Heading and unit in a line: `Frequency (Hz)`."""
        return f"{self.heading} ({self.unit})" if self.unit else self.heading

    @cached_property
    def cells(self) -> tuple[str, ...]:
        """The rows as they are written."""
        return tuple(map(self.form, self.values))


def words(heading: str, values: Iterable[Any] = (), unit: str = "") -> Column:
    """A column of text, which is set to the left."""
    return Column(heading, unit, values, str)


def several(
    headings: Iterable[str], unit: str, values: Any, form: Callable[[Any], str] = number
) -> list[Column]:
    """A column a heading, of values (rows, headings)."""
    return [Column(head, unit, own, form) for head, own in zip(headings, np.transpose(values), strict=True)]


def limited(
    heading: str, unit: str, values: Iterable[Array], form: Callable[[Any], str] = number
) -> list[Column]:
    """Three columns: a value and its 95 % limits."""
    return [Column(h, unit, v, form) for h, v in zip((heading, "95 % low", "95 % high"), values, strict=True)]


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of the same length under a title; note: a sentence below."""

    title: str
    columns: Sequence[Column]
    note: str = ""

    @classmethod
    def of(cls, title: str, heads: Sequence[Column], rows: Iterable[Sequence[Any]], note: str = "") -> Table:
        """A table of values by row."""
        values = list(zip(*rows, strict=True)) or [()] * len(heads)
        columns = [replace(head, values=own) for head, own in zip(heads, values, strict=True)]
        return cls(title, columns, note)

    @cached_property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """Finished text, row by row."""
        return tuple(zip(*(column.cells for column in self.columns), strict=True))

    def part(self, rows: slice = slice(None), headings: Sequence[str] = (), note: str = "") -> Table:
        """Some of its rows; of the columns with these headings, without headings of all of them."""
        columns = [
            Column(c.heading, c.unit, c.cells[rows], str if c.form is str else ready)
            for c in self.columns
            if not headings or c.heading in headings
        ]
        return Table(self.title, columns, note)


@dataclass(frozen=True, eq=False)
class Curves:
    """The numbers behind a figure: columns of numbers; note: what else a reader of the file must know, in
    lines.
    """

    title: str
    columns: Sequence[Column]
    note: str = ""

    @property
    def values(self) -> Array:
        """Numbers (rows, columns)."""
        return np.column_stack([np.asarray(column.values, dtype=float) for column in self.columns])


def unit(text: str) -> str:
    """A unit as it is printed: `m/s^2/N` becomes `m/s²/N`, `N m/rad` becomes `N·m/rad`."""
    return text.replace("^2", "²").replace("^3", "³").replace(" ", "·")


def sentence(text: str) -> str:
    """A note as a sentence: a capital in front, a full stop behind."""
    return capital(text) + ("" if text.endswith(".") else ".")
