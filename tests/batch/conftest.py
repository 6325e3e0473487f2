"""What the tests of batches share: a Dask cluster of two worker processes, and executors by name."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor as Pool
from concurrent.futures import Future
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.batch import child, run
from identify.batch.child import perform
from identify.batch.executor import Executor, open_executor
from identify.batch.job import JobOutcome, failure
from identify.map import run as mapping

ROOT = Path(__file__).parents[2]
Opener = Callable[[], contextlib.AbstractContextManager[Executor]]


@pytest.fixture(scope="session", autouse=True)
def workers_find_the_tests() -> Iterator[None]:
    """Workers import `tests.batch.jobs`, wherever pytest was started."""
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), before]))
    yield
    if before is None:
        del os.environ["PYTHONPATH"]
    else:
        os.environ["PYTHONPATH"] = before


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of a local Dask scheduler with two worker processes; skips where Dask is not installed.  It
    ends with the tests of a file: idle, it takes a tenth of a processor.
    """
    distributed = pytest.importorskip(
        "distributed", reason="Dask is not installed (the extra `cluster`): its executor is not tested"
    )
    silence = logging.CRITICAL
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        silence_logs=silence,
        memory_limit=0,
    ) as made:
        yield made.scheduler_address


@pytest.fixture(params=["local", "dask"])
def opener(request: pytest.FixtureRequest) -> Opener:
    """Opens an executor of two workers."""
    if request.param == "local":
        return lambda: open_executor(2)
    address = request.getfixturevalue("cluster")
    return lambda: open_executor(cluster=address)


class Inline(Pool):
    """Jobs in this process, one after the other: no workers to start where they are not what is tested."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The call is that of `identify.batch.child.perform`."""
        call, attempt = args[0], args[2]
        arguments = json.loads(json.dumps(dict(args[1])))  # as it reaches a worker
        module, name = call.split(":")
        future: Future[Any] = Future()
        begun = time.perf_counter()
        try:
            outcome = JobOutcome(
                "done", value=getattr(import_module(module), name)(**arguments, attempt=attempt) or {}
            )
        except Exception as error:
            outcome = failure(error)
        future.set_result(
            JobOutcome(outcome.ended, outcome.error, outcome.value, time.perf_counter() - begun)
        )
        return future


@contextlib.contextmanager
def always(executor: Executor) -> Iterator[None]:
    """Batches and maps use this executor, and leave it open."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (run, mapping):
            patch.setattr(module, "open_executor", lambda workers, cluster: contextlib.nullcontext(executor))
        yield


def in_this_process() -> contextlib.AbstractContextManager[None]:
    """Batches and maps run their jobs one after the other, without workers."""
    return always(Executor(partial(Inline().submit, perform), lambda: 1, "this process"))


@pytest.fixture
def at_once() -> Iterator[None]:
    """Batches and maps run in this process."""
    with in_this_process():
        yield


def kill_one(executor: Executor, rng: np.random.Generator) -> bool:
    """Kill a worker process: one of ours, or one of Dask's with all that is below it; whether there was
    one.
    """
    pids = [one.pid for one in list(child._all)]
    client = getattr(getattr(executor.begin, "__self__", None), "client", None)
    if client is not None:
        pids = list(client.run(os.getpid).values())
    if pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(int(pids[rng.integers(len(pids))]), signal.SIGKILL)
    return bool(pids)
