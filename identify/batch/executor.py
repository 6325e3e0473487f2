"""Who does the jobs: processes of this machine, or the workers of a Dask scheduler, behind one interface.

Either way `identify.batch.child.perform` runs in a thread, with a worker process of its own: a thread of this
process, or of a Dask worker.  So the time limit, a killed worker and a crash are handled in one place.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from identify.batch.child import close_all, kill_all, perform
from identify.batch.cluster import joined
from identify.batch.job import Job, JobOutcome, performed
from identify.core.threads import processors

_ASK_S = 2.0
_LEAST_ON_CLUSTER = 8
"""Jobs kept in the queue of a cluster without workers, so that one that grows with its queue begins to."""


@dataclass(frozen=True)
class Executor:
    """begin: starts a call with its arguments, attempt and time limit, as `perform` has them; slots: how many
    jobs to keep under way, which may change; about: what it is, for people.
    """

    begin: Callable[[str, Mapping[str, Any], int, float | None], Future[JobOutcome]]
    slots: Callable[[], int]
    about: str

    def submit(self, job: Job, attempt: int, limit_s: float | None) -> Future[JobOutcome]:
        """Begin a job; the future never raises but where the workers themselves are gone."""
        return self.begin(job.call, job.arguments, attempt, limit_s)


def here() -> Executor:
    """An executor that does each job at once, in this process: for what takes less time than to start
    another.
    """

    def begin(
        call: str, arguments: Mapping[str, Any], attempt: int, limit_s: float | None
    ) -> Future[JobOutcome]:
        done = Future[JobOutcome]()
        done.set_result(performed(call, arguments, attempt))
        return done

    return Executor(begin, lambda: 1, "this process")


@contextmanager
def open_executor(workers: int | None = None, cluster: str | None = None) -> Iterator[Executor]:
    """An executor with that many local workers (default: one per processor), or on the Dask scheduler at an
    address.

    At the end its workers are ended; those of a cluster are left, without what they were doing.  InputError
    where there is no scheduler, or no Dask, or workers of other versions.
    """
    if cluster is not None:
        with _dask(cluster) as executor:
            yield executor
        return
    count = workers or processors()
    pool = ThreadPoolExecutor(count, thread_name_prefix="identify-worker")
    try:
        about = f"{count} local worker{'s' if count > 1 else ''}"
        yield Executor(lambda *job: pool.submit(perform, *job), lambda: count, about)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        kill_all()
        pool.shutdown(wait=True)
        close_all()


@contextmanager
def _dask(address: str) -> Iterator[Executor]:
    with joined(address) as cluster:
        seen = [-_ASK_S, 0.0]

        def slots() -> int:
            if time.monotonic() - seen[0] > _ASK_S:
                seen[:] = [time.monotonic(), cluster.threads()]
            return max(_LEAST_ON_CLUSTER, 2 * int(seen[1]))

        about = f"Dask at {address}, {cluster.threads()} workers at the start"
        yield Executor(cluster.submit, slots, about)
