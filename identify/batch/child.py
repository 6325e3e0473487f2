"""A worker process seen from its parent: started when first needed, given one job at a time, killed when the
time is up.

Every thread has a worker of its own, so that `perform` may run in the threads of this process and of a Dask
worker alike.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from typing import IO, Any

from identify.batch.job import JobOutcome
from identify.results.provenance import computing, differing

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_TAIL = 400
_START_S = 300.0
"""Seconds in which a worker has to be there: imports from a cold network file system are slow."""
_END_S, _LOOK_S = 5.0, 0.2
_mine = threading.local()
_all: set[Child] = set()
_ended: set[str] = set()
"""Batches that have ended."""
_lock = threading.Lock()


def perform(
    call: str,
    arguments: Mapping[str, Any],
    attempt: int,
    limit_s: float | None,
    batch: str = "",
    versions: tuple[str, ...] = (),
) -> JobOutcome:
    """Run a job in this thread's worker process and wait for it; whatever happens is an outcome.

    batch: what `end` is told to end it by; versions: what it must be computed with, here as `computing` says
    unless told.
    """
    child: Child | None = getattr(_mine, "child", None)
    if child is None or not child.alive:
        child = _mine.child = Child(call.partition(":")[0])
    with _lock:
        if batch in _ended:
            return JobOutcome("lost", "its batch has ended")
        child.batch = batch
    try:
        request = {"call": call, "arguments": dict(arguments), "attempt": attempt}
        return child.run(request, limit_s, versions or computing())
    finally:
        child.batch = None


def end(batch: str) -> None:
    """Begin no job of a batch in this process any more, and kill what does one: on a cluster, nobody else
    can.
    """
    with _lock:
        _ended.add(batch)
        children = [child for child in _all if child.batch == batch]
    for child in children:
        child.kill()


def kill_all() -> None:
    """Kill every worker process of this process, idle or not."""
    with _lock:
        children = list(_all)
    for child in children:
        child.kill()


def close_all() -> None:
    """The same, when no thread runs a job any more."""
    with _lock:
        children = list(_all)
    for child in children:
        child.close()


class Child:
    """One worker process; module: what it imports before it says that it is ready."""

    def __init__(self, module: str) -> None:
        self._said: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process that writes to it
        self._process = subprocess.Popen(
            [sys.executable, "-m", "identify.batch.worker", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env={**os.environ, **dict.fromkeys(_THREADS, "1")},
            start_new_session=True,
        )
        self.batch: str | None = None
        self._versions: tuple[str, ...] = ()
        self._heard: queue.Queue[bytes] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()
        with _lock:
            _all.add(self)

    @property
    def alive(self) -> bool:
        """Whether the process still runs."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """Its process number."""
        return self._process.pid

    def run(self, request: Mapping[str, Any], limit_s: float | None, versions: tuple[str, ...]) -> JobOutcome:
        """Run one job; limit_s: seconds after which the process is killed, None: never; versions: those that
        the process must have.
        """
        began = time.perf_counter()
        if not self._versions:
            answer, late = self._ask(None, _START_S)
            if answer is None:
                return self._lost(f"a worker could not be started ({self._why(late)})", began)
            self._versions = tuple(answer["ready"])
        if self._versions != versions:
            other = f"{differing(self._versions, versions)}; the batch is computed with"
            return self._lost(f"a worker has {other} {differing(versions, self._versions)}", began)
        began = time.perf_counter()
        answer, late = self._ask(request, limit_s)
        if answer is not None:
            return JobOutcome(**answer)
        if late:
            self.close()
            return JobOutcome(
                "failed",
                f"it had not ended after the time limit of {limit_s:g} s",
                seconds=time.perf_counter() - began,
            )
        return self._lost(f"its worker process died ({self._why(late)})", began)

    def kill(self) -> None:
        """Kill the process; a thread that waits for an answer gets none."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Kill the process and forget it."""
        self.kill()
        with _lock:
            _all.discard(self)
        for pipe in (self._process.stdin, self._said):
            with contextlib.suppress(BrokenPipeError):
                if pipe is not None:
                    pipe.close()

    def _ask(
        self, request: Mapping[str, Any] | None, limit_s: float | None
    ) -> tuple[dict[str, Any] | None, bool]:
        """The answer to a request (None: the first greeting), None where there is none; whether the time was
        up.
        """
        try:
            if request is not None and self._process.stdin is not None:
                self._process.stdin.write(json.dumps(request).encode() + b"\n")
                self._process.stdin.flush()
        except (BrokenPipeError, ValueError):
            return None, False
        end = None if limit_s is None else time.monotonic() + limit_s
        while True:
            alive = (
                self.alive
            )  # asked before looking, so that the last words of one that has just ended are heard
            with contextlib.suppress(queue.Empty):
                line = self._heard.get(timeout=_LOOK_S)
                return (json.loads(line) if line.endswith(b"\n") else None), False
            if not alive:
                return None, False
            if end is not None and time.monotonic() > end:
                self._process.kill()
                return None, True

    def _listen(self) -> None:
        """Pass on what the process says; the end of its output alone is not trusted to tell that it ended."""
        if self._process.stdout is not None:
            with (
                self._process.stdout as source
            ):  # closed here, because to close what another thread reads waits for that
                for line in source:
                    self._heard.put(line)

    def _lost(self, sentence: str, began: float) -> JobOutcome:
        self.close()
        return JobOutcome("lost", sentence, seconds=time.perf_counter() - began)

    def _why(self, late: bool) -> str:
        """What is known of the end of the process: its exit code and the last it said."""
        try:
            code = self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self.kill()
            code = self._process.wait()
        self._said.seek(0)
        said = self._said.read().decode(errors="replace").strip()[-_TAIL:].splitlines()
        ended = (
            f"no sign of it after {_START_S:g} s"
            if late
            else f"signal {-code}"
            if code < 0
            else f"exit code {code}"
        )
        return f"{ended}: {said[-1]}" if said else ended
