"""The limit of one thread reaches scipy's own library for linear algebra, which is loaded late; processes
beside each other work in one thread.
"""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from identify.core import threads as own
from identify.fitting import processes as fitting_processes
from identify.fitting.processes import Processes

_COUNT = """
from threadpoolctl import threadpool_info
{limit}:
    import scipy.linalg
    print(*(library["num_threads"] for library in threadpool_info()))
"""


def threads(limit: str) -> set[str]:
    """Threads of every library for linear algebra in a new process, two allowed by its environment."""
    several = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "2")
    code = _COUNT.format(limit=limit)
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **several},
        capture_output=True,
        text=True,
        check=True,
    )
    return set(done.stdout.split())


def test_one_thread_in_every_library() -> None:
    assert threads("from identify.core.threads import one_thread\nwith one_thread()") == {"1"}


def test_a_limit_before_scipy_is_loaded_does_not_reach_it() -> None:
    if "2" not in threads("if True"):
        pytest.skip("the libraries here do not take two threads")
    assert "2" in threads("from threadpoolctl import threadpool_limits\nwith threadpool_limits(1)")


@pytest.mark.parametrize("count", [1, 2])
def test_parts_are_worked_on_in_their_order_and_an_error_comes_out(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own, "threads", lambda: count)
    assert own.each(abs, [-3, 2, -1]) == [3, 2, 1]
    with pytest.raises(TypeError, match="bad operand"):
        own.each(abs, [-3, "x"])  # type: ignore[list-item]


def test_processes_share_the_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    """This one works in as many threads as there are processors, up to some; those of a pool in one each
    where all are at work, and in the others' too where they are not.
    """
    count = "from identify.core import threads\nprint(threads.threads())"
    done = subprocess.run([sys.executable, "-c", count], capture_output=True, text=True, check=True)
    assert int(done.stdout) == min(own.processors(), own._MOST)
    for processors, alone in ((2, 2), (1, 1)):
        monkeypatch.setattr(fitting_processes, "processors", lambda count=processors: count)
        with Processes(2) as processes:
            assert sorted(processes.run(None, _threads, [0, 1])) == [(0, 1), (1, 1)]
            assert list(processes.run(None, _threads, [0])) == [(0, alone)]
            assert list(processes.ordered(None, _threads, [0])) == [1]


def _threads(*_: object) -> int:
    return own.threads()
