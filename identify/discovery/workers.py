"""Many trials at once, in processes of this machine, with a memory: what was tried once is not tried again,
also after a restart.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property, partial
from types import TracebackType
from typing import Any, TypeVar

from identify.core.interruption import check
from identify.discovery.places.job import Known, PlaceJob
from identify.discovery.task import Task, Trial
from identify.discovery.trial import TrialRunner
from identify.fitting.memory import Memory, digest
from identify.fitting.processes import Processes
from identify.vibration.problem import Problem

NEEDED = __name__, "scipy.optimize"
"""Modules that processes for `Workers` load while there is nothing to try yet."""
Part = TypeVar("Part")
Made = TypeVar("Made")


@dataclass(frozen=True)
class _Bench:
    """A problem and, made in each process, what tries models of it."""

    problem: Problem

    @cached_property
    def runner(self) -> TrialRunner:
        return TrialRunner(self.problem)

    def run(self, task: Task) -> Trial:
        return self.runner.run(task)

    def place(self, job: PlaceJob, known: Known) -> Any:
        return self.runner.place(known, job)

    def made(self, part: Part, work: Callable[[Problem, Part], Made]) -> Made:
        return work(self.problem, part)


class Workers(AbstractContextManager["Workers"]):
    """Tries tasks on a problem in `count` processes; with one, in this process.

    memory is filled with every finished trial: by key of a task its values by name; squares, count, squares
    and count on validation data, free parameters; failure.  seconds: how long it worked, by phase; begun: its
    processes, where they have started already.
    """

    def __init__(
        self, problem: Problem, count: int, memory: Memory | None = None, begun: Processes | None = None
    ) -> None:
        self.memory = Memory() if memory is None else memory
        self.seconds: dict[str, float] = {}
        self._bench = _Bench(problem)
        self._pool = begun or (Processes(count, *NEEDED) if count > 1 else None)

    def turn_to(self, problem: Problem) -> None:
        """From now on work on another problem of the same robot and data."""
        self._bench = _Bench(problem)

    def run(self, tasks: Sequence[Task], phase: str = "refits") -> list[Trial]:
        """The trials of all tasks in their order; phase: what their time counts as.  Interrupted where the
        user asked for the end.
        """
        began, keys = time.perf_counter(), [_key(task) for task in tasks]
        new = {key: task for key, task in zip(keys, tasks, strict=True) if key not in self.memory}
        left = list(new)
        for at, trial in self._made(_Bench.run, list(new.values())):
            counts = trial.count, trial.squares_validation, trial.count_validation, trial.free
            kept = [float(number) for number in (trial.squares, *counts, trial.errors)]
            self.memory[left[at]] = (dict(trial.values), kept, trial.failure)
        self._count_time(phase, began)
        return [_remembered(task, self.memory[key]) for key, task in zip(keys, tasks, strict=True)]

    def recall(self, key: Sequence[Any], compute: Callable[[], Any], phase: str) -> Any:
        """What was computed for a key once, as JSON has it."""
        began = time.perf_counter()
        found = self.memory.recall(digest(*key), compute)
        self._count_time(phase, began)
        return found

    def _count_time(self, phase: str, began: float) -> None:
        self.seconds[phase] = self.seconds.get(phase, 0.0) + time.perf_counter() - began

    def places(self, known: Known, jobs: Sequence[PlaceJob]) -> list[Any]:
        """What becomes of work on places, in order."""
        began = time.perf_counter()
        found = dict(self._made(partial(_Bench.place, known=known), jobs, small=True))
        self._count_time("places", began)
        return [found[number] for number in range(len(jobs))]

    def each(self, work: Callable[[Problem, Part], Made], parts: Sequence[Part]) -> Iterator[Made]:
        """What `work` makes of the problem and of each part, in order; begun now where there are processes,
        so that it goes on beside what is done before the first is asked for.
        """
        if self._pool is None:
            return (work(self._bench.problem, part) for part in parts)
        return self._pool.ordered(self._bench, partial(_Bench.made, work=work), parts)

    def _made(
        self, work: Callable[[_Bench, Part], Made], parts: Sequence[Part], *, small: bool = False
    ) -> Iterator[tuple[int, Made]]:
        """As `Processes.run`, in this process where there is no other."""
        if self._pool is not None:
            yield from self._pool.run(self._bench, work, parts, small=small)
            return
        for number, part in enumerate(parts):
            check()
            yield number, work(self._bench, part)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.__exit__(kind, error, trace)


def _key(task: Task) -> str:
    effects = [[effect.model_dump(mode="json") for effect in part] for part in (task.known, task.new)]
    text = json.dumps([effects, sorted(task.values.items()), task.whole, task.steps])
    return hashlib.sha256(text.encode()).hexdigest()


def _remembered(task: Task, kept: tuple[dict[str, float], list[float], str]) -> Trial:
    values, (squares, count, elsewhere, count_elsewhere, free, errors), failure = kept
    counts = int(count), elsewhere, int(count_elsewhere), int(free)
    return Trial(task, values, squares, *counts, failure, errors)
