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
from types import TracebackType
from typing import Any, TypeVar

from identify.core.errors import InputError
from identify.core.interruption import ask, check, children_unasked
from identify.core.threads import beside_others, one_thread

T = TypeVar("T")
_LOOK_S = 0.2


class Processes(AbstractContextManager["Processes"]):
    """So many processes, each of which calls `begin` with what is given once, before any work."""

    def __init__(self, count: int, begin: Callable[..., None], *given: Any) -> None:
        context = multiprocessing.get_context("spawn")  # the engine's threads do not survive a fork
        self.count, self._end = count, context.Event()
        self._pool = ProcessPoolExecutor(count, context, _start, (self._end, begin, given))

    def run(self, work: Callable[..., T], tasks: Sequence[tuple[Any, ...]]) -> Iterator[tuple[int, T]]:
        """The number of each task with what `work` makes of it, as they come.

        Interrupted where the user asked for the end; InputError where a process was killed.
        """
        with children_unasked():
            left = {self._pool.submit(work, *task): number for number, task in enumerate(tasks)}
        while left:
            check()
            for future in wait(left, timeout=_LOOK_S, return_when=FIRST_COMPLETED).done:
                yield left.pop(future), _result(future)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self._end.set()
        self._pool.shutdown(cancel_futures=True)


def _result(future: Future[T]) -> T:
    try:
        return future.result()
    except BrokenProcessPool as error:
        check()  # they are killed with this process, and may be gone first
        fix = "resume with `--resume`, with fewer `--workers` where memory is short"
        raise InputError("--workers", "a process that tried a model was killed", fix=fix) from error


def _start(end: Event, begin: Callable[..., None], given: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to a whole terminal; the parent decides
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threading.Thread(target=_end_when_told, args=(end,), daemon=True).start()
    one_thread()
    beside_others()
    begin(*given)


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
