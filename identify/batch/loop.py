"""The loop over the jobs of a batch, written once: a few under way at a time, each change in the index,
failures tried again.

A job that fails or takes too long is tried once more, after all others, when what was wrong may have passed.
One whose worker died is begun up to four times, as Dask does, because that need not be the job's fault.  A
full disk ends the batch: what is under way is waited for, the rest waits for `--resume`.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait

from identify.batch.executor import Executor
from identify.batch.index import BatchIndex
from identify.batch.job import Job, JobOutcome
from identify.core.errors import InputError
from identify.core.interruption import Interrupted, check

_MOST = {"failed": 2, "lost": 4}
"""How often a job that ended so is begun in all."""
_WAIT_S = 0.5
_ARRIVES_S = 60.0
"""Seconds in which the first result must arrive: network file systems tell what is new once a minute."""
_NO_ROOM = (
    "the disk is full",
    "room for the results",
    "make room and resume with `--resume`; what is finished is kept",
)


Watch = Callable[[BatchIndex], None]


def _unwatched(index: BatchIndex) -> None:
    """Nobody looks."""


def run_jobs(
    jobs: Iterable[Job],
    executor: Executor,
    index: BatchIndex,
    limit_s: float | None,
    watch: Watch = _unwatched,
) -> None:
    """Run all jobs, which the index has by name; watch is shown the index after every change.

    Raises InputError when the disk is full or the scheduler is gone; Interrupted goes through.  The
    index is written at the end.
    """
    try:
        index.write()
        _run(iter(jobs), executor, index, limit_s, watch)
    except (Interrupted, KeyboardInterrupt):
        _leave(index, "interrupted")
        raise
    except InputError as error:
        _leave(index, f"stopped: {error}")
        raise
    index.state = "finished"
    index.write()


def _leave(index: BatchIndex, state: str) -> None:
    """Say in the index why the batch ended early, if there is room to say it."""
    index.state = state
    for entry in index.jobs.values():
        if entry.state == "running":
            entry.state = "waiting"
    with contextlib.suppress(InputError):
        index.write()


def _run(
    waiting: Iterator[Job], executor: Executor, index: BatchIndex, limit_s: float | None, watch: Watch
) -> None:
    under_way: dict[Future[JobOutcome], Job] = {}
    again: list[Job] = []
    full: InputError | None = None
    seen = False
    while True:
        if full is None:
            _begin(waiting, again, executor, index, limit_s, under_way)
        if not under_way:
            break
        check()
        for future in wait(under_way, timeout=_WAIT_S, return_when=FIRST_COMPLETED).done:
            job = under_way.pop(future)
            outcome = _outcome(future)
            if outcome.ended == "full":
                full = InputError(str(index.path.parent), *_NO_ROOM)
            if _enter(index, job, outcome):
                again.append(job)
            elif not seen and outcome.ended == "done":
                _look_after(job, index)
                seen = True
        index.changed()
        watch(index)
    if full is not None:
        raise full


def _begin(
    waiting: Iterator[Job],
    again: list[Job],
    executor: Executor,
    index: BatchIndex,
    limit_s: float | None,
    under_way: dict[Future[JobOutcome], Job],
) -> None:
    """Put jobs under way while there is room, those that are to be begun again last."""
    while len(under_way) < executor.slots():
        job = next(waiting, None) or (again.pop(0) if again else None)
        if job is None:
            return
        entry = index.jobs[job.name]
        entry.state, entry.attempts = "running", entry.attempts + 1
        under_way[executor.submit(job, entry.attempts, limit_s)] = job


def _look_after(job: Job, index: BatchIndex) -> None:
    """InputError where the result of a job that is done does not arrive: then none will."""
    file = index.path.parent / index.jobs[job.name].result
    late = time.monotonic() + _ARRIVES_S
    while not file.exists():
        check()
        if time.monotonic() > late:
            found = f"{job.name} is done, and its result is not there"
            expected = "a folder that all workers share, at the same path on every machine"
            raise InputError(str(file), found, expected, "see docs/cluster.md")
        time.sleep(_WAIT_S)
        with contextlib.suppress(OSError):
            os.listdir(file.parent)  # asks a network file system anew


def _enter(index: BatchIndex, job: Job, outcome: JobOutcome) -> bool:
    """Put the end of a job into the index; whether it is to be begun again."""
    entry = index.jobs[job.name]
    entry.seconds, entry.error = entry.seconds + outcome.seconds, outcome.error
    if outcome.ended == "done":
        entry.state, entry.kept = "done", bool(outcome.value.get("kept"))
        return False
    once_more = outcome.ended != "full" and entry.attempts < _MOST[outcome.ended]
    entry.state = "waiting" if once_more or outcome.ended == "full" else "failed"
    return once_more


def _outcome(future: Future[JobOutcome]) -> JobOutcome:
    """The outcome in a future; where the pool lost the job, as Dask does when it has killed several workers,
    that it is lost.
    """
    try:
        error = future.exception()
    except CancelledError as gone:
        fix = "start it again and resume with `--resume`; what is finished is kept"
        raise InputError(
            "--cluster", "the scheduler is gone", "one that lasts as long as the batch", fix
        ) from gone
    return future.result() if error is None else JobOutcome("lost", f"{type(error).__name__}: {error}")
