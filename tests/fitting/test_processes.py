"""Processes that do the work of a run."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from identify.fitting.processes import Processes


def test_results_come_in_the_order_of_the_tasks_whichever_is_ready_first() -> None:
    with Processes(2, int) as processes:
        begun = processes.ordered(_after, [(0.3, "slow"), (0.0, "quick")])
        assert list(begun) == ["slow", "quick"]


def test_work_is_begun_before_its_result_is_asked_for(tmp_path: Path) -> None:
    with Processes(1, int) as processes:
        begun = processes.ordered(Path.touch, [(tmp_path / "begun",)])
        end = time.monotonic() + 30
        while not (tmp_path / "begun").exists() and time.monotonic() < end:
            time.sleep(0.01)
        assert (tmp_path / "begun").exists()
        assert list(begun) == [None]


def test_an_error_of_the_work_comes_out() -> None:
    with Processes(1, int) as processes, pytest.raises(ZeroDivisionError):
        list(processes.ordered(divmod, [(1, 0)]))


def _after(seconds: float, said: str) -> str:
    time.sleep(seconds)
    return said
