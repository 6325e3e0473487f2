"""Many trials at once, in processes of this machine, with a memory: what was tried once is not tried again,
also after a restart.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Any

from identify.core.interruption import check
from identify.discovery.places.job import Known, PlaceJob
from identify.discovery.task import Task, Trial
from identify.discovery.trial import TrialRunner
from identify.fitting.memory import Memory
from identify.fitting.processes import Processes
from identify.vibration.problem import Problem

_PHASES = {
    "start": "the present model",
    "glance": "first looks",
    "beside": "first looks",
    "brief": "first looks",
    "led": "first looks",
    "quick": "quick refits",
    "likely": "thorough refits",
    "afresh": "thorough refits",
    "thorough": "thorough refits",
    "nearby": "quick refits",
    "onward": "thorough refits",
}
_runner: list[TrialRunner] = []


class Workers(AbstractContextManager["Workers"]):
    """Tries tasks on a problem in `count` processes; with one, in this process.

    memory is filled with every finished trial: by key of a task its values by name; squares, count, squares
    and count on validation data, free parameters; failure.  seconds: how long it worked, by phase.
    with_errors: whether errors of what was told are fitted along.
    """

    def __init__(self, problem: Problem, count: int, memory: Memory | None = None) -> None:
        self.memory = Memory() if memory is None else memory
        self.seconds: dict[str, float] = {}
        self.with_errors = bool(problem.nuisances.entries)
        self._runner = TrialRunner(problem) if count == 1 else None
        self._pool = Processes(count, _begin, problem) if count > 1 else None

    def run(self, tasks: Sequence[Task], done: Callable[[], None] = lambda: None) -> list[Trial]:
        """The trials of all tasks in their order; `done` is called after each.  Interrupted where the user
        asked for the end.
        """
        began, keys = time.perf_counter(), [_key(task) for task in tasks]
        new = {key: task for key, task in zip(keys, tasks, strict=True) if key not in self.memory}
        for key, trial in self._tried(new):
            numbers = [
                trial.squares,
                trial.count,
                trial.squares_validation,
                trial.count_validation,
                trial.free,
            ]
            self.memory[key] = (dict(trial.values), [float(number) for number in numbers], trial.failure)
            done()
        self._count_time(_PHASES[tasks[0].how] if tasks else "", began)
        return [_remembered(task, self.memory[key]) for key, task in zip(keys, tasks, strict=True)]

    def _count_time(self, phase: str, began: float) -> None:
        self.seconds[phase] = self.seconds.get(phase, 0.0) + time.perf_counter() - began

    def places(
        self, known: Known, jobs: Sequence[PlaceJob], done: Callable[[], None] = lambda: None
    ) -> list[Any]:
        """What becomes of work on places, in order; `done` is called after each."""
        found: dict[int, Any] = {}
        began = time.perf_counter()
        if self._runner is not None:
            for number, job in enumerate(jobs):
                check()
                found[number] = self._runner.place(known, job)
                done()
        if self._pool is not None:
            parts = 4 * self._pool.count
            chunks = [chunk for n in range(parts) if (chunk := list(range(n, len(jobs), parts)))]
            tasks = [(known, [jobs[n] for n in chunk]) for chunk in chunks]
            for number, ends in self._pool.run(_run_places, tasks):
                found |= dict(zip(chunks[number], ends, strict=True))
                for _ in chunks[number]:
                    done()
        self._count_time("places", began)
        return [found[number] for number in range(len(jobs))]

    def _tried(self, tasks: Mapping[str, Task]) -> Iterator[tuple[str, Trial]]:
        """Each task's key with its trial, as they come."""
        if self._runner is not None:
            for key, task in tasks.items():
                check()
                yield key, self._runner.run(task)
        if self._pool is not None:
            keys = list(tasks)
            for number, trial in self._pool.run(_run, [(task,) for task in tasks.values()]):
                yield keys[number], trial

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.__exit__(kind, error, trace)


def _begin(problem: Problem) -> None:
    _runner[:] = [TrialRunner(problem)]


def _run(task: Task) -> Trial:
    return _runner[0].run(task)


def _run_places(known: Known, jobs: list[PlaceJob]) -> list[Any]:
    return [_runner[0].place(known, job) for job in jobs]


def _key(task: Task) -> str:
    effects = [[effect.model_dump(mode="json") for effect in part] for part in (task.known, task.new)]
    text = json.dumps([effects, sorted(task.values.items()), task.how, task.far, sorted(task.anchor.items())])
    return hashlib.sha256(text.encode()).hexdigest()


def _remembered(task: Task, kept: tuple[dict[str, float], list[float], str]) -> Trial:
    values, (squares, count, squares_validation, count_validation, free), failure = kept
    return Trial(
        task, values, squares, int(count), squares_validation, int(count_validation), int(free), failure
    )
