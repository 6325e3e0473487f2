"""The loop over the jobs of a batch, written once: a few under way at a time, each change in the index,
failures tried again.

A job that fails or takes too long is tried once more, after all others, when what was wrong may have passed.
One whose worker died is begun up to four times, as Dask does, because that need not be the job's fault.  A
full disk ends the batch: what is under way is waited for, the rest waits for `--resume`.

The index of a batch is a JSON file that says at any moment what is done, under way, failed and waiting, one
job a line.

It is written whole.  Because it grows with the batch, it is written at once only while that is cheap: at most
a twentieth of the time goes into it, and never more than the last seconds are missing from it.  Results do
not depend on it.
"""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from identify.batch.executor import Executor
from identify.batch.job import Job, JobOutcome
from identify.core.atomic import write_text
from identify.core.errors import InputError
from identify.core.interruption import Interrupted, check

SCHEMA = "identify-index/1"
State = Literal["waiting", "running", "done", "failed"]
_SHARE = 20.0
_LEAST_S = 0.2


@dataclass
class Entry:
    """One job: its state, how often it was begun, its result file, seconds of work, why it failed last.

    kept: it was finished before.
    """

    state: State = "waiting"
    attempts: int = 0
    result: str = ""
    seconds: float = 0.0
    error: str = ""
    kept: bool = False


@dataclass
class BatchIndex:
    """All jobs of a batch by name, in their order; about: keys that stand above them."""

    path: Path
    about: dict[str, Any]
    jobs: dict[str, Entry] = field(default_factory=dict)
    state: str = "running"
    began: float = field(default_factory=time.monotonic)
    _next: float = 0.0

    def counts(self) -> dict[str, int]:
        """How many jobs are in each state."""
        found = Counter(entry.state for entry in self.jobs.values())
        return {state: found.get(state, 0) for state in ("waiting", "running", "done", "failed")}

    def changed(self) -> None:
        """Write the file if it is time; raises InputError where it cannot be written."""
        if time.monotonic() >= self._next:
            self.write()

    def write(self) -> None:
        """Write the file now."""
        before = time.monotonic()
        write_text(self.path, self._text(), "make room and resume with `--resume`")
        after = time.monotonic()
        self._next = after + max(_LEAST_S, _SHARE * (after - before))

    def _text(self) -> str:
        written, seconds = (
            datetime.now(UTC).isoformat(timespec="seconds"),
            round(time.monotonic() - self.began, 1),
        )
        head = {
            "schema": SCHEMA,
            **self.about,
            "state": self.state,
            "written": written,
            "seconds": seconds,
            "counts": self.counts(),
        }
        lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
        rows = [f"    {json.dumps(name)}: {json.dumps(vars(entry))}" for name, entry in self.jobs.items()]
        return "{\n" + ",\n".join(lines) + ',\n  "jobs": {\n' + ",\n".join(rows) + "\n  }\n}\n"


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
