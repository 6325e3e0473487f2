"""How numbers, units and tables are written in every report, so that two reports of one result cannot differ.

Numbers have four significant digits and a decimal point, so that they can be pasted into a study.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True)
class Column:
    """A column: heading, unit (empty: none) and whether it holds numbers, which are set to the right."""

    heading: str
    unit: str = ""
    numeric: bool = True

    @property
    def head(self) -> str:
        """Heading and unit in a line: `Frequency (Hz)`."""
        return f"{self.heading} ({self.unit})" if self.unit else self.heading


def words(heading: str, unit: str = "") -> Column:
    """A column of text, which is set to the left."""
    return Column(heading, unit, numeric=False)


@dataclass(frozen=True)
class Table:
    """Rows of finished text under their columns; note: a sentence below; every row is as long as columns."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class Curves:
    """The numbers behind a figure: values (rows, columns); note: what else a reader of the file must know, in
    lines.
    """

    title: str
    columns: tuple[Column, ...]
    values: NDArray[np.float64]
    note: str = ""


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


def unit(text: str) -> str:
    """A unit as it is printed: `m/s^2/N` becomes `m/s²/N`, `N m/rad` becomes `N·m/rad`."""
    return text.replace("^2", "²").replace("^3", "³").replace(" ", "·")


def sentence(text: str) -> str:
    """A note as a sentence: a capital in front, a full stop behind."""
    return capital(text) + ("" if text.endswith(".") else ".")
