"""Searches and gains of an explanation in several processes: what the loop will ask for next is computed
ahead, into its memory, so that it finds there what it would have computed itself, bit for bit.
"""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

from identify.explain.regression import RegressionProblem
from identify.fitting.memory import Memory
from identify.fitting.processes import Processes

_FEW = 2
"""Pieces of work for each process below which they are not worth being sent."""


class Job(Protocol):
    """A piece of work on a stage: its key in the memory, and its value, which JSON can hold."""

    @property
    def key(self) -> str:
        """In the memory."""

    def compute(self, stage: Stage) -> Any:
        """Its value."""


@dataclass(frozen=True)
class Stage:
    """What a piece of work needs besides itself; made: what was made of it for several of them."""

    fitted: RegressionProblem
    judge: RegressionProblem
    label: str
    tried: frozenset[str]
    made: dict[str, Any] = field(default_factory=dict, compare=False)

    @cached_property
    def plain(self) -> Stage:
        """Without anything that was remembered, to be sent."""
        fitted, judge = (
            replace(one, scene=replace(one.scene, cache={}), remembered={}, searched={})
            for one in (self.fitted, self.judge)
        )
        return replace(self, fitted=fitted, judge=judge, made={})

    def kept(self, key: str, make: Callable[[], Any]) -> Any:
        """What was made under a key, only the latest."""
        if key not in self.made:
            self.made.clear()
            self.made[key] = make()
        return self.made[key]


class Workers(AbstractContextManager["Workers"]):
    """So many processes; with one, nothing is computed ahead."""

    def __init__(self, count: int) -> None:
        self._processes = Processes(count, _begin) if count > 1 else None
        self._folder = tempfile.TemporaryDirectory() if count > 1 else None
        self._sent: dict[int, tuple[Stage, Path]] = {}

    def ahead(self, stage: Stage, jobs: Sequence[Job], memory: Memory) -> None:
        """Fill the memory with the values of jobs that are not there yet."""
        new = {job.key: job for job in jobs if job.key not in memory}
        if self._processes is None or len(new) < _FEW * self._processes.count:
            return
        parts, left = 4 * self._processes.count, list(new.values())
        chunks = [chunk for n in range(parts) if (chunk := left[n::parts])]
        tasks = [(self._file(stage), chunk) for chunk in chunks]
        for number, found in self._processes.run(_work, tasks):
            for job, value in zip(chunks[number], found, strict=True):
                memory[job.key] = value

    def _file(self, stage: Stage) -> Path:
        """Where processes find a stage: written once."""
        if id(stage) not in self._sent:
            assert self._folder is not None
            path = Path(self._folder.name) / f"{len(self._sent)}.pickle"
            path.write_bytes(pickle.dumps(stage.plain))
            self._sent[id(stage)] = stage, path
        return self._sent[id(stage)][1]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._processes is not None:
            self._processes.__exit__(kind, error, trace)
        if self._folder is not None:
            self._folder.cleanup()


_stage: list[tuple[Path, Stage]] = []
"""Of a process: the latest it worked on."""


def _begin() -> None:
    _stage.clear()


def _work(path: Path, jobs: Sequence[Job]) -> list[Any]:
    if not _stage or _stage[0][0] != path:
        _stage[:] = [(path, pickle.loads(path.read_bytes()))]  # written by the parent
    return [job.compute(_stage[0][1]) for job in jobs]
