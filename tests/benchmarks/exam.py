"""The tests that the suite leaves out because they take long: how each ended, stored with its seconds.

    python -m tests.benchmarks.exam [-n logical]

The exit code is that of pytest.  A part of them: `pytest -m exam tests/...`, which stores nothing.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from identify.core.version import VERSION

RESULTS = Path(__file__).parent / "results" / "exam.json"


class Kept:
    """A plugin of pytest that remembers how each test ended."""

    def __init__(self) -> None:
        self.tests: dict[str, dict[str, str | float]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Setup, call and teardown of one test: the worst of their outcomes, the sum of their seconds."""
        before = self.tests.get(report.nodeid, {"outcome": "passed", "seconds": 0.0})
        outcome = before["outcome"] if report.passed else report.outcome
        seconds = round(float(before["seconds"]) + report.duration, 1)
        self.tests[report.nodeid] = {"outcome": outcome, "seconds": seconds}


def main(words: Sequence[str], path: Path = RESULTS) -> int:
    """Run the tests, store what they found, and return the exit code."""
    kept = Kept()
    ended = pytest.main(["-m", "exam", "--dist", "load", *words], plugins=[kept])
    found = {"version": VERSION, "tests": dict(sorted(kept.tests.items()))}
    path.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return int(ended)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
