"""Processes of this machine that do the work of a run: they end with it, and leave Ctrl-C to it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from multiprocessing.synchronize import Event
from multiprocessing.util import Finalize
from types import TracebackType
from typing import Any, TypeVar

from identify.core.errors import InputError
from identify.core.interruption import ask, check, children_unasked
from identify.core.threads import beside_others, one_thread

T = TypeVar("T")
_LOOK_S = 0.2


class Processes(AbstractContextManager["Processes"]):
    """So many processes, each of which calls `begin` once, before any work.

    They start at once and side by side, importing what `begin` needs while their parent reads.  What is large
    is not given to them here but in a file: a process that has it sent takes it only when it has imported
    everything, and the next would not start before.
    """

    def __init__(self, count: int, begin: Callable[[], object]) -> None:
        context = multiprocessing.get_context("spawn")  # the engine's threads do not survive a fork
        self.count, self._end = count, context.Event()
        self._pool = ProcessPoolExecutor(count, context, _start, (self._end, begin))
        with children_unasked():
            for _ in range(count):
                self._pool.submit(_nothing)

    def run(self, work: Callable[..., T], tasks: Sequence[tuple[Any, ...]]) -> Iterator[tuple[int, T]]:
        """The number of each task with what `work` makes of it, as they come.

        Interrupted where the user asked for the end; InputError where a process was killed.
        """
        left = {future: number for number, future in enumerate(self._submitted(work, tasks))}
        while left:
            check()
            for future in wait(left, timeout=_LOOK_S, return_when=FIRST_COMPLETED).done:
                yield left.pop(future), _result(future)

    def ordered(self, work: Callable[..., T], tasks: Sequence[tuple[Any, ...]]) -> Iterator[T]:
        """What `work` makes of each task, in their order; it has begun when this returns."""
        return map(_awaited, self._submitted(work, tasks))

    def _submitted(self, work: Callable[..., T], tasks: Sequence[tuple[Any, ...]]) -> list[Future[T]]:
        with children_unasked():
            return [self._pool.submit(work, *task) for task in tasks]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self._end.set()
        self._pool.shutdown(cancel_futures=True)


def _awaited(future: Future[T]) -> T:
    """Its result; Interrupted where the user asked for the end before it came."""
    while not wait([future], timeout=_LOOK_S).done:
        check()
    return _result(future)


def _result(future: Future[T]) -> T:
    try:
        return future.result()
    except BrokenProcessPool as error:
        check()  # they are killed with this process, and may be gone first
        fix = "resume with `--resume`, with fewer `--workers` where memory is short"
        raise InputError("--workers", "a process that tried a model was killed", fix=fix) from error


def _nothing() -> None:
    """Work for which a process is started."""


def _start(end: Event, begin: Callable[[], object]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to a whole terminal; the parent decides
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threading.Thread(target=_end_when_told, args=(end,), daemon=True).start()
    one_thread()
    beside_others()
    begin()
    # At the end nothing is left to write, and to take down all libraries takes half a second.
    Finalize(None, os._exit, (0,), exitpriority=-1)


def _end_with_parent() -> None:
    """A pool's processes wait for work for ever, also when the run that started them was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _end_when_told(end: Event) -> None:
    """The work under way ends at its next step."""
    end.wait()
    ask()
