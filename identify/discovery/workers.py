"""Many trials at once, in processes of this machine, with a memory: what was tried once is not tried again,
also after a restart.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from types import TracebackType
from typing import Any, Literal, TypeVar

from identify.core.interruption import check
from identify.discovery.places.job import Known, PlaceJob
from identify.discovery.task import Task, Trial, squares_of
from identify.discovery.trial import TrialRunner
from identify.fitting.memory import Memory
from identify.fitting.processes import Processes
from identify.vibration.problem import Problem

_PHASES = {
    "start": "the present model",
    "glance": "first looks",
    "beside": "first looks",
    "brief": "first looks",
    "astray": "first looks",
    "led": "first looks",
    "quick": "quick refits",
    "likely": "thorough refits",
    "afresh": "thorough refits",
    "thorough": "thorough refits",
    "nearby": "quick refits",
    "onward": "thorough refits",
    "settled": "thorough refits",
}
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
        self._bench = _Bench(problem)
        self._pool = begun or (Processes(count, *NEEDED) if count > 1 else None)

    def turn_to(self, problem: Problem, *, with_errors: bool) -> None:
        """From now on work on another problem of the same robot and data."""
        self._bench, self.with_errors = _Bench(problem), with_errors

    def run(self, tasks: Sequence[Task], done: Callable[[], None] = lambda: None) -> list[Trial]:
        """The trials of all tasks in their order; `done` is called after each.  Interrupted where the user
        asked for the end.
        """
        began, keys = time.perf_counter(), [_key(task) for task in tasks]
        new = {key: task for key, task in zip(keys, tasks, strict=True) if key not in self.memory}
        left = list(new)
        for at, trial in self._made(_Bench.run, list(new.values())):
            kept = [trial.squares, trial.count, trial.squares_validation, trial.count_validation, trial.free]
            self.memory[left[at]] = (dict(trial.values), [float(number) for number in kept], trial.failure)
            done()
        self._count_time(_PHASES[tasks[0].how] if tasks else "", began)
        return [_remembered(task, self.memory[key]) for key, task in zip(keys, tasks, strict=True)]

    def _count_time(self, phase: str, began: float) -> None:
        self.seconds[phase] = self.seconds.get(phase, 0.0) + time.perf_counter() - began

    def places(
        self, known: Known, jobs: Sequence[PlaceJob], done: Callable[[], None] = lambda: None
    ) -> list[Any]:
        """What becomes of work on places, in order; `done` is called after each."""
        found, began = dict[int, Any](), time.perf_counter()
        for number, end in self._made(partial(_Bench.place, known=known), jobs, small=True):
            found[number] = end
            done()
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
    text = json.dumps([effects, sorted(task.values.items()), task.how, task.far, sorted(task.anchor.items())])
    return hashlib.sha256(text.encode()).hexdigest()


def _remembered(task: Task, kept: tuple[dict[str, float], list[float], str]) -> Trial:
    values, (squares, count, squares_validation, count_validation, free), failure = kept
    return Trial(
        task, values, squares, int(count), squares_validation, int(count_validation), int(free), failure
    )


def further(
    workers: Workers,
    trials: Sequence[Trial],
    how: Literal["led", "quick", "nearby", "likely", "afresh", "thorough", "onward", "settled"],
    done: Callable[[], None] = lambda: None,
) -> list[Trial]:
    """Trials taken on from where they are, the best first."""
    tasks = [replace(trial.task, values=trial.values, how=how, far=False) for trial in trials]
    return sorted(workers.run(tasks, done), key=squares_of)
