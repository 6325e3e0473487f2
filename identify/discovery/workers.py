"""Many trials at once, in processes of this machine, with a memory: what was tried once is not tried again,
also after a restart.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from functools import partial
from types import TracebackType

from threadpoolctl import threadpool_limits

from identify.discovery.trial import Bench, Task, Trial
from identify.vibration.problem import Problem

Memory = dict[str, tuple[dict[str, float], list[float], str]]
"""By key of a task: values by name; squares, count, squares and count on validation data, free parameters;
failure.
"""
_bench: list[Bench] = []


class Workers(AbstractContextManager["Workers"]):
    """Tries tasks on a problem in `count` processes; with one, in this process.

    memory is filled with every finished trial; `saved` is called after each.
    """

    def __init__(
        self,
        problem: Problem,
        count: int,
        memory: Memory | None = None,
        saved: Callable[[], None] = lambda: None,
    ) -> None:
        self.memory, self._saved = {} if memory is None else memory, saved
        context = multiprocessing.get_context("spawn")  # the engine's threads do not survive a fork
        self._pool = None if count == 1 else ProcessPoolExecutor(count, context, _start, (problem,))
        self._map = partial(map, Bench(problem).run) if self._pool is None else partial(self._pool.map, _run)

    def run(self, tasks: Sequence[Task], done: Callable[[], None] = lambda: None) -> list[Trial]:
        """The trials of all tasks in their order; `done` is called after each."""
        keys = [_key(task) for task in tasks]
        new = [(key, task) for key, task in zip(keys, tasks, strict=True) if key not in self.memory]
        for (key, _), trial in zip(new, self._map([task for _, task in new]), strict=True):
            numbers = [
                trial.squares,
                trial.count,
                trial.squares_validation,
                trial.count_validation,
                trial.free,
            ]
            self.memory[key] = (dict(trial.values), [float(number) for number in numbers], trial.failure)
            self._saved()
            done()
        return [_remembered(task, self.memory[key]) for key, task in zip(keys, tasks, strict=True)]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=kind is None, cancel_futures=True)


def _start(problem: Problem) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threadpool_limits(1)
    _bench[:] = [Bench(problem)]


def _end_with_parent() -> None:
    """A pool's processes wait for work for ever, also when the run that started them was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run(task: Task) -> Trial:
    return _bench[0].run(task)


def _key(task: Task) -> str:
    effects = [[effect.model_dump(mode="json") for effect in part] for part in (task.known, task.new)]
    text = json.dumps([effects, sorted(task.values.items()), task.how, task.far, sorted(task.anchor.items())])
    return hashlib.sha256(text.encode()).hexdigest()


def _remembered(task: Task, kept: tuple[dict[str, float], list[float], str]) -> Trial:
    values, (squares, count, squares_validation, count_validation, free), failure = kept
    return Trial(
        task, values, squares, int(count), squares_validation, int(count_validation), int(free), failure
    )
