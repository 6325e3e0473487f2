"""Who does the jobs: processes of this machine, or the workers of a Dask scheduler, behind one interface.

Either way `identify.batch.child.perform` runs in a thread, with a worker process of its own: a thread of this
process, or of a Dask worker.  So the time limit, a killed worker and a crash are handled in one place.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor as Pool
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module

from identify.batch.child import close_all, kill_all, perform
from identify.batch.job import Job, JobOutcome
from identify.core.errors import InputError
from identify.core.threads import processors

_CONNECT_S = 10.0
_ASK_S = 2.0
_LEAST_ON_CLUSTER = 8
"""Jobs kept in the queue of a cluster without workers, so that one that grows with its queue begins to."""


@dataclass(frozen=True)
class Executor:
    """pool runs calls; slots: how many jobs to keep under way, which may change; about: what it is, for
    people.
    """

    pool: Pool
    slots: Callable[[], int]
    about: str

    def submit(self, job: Job, attempt: int, limit_s: float | None) -> Future[JobOutcome]:
        """Begin a job; the future never raises but where the pool itself is gone."""
        return self.pool.submit(perform, job.call, job.arguments, attempt, limit_s)


@contextmanager
def open_executor(workers: int | None = None, cluster: str | None = None) -> Iterator[Executor]:
    """An executor with that many local workers (default: one per processor), or on the Dask scheduler at an
    address.

    At the end its workers are ended, those of a cluster are left.  InputError where there is no scheduler, or
    no Dask.
    """
    if cluster is not None:
        with _dask(cluster) as executor:
            yield executor
        return
    count = workers or processors()
    pool = ThreadPoolExecutor(count, thread_name_prefix="identify-worker")
    try:
        yield Executor(pool, lambda: count, f"{count} local worker{'s' if count > 1 else ''}")
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        kill_all()
        pool.shutdown(wait=True)
        close_all()


@contextmanager
def _dask(address: str) -> Iterator[Executor]:
    try:
        dask = import_module("distributed")  # an optional extra
    except ImportError as error:
        raise InputError(
            "--cluster",
            "Dask is not installed",
            fix='run `pip install ".[cluster]"` in the folder of identify',
        ) from error
    try:
        client = dask.Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        expected = "the address of a running Dask scheduler, such as tcp://10.0.0.5:8786"
        raise InputError(
            "--cluster", f"no scheduler answers at {address} ({error})", expected, "see docs/cluster.md"
        ) from error
    pool = client.get_executor(pure=False)
    seen = [-_ASK_S, 0]

    def slots() -> int:
        if time.monotonic() - seen[0] > _ASK_S:
            seen[:] = [time.monotonic(), sum(client.nthreads().values())]
        return max(_LEAST_ON_CLUSTER, 2 * int(seen[1]))

    try:
        yield Executor(
            pool, slots, f"Dask at {address}, {sum(client.nthreads().values())} workers at the start"
        )
    finally:
        pool.shutdown(wait=False)
        client.close()
