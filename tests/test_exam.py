"""An exam says how each test ended: the worst of its setup, call and teardown."""

from __future__ import annotations

from typing import Any

import pytest

from tests.benchmarks.exam import Kept


def report(when: Any, outcome: Any, seconds: float) -> pytest.TestReport:
    return pytest.TestReport("one", ("one", 1, "one"), {}, outcome, None, when, duration=seconds)


@pytest.mark.parametrize(
    ("outcomes", "told"),
    [
        (("passed", "passed", "passed"), "passed"),
        (("passed", "failed", "passed"), "failed"),
        (("passed", "passed", "failed"), "failed"),
        (("skipped", "passed"), "skipped"),
    ],
)
def test_the_worst_of_a_test_is_kept(outcomes: tuple[str, ...], told: str) -> None:
    kept = Kept()
    for when, outcome in zip(("setup", "call", "teardown"), outcomes, strict=False):
        kept.pytest_runtest_logreport(report(when, outcome, 1.5))
    assert kept.tests == {"one": {"outcome": told, "seconds": 1.5 * len(outcomes)}}
