"""Processes that do the work of a run."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from identify.fitting.processes import Processes


def test_results_come_in_the_order_of_the_tasks_whichever_is_ready_first() -> None:
    with Processes(2) as processes:
        begun = processes.ordered({"slow": 0.3, "quick": 0.0}, _after, ["slow", "quick"])
        assert list(begun) == ["slow", "quick"]


def test_work_is_begun_before_its_result_is_asked_for(tmp_path: Path) -> None:
    with Processes(1) as processes:
        begun = processes.ordered(tmp_path / "begun", Path.touch, [0o600])
        end = time.monotonic() + 30
        while not (tmp_path / "begun").exists() and time.monotonic() < end:
            time.sleep(0.01)
        assert (tmp_path / "begun").exists()
        assert list(begun) == [None]


def test_an_error_of_the_work_comes_out_and_no_file_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(ZeroDivisionError), Processes(1) as processes:
        assert list(processes.ordered(1, divmod, [1])) == [(1, 0)]
        assert [path.name for path in tmp_path.rglob("*.pickle")] == ["0.pickle"]
        list(processes.ordered(1, divmod, [0]))
    assert not list(tmp_path.iterdir())


def test_every_part_is_worked_on_once_whether_alone_or_with_others() -> None:
    with Processes(2) as processes:
        for small in (False, True):
            found = sorted(processes.run(100, divmod, range(1, 20), small=small))
            assert found == [(number, divmod(100, number + 1)) for number in range(19)]
            assert not list(processes.run(100, divmod, [], small=small))


def test_a_process_keeps_the_latest_thing_only() -> None:
    first, second = [0], [0]
    with Processes(1) as processes:
        things = (first, first, second, first)
        assert [list(processes.ordered(thing, _longer, [1])) for thing in things] == [[2], [3], [2], [2]]


def _longer(thing: list[int], part: int) -> int:
    thing.append(part)
    return len(thing)


def _after(seconds: dict[str, float], said: str) -> str:
    time.sleep(seconds[said])
    return said


def _own_number(thing: str, part: int) -> int:
    return os.getpid()


@pytest.mark.skipif(sys.platform == "win32", reason="sends signals as POSIX has them")
def test_a_kill_of_the_whole_group_is_left_to_the_parent() -> None:
    """As a job scheduler sends it; a pool whose processes are gone would be waited for without end."""
    with Processes(2) as pool:
        for pid in {pid for _, pid in pool.run("thing", _own_number, range(8))}:
            os.kill(pid, signal.SIGTERM)
        assert len(list(pool.run("thing", _own_number, range(8)))) == 8
