"""Processes of this machine that do the work of a run: they end with it, and leave Ctrl-C to it."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, nullcontext
from importlib import import_module
from itertools import chain
from multiprocessing.synchronize import Event
from multiprocessing.util import Finalize
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from identify.core.errors import InputError
from identify.core.interruption import ask, check, children_unasked
from identify.core.threads import one_thread, processors, work_in

Thing = TypeVar("Thing")
Part = TypeVar("Part")
Made = TypeVar("Made")
_LOOK_S, _GRACE_S = 0.2, 5.0
"""How often it is looked whether the end was asked for, and how long a process may take to its next step."""
_STACKS = 4
"""In which small parts are sent to each process."""


class Processes(AbstractContextManager["Processes"]):
    """So many processes, each of which imports the modules before any work.

    They start at once and side by side, importing while their parent reads.  The thing that they work on may
    be large and is not given to them here but in a file: a process that has it sent takes it only when it has
    imported everything, and the next would not start before.  The file is written once, when the thing is
    first worked on; each process keeps only the latest thing.
    """

    def __init__(self, count: int, *modules: str) -> None:
        context = multiprocessing.get_context("spawn")  # the engine's threads do not survive a fork
        self.count, self._end = count, context.Event()
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._files: dict[int, tuple[object, Path]] = {}
        self._pool = ProcessPoolExecutor(count, context, _start, (self._end, modules))
        with children_unasked():
            for _ in range(count):
                self._pool.submit(_nothing)

    def run(
        self, thing: Thing, work: Callable[[Thing, Part], Made], parts: Sequence[Part], *, small: bool = False
    ) -> Iterator[tuple[int, Made]]:
        """The number of each part with what `work` makes of the thing and of it, as they come; small: parts
        are sent several at a time.  Where there are more processes than parts, each works in several threads.

        Interrupted where the user asked for the end; InputError where a process was killed.
        """
        count = _STACKS * self.count if small else len(parts)
        stacks = [range(number, len(parts), count) for number in range(min(count, len(parts)))]
        threads = max(1, min(self.count, processors()) // max(1, len(stacks)))
        chosen = [[parts[number] for number in stack] for stack in stacks]
        futures = self._submitted(thing, work, chosen, threads)
        left = dict(zip(futures, stacks, strict=True))
        while left:
            check()
            for future in wait(left, timeout=_LOOK_S, return_when=FIRST_COMPLETED).done:
                yield from zip(left.pop(future), _result(future), strict=True)

    def ordered(
        self, thing: Thing, work: Callable[[Thing, Part], Made], parts: Sequence[Part]
    ) -> Iterator[Made]:
        """What `work` makes of the thing and of each part, in order; it has begun when this returns."""
        return chain.from_iterable(map(_awaited, self._submitted(thing, work, [[part] for part in parts])))

    def _submitted(
        self,
        thing: Thing,
        work: Callable[[Thing, Part], Made],
        stacks: Sequence[list[Part]],
        threads: int = 1,
    ) -> list[Future[list[Made]]]:
        path = self._file(thing)
        with children_unasked():
            return [self._pool.submit(_made, path, work, stack, threads) for stack in stacks]

    def _file(self, thing: object) -> Path:
        """Where processes find it."""
        if id(thing) not in self._files:
            path = Path(self._folder.name) / f"{len(self._files)}.pickle"
            path.write_bytes(pickle.dumps(thing, pickle.HIGHEST_PROTOCOL))
            self._files[id(thing)] = thing, path  # with the thing, or another could get its id
        return self._files[id(thing)][1]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self._end.set()
        self._pool.shutdown(cancel_futures=True)
        self._folder.cleanup()


def several(count: int, *modules: str) -> AbstractContextManager[Processes | None]:
    """So many processes; none where one is enough: then this one does the work."""
    return Processes(count, *modules) if count > 1 else nullcontext()


def _awaited(future: Future[list[Made]]) -> list[Made]:
    """Its result; Interrupted where the user asked for the end before it came."""
    while not wait([future], timeout=_LOOK_S).done:
        check()
    return _result(future)


def _result(future: Future[list[Made]]) -> list[Made]:
    try:
        return future.result()
    except BrokenProcessPool as error:
        check()  # they are killed with this process, and may be gone first
        fix = "resume with `--resume`, with fewer `--workers` where memory is short"
        raise InputError("--workers", "a worker process was killed", fix=fix) from error


_latest: dict[Path, Any] = {}
"""Of a process: what it works on, by its file."""


def _made(path: Path, work: Callable[[Any, Part], Made], parts: list[Part], threads: int) -> list[Made]:
    work_in(threads)
    if path not in _latest:
        _latest.clear()
        _latest[path] = pickle.loads(path.read_bytes())  # written by the parent
    return [work(_latest[path], part) for part in parts]


def _nothing() -> None:
    """Work for which a process is started."""


def _start(end: Event, modules: Sequence[str]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):  # to a whole terminal or group; the parent decides
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threading.Thread(target=_end_when_told, args=(end,), daemon=True).start()
    sys.stdout = sys.stderr  # output is the parent's
    for module in modules:
        import_module(module)
    one_thread()
    # At the end nothing is left to write, and to take down all libraries takes half a second.
    Finalize(None, os._exit, (0,), exitpriority=-1)


def _end_with_parent() -> None:
    """A pool's processes wait for work for ever, also when the run that started them was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _end_when_told(end: Event) -> None:
    """The work under way ends at its next step, or with the process."""
    end.wait()
    ask()
    time.sleep(_GRACE_S)
    os._exit(1)
