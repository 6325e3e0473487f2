"""Searches and gains of an explanation in several processes: what the loop will ask for next is computed
ahead, into its memory, so that it finds there what it would have computed itself, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
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


def ahead(processes: Processes, stage: Stage, jobs: Sequence[Job], memory: Memory) -> None:
    """Fill the memory with the values of jobs that are not there yet."""
    new = list({job.key: job for job in jobs if job.key not in memory}.values())
    if len(new) >= _FEW * processes.count:
        for number, value in processes.run(stage.plain, _value, new, small=True):
            memory[new[number].key] = value


def _value(stage: Stage, job: Job) -> Any:
    return job.compute(stage)
