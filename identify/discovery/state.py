"""Where a discovery stands: a model on all lines, and what was added to the study's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identify.core.thresholds import CONVINCING
from identify.discovery.evidence import EvidenceCriterion, variance_inflation
from identify.discovery.task import Task, Trial
from identify.discovery.workers import Workers
from identify.model.effects.base import Effect
from identify.vibration.problem import Problem


@dataclass(frozen=True)
class Rival:
    """What may be there in place of an effect: the model with it, on few lines, and its log odds over the one
    with the effect.
    """

    effect: Effect
    model: Trial
    log_odds: float


@dataclass(frozen=True)
class Added:
    """An effect beyond the study's; evidence: its log odds; gap_without: the gap if it alone is taken away,
    see `identify.discovery.importance`.
    """

    effect: Effect
    evidence: float
    rivals: tuple[Rival, ...] = ()
    gap_without: float = float("nan")

    @property
    def probability(self) -> float:
        """That it is there, and neither nothing nor a rival in its place."""
        others = [-self.evidence, *(one.log_odds for one in self.rivals)]
        return float(1 / (1 + np.exp(np.clip(others, -700, 700)).sum()))


@dataclass(frozen=True)
class State:
    """A model of the problem, which has what was found to be uncertain besides what the study says, and what
    was added to it, the most important first.
    """

    problem: Problem
    model: Trial
    added: tuple[Added, ...] = ()

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All of the model."""
        return self.model.task.effects

    def key(self, what: str) -> list[Any]:
        """What something that is found of it depends on."""
        effects = [one.model_dump(mode="json") for one in self.effects]
        return [what, effects, dict(self.model.values)]

    def without(self, effect: Effect) -> tuple[Effect, ...]:
        """All effects but one."""
        return tuple(one for one in self.effects if one != effect)

    def exchanged(self, old: Effect, new: Effect, model: Trial, gain: float) -> State:
        """With another effect in the place of one, for which there is so much more evidence."""
        changed = [
            replace(one, effect=new, evidence=one.evidence + gain) if one.effect == old else one
            for one in self.added
        ]
        return State(self.problem, model, tuple(changed))


def likelier(state: State, model: Trial) -> float:
    """Log odds for another model over that of the state."""
    better = min(state.model, model, key=lambda one: one.squares)
    criterion = EvidenceCriterion(variance_inflation(state.problem, better))
    return criterion.log_odds(state.model, model)


def convincing(
    workers: Workers, state: State, quick: Sequence[Trial], most: int
) -> tuple[Trial, float] | None:
    """The likeliest of some models on few lines, once refitted on all, with log odds for it over that of the
    state; None where none of the first `most` convinces.
    """
    tasks = [Task(one.task.known, one.task.new, one.values, whole=True) for one in quick[:most]]
    ends = [(one, likelier(state, one)) for one in workers.run(tasks)]
    best = max(ends, key=lambda end: end[1], default=None)
    return best if best is not None and best[1] > CONVINCING else None
