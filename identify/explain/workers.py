"""Searches and gains of an explanation in several processes: what the loop will ask for next is computed
ahead, into its memory, so that it finds there what it would have computed itself, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from identify.explain.regression import RegressionProblem
from identify.fitting.memory import Memory
from identify.fitting.processes import Processes

_FEW = 2
"""Pieces of work for each process below which they are not worth being sent."""


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


Job = Callable[[Stage], Any]
"""A piece of work on a stage: its value, which JSON can hold."""


def ahead(processes: Processes, stage: Stage, jobs: Mapping[str, Job], memory: Memory) -> None:
    """Fill the memory with the values of jobs, by key, that are not there yet."""
    new = [key for key in jobs if key not in memory]
    if len(new) >= _FEW * processes.count:
        work = [jobs[key] for key in new]
        for number, value in processes.run(stage.plain, _value, work, small=True):
            memory[new[number]] = value


def _value(stage: Stage, job: Job) -> Any:
    return job(stage)
