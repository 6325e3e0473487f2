"""Evidence by invariance: what repeats the same data adds nothing to it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from identify.discovery.evidence import EvidenceCriterion, closed, removed
from identify.discovery.task import Task, Trial


def _trial(squares: float, free: int, count: int = 1000) -> Trial:
    return Trial(Task((), (), {}), {}, squares, count, free=free)


@pytest.mark.parametrize("times", [2, 7])
def test_data_that_are_there_several_times_are_no_more_evidence(times: int) -> None:
    """Every number repeated, and inflation knows it: chi-square and the price of a parameter stay."""
    before, after = _trial(1400.0, 10), _trial(1000.0, 13)
    again = [_trial(times * one.squares, one.free, times * one.count) for one in (before, after)]
    whole = EvidenceCriterion(2.0).log_odds(before, after)
    assert EvidenceCriterion(2.0 * times).log_odds(*again) == pytest.approx(whole)
    assert EvidenceCriterion(2.0).log_odds(*again) > whole + 50


def test_the_price_of_a_parameter_is_that_of_schwarz() -> None:
    """At the same squares, ln of the number of independent data per parameter, and no inflation below 1."""
    for inflation, data in ((1.0, 1000.0), (4.0, 250.0), (0.2, 1000.0)):
        judge = EvidenceCriterion(inflation)
        assert judge.log_odds(_trial(500.0, 10), _trial(500.0, 12)) == pytest.approx(-math.log(data))


def test_errors_of_what_was_stated_are_no_correlated_residuals() -> None:
    """They count in full, however much the residuals count for less."""
    before, after = replace(_trial(1400.0, 10), errors=200.0), replace(_trial(1200.0, 10), errors=20.0)
    assert EvidenceCriterion(4.0).log_odds(before, after) == pytest.approx((20 / 4 + 180) / 2)


def test_a_gap_counts_above_noise() -> None:
    assert removed(3.0, 2.0) == pytest.approx(0.5)
    assert removed(3.0, 3.5) < 0


@pytest.mark.parametrize(
    ("gap", "validation", "is_closed"),
    [(1.05, 1.06, True), (1.05, 1.4, False), (1.09, 1.11, True), (1.2, 1.0, False)],
)
def test_a_gap_that_is_open_elsewhere_is_not_closed(gap: float, validation: float, is_closed: bool) -> None:
    """Two postures that resemble each other hide in wrong stiffnesses what a third one shows; what removes it
    there explains it.
    """

    def trial(gap: float, validation: float) -> Trial:
        return Trial(Task((), (), {}), {}, 1e5 * gap**2, 100_000, 1e5 * validation**2, 100_000, 5)

    assert closed(trial(gap, validation)) is is_closed
    assert closed(_trial(1000 * gap**2, 5)) is (gap < 1.1)
