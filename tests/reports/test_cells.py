"""How numbers and units are written."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.core.text import count, listed
from identify.reports.kit.cells import NONE, number, percent, sentence, signed, turns_per_minute, unit


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (12.0504, "12.05"),
        (2214000.0, "2.214e6"),
        (0.00012345, "1.234e-4"),
        (0.0123456, "0.01235"),
        (9999.6, "1.000e4"),
        (1234.4, "1234"),
        (-0.5, "-0.5000"),
        (0.0, "0"),
        (-0.0, "0"),
        (math.nan, NONE),
        (math.inf, "∞"),
        (1, "1.000"),
    ],
)
def test_number(value: float, text: str) -> None:
    assert number(value) == text


@given(st.floats(allow_nan=False, allow_infinity=False).filter(lambda x: x == 0 or 1e-300 < abs(x) < 1e300))
def test_a_number_says_the_value_to_four_digits(value: float) -> None:
    assert float(number(value)) == pytest.approx(value, rel=5.001e-4)


@given(st.floats(min_value=1e-12, max_value=1e12))
def test_a_number_has_four_significant_digits(value: float) -> None:
    digits = number(value).split("e")[0].replace(".", "").lstrip("0")
    assert len(digits) == 4


def test_signs_and_percent() -> None:
    assert (signed(0.00139, 3), signed(-2.0, 3), signed(0.0), signed(math.nan)) == (
        "+0.00139",
        "-2.00",
        "0",
        NONE,
    )
    assert percent(0.0412) == "4.120"
    assert (number(306.7, 2), number(0.0046, 2), number(99999, 2)) == ("310", "0.0046", "1.0e5")


def test_words() -> None:
    assert unit("m/s^2/N") == "m/s²/N"
    assert unit("N m s/rad") == "N·m·s/rad"
    assert (count(1, "line"), count(2, "line")) == ("1 line", "2 lines")
    assert (sentence("a note"), sentence("Done.")) == ("A note.", "Done.")
    assert (listed([]), listed(["a"]), listed(["a", "b", "c"])) == ("", "a", "a, b and c")


def test_speeds_are_whole_turns_from_a_thousand_on() -> None:
    assert [turns_per_minute(rpm) for rpm in (10034.4, 2000.0, 12.5)] == ["10034", "2000", "12.50"]
    assert turns_per_minute(math.inf) == number(math.inf) == "∞"
