"""Many trials at once, in processes of this machine, with a memory: what was tried once is not tried again,
also after a restart.
"""

from __future__ import annotations

import hashlib
import json
import pickle
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

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
"""Of a process: on the problem that it was given."""
Part = TypeVar("Part")
Made = TypeVar("Made")


def ready(count: int) -> AbstractContextManager[Processes | None]:
    """Processes for `Workers`, which get ready before there is a problem; none where one is enough."""
    return Processes(count, _begin) if count > 1 else nullcontext()


class Workers(AbstractContextManager["Workers"]):
    """Tries tasks on a problem in `count` processes; with one, in this process.

    memory is filled with every finished trial: by key of a task its values by name; squares, count, squares
    and count on validation data, free parameters; failure.  seconds: how long it worked, by phase.
    with_errors: whether errors of what was told are fitted along; begun: its processes, where they
    have started already.
    """

    def __init__(
        self, problem: Problem, count: int, memory: Memory | None = None, begun: Processes | None = None
    ) -> None:
        self.memory = Memory() if memory is None else memory
        self.seconds: dict[str, float] = {}
        self.with_errors = bool(problem.nuisances.entries)
        self._problem = problem
        self._runner = TrialRunner(problem) if count == 1 else None
        self._pool = begun or (Processes(count, _begin) if count > 1 else None)
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True) if self._pool else None
        if self._folder is not None:
            self._path.write_bytes(pickle.dumps(problem, pickle.HIGHEST_PROTOCOL))

    @property
    def _path(self) -> Path:
        """Where processes find the problem."""
        assert self._folder is not None
        return Path(self._folder.name) / "problem.pickle"

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
            tasks = [(self._path, known, [jobs[n] for n in chunk]) for chunk in chunks]
            for number, ends in self._pool.run(_run_places, tasks):
                found |= dict(zip(chunks[number], ends, strict=True))
                for _ in chunks[number]:
                    done()
        self._count_time("places", began)
        return [found[number] for number in range(len(jobs))]

    def each(self, work: Callable[[Problem, Part], Made], parts: Sequence[Part]) -> Iterator[Made]:
        """What `work` makes of the problem and of each part, in order; begun now where there are processes,
        so that it goes on beside what is done before the first is asked for.
        """
        if self._pool is None:
            return (work(self._problem, part) for part in parts)
        return self._pool.ordered(_work, [(self._path, work, part) for part in parts])

    def _tried(self, tasks: Mapping[str, Task]) -> Iterator[tuple[str, Trial]]:
        """Each task's key with its trial, as they come."""
        if self._runner is not None:
            for key, task in tasks.items():
                check()
                yield key, self._runner.run(task)
        if self._pool is not None:
            keys = list(tasks)
            for number, trial in self._pool.run(_run, [(self._path, task) for task in tasks.values()]):
                yield keys[number], trial

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.__exit__(kind, error, trace)
        if self._folder is not None:
            self._folder.cleanup()


def _begin() -> None:
    """Load what every trial needs while there is nothing to try yet."""
    import_module("scipy.optimize")


def _on(path: Path) -> TrialRunner:
    if not _runner:
        _runner[:] = [TrialRunner(pickle.loads(path.read_bytes()))]  # written by the parent
    return _runner[0]


def _run(path: Path, task: Task) -> Trial:
    return _on(path).run(task)


def _run_places(path: Path, known: Known, jobs: list[PlaceJob]) -> list[Any]:
    return [_on(path).place(known, job) for job in jobs]


def _work(path: Path, work: Callable[[Problem, Part], Made], part: Part) -> Made:
    return work(_on(path).whole, part)


def _key(task: Task) -> str:
    effects = [[effect.model_dump(mode="json") for effect in part] for part in (task.known, task.new)]
    text = json.dumps([effects, sorted(task.values.items()), task.how, task.far, sorted(task.anchor.items())])
    return hashlib.sha256(text.encode()).hexdigest()


def _remembered(task: Task, kept: tuple[dict[str, float], list[float], str]) -> Trial:
    values, (squares, count, squares_validation, count_validation, free), failure = kept
    return Trial(
        task, values, squares, int(count), squares_validation, int(count_validation), int(free), failure
    )
