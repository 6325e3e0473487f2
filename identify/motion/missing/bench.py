"""The loop that adds effects (`identify.fitting.selection`) on a study of motion, with the catalogue in place
of a list of candidates.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.thresholds import CONVINCING
from identify.fitting.fit import Fit, Progress, Start
from identify.fitting.selection.gain import Rule
from identify.fitting.selection.policy import Policy
from identify.fitting.selection.workbench import Attempt, Story
from identify.motion.judging import FittedMotion
from identify.motion.missing.screen import Promise, promises
from identify.motion.plan import motion_plan
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate
from identify.motion.workbench import MotionWorkbench, Trial

_TRIED = 4
"""Effects that are refitted in a turn: what they promise is to first order, and far from the truth."""
_ENOUGH = Rule(log_odds=CONVINCING, explained=0.01)
POLICY = Policy(admit=_ENOUGH, retain=(_ENOUGH,), rival_log_odds=3.0)


class MissingBench(MotionWorkbench):
    """A study of motion with all that may be missing."""

    def __init__(self, problem: MotionProblem, progress: Progress) -> None:
        super().__init__(problem, progress)
        self._promised: dict[int, list[Promise]] = {}
        self._starts: dict[str, float] = {}

    @property
    def policy(self) -> Policy:
        """What is asked of the effects."""
        return POLICY

    def begin(self) -> FittedMotion:
        """The model as the study has it, fitted where anything is free."""
        if any(parameter.free for parameter in self.problem.parameters):
            return super().begin()
        values = self.problem.initial
        objective = motion_plan(self.problem, self.problem.file.study.optimizer, 1).objective
        cost = float(objective.costs(values[None])[0])
        start = Start(values, values, cost, 1, 0.0, True, "nothing was to be fitted")
        first = FittedMotion(self.problem, Fit(values, cost, (start,), np.zeros((0, 5)), 0.0))
        return self._fitted.setdefault(frozenset(), first)

    def candidates(self, model: FittedMotion) -> list[MotionCandidate]:
        """Those that promise something to first order, the most promising first."""
        if id(model) not in self._promised:
            self._promised[id(model)] = promises(model)
        return [
            p.effect
            for p in self._promised[id(model)]
            if not any(p.effect.instead_of(o) for o in model.added)
        ]

    def screen(self, model: FittedMotion, effects: Sequence[MotionCandidate], story: Story) -> list[Trial]:
        """As they promise."""
        return [Attempt(effect, model, 0) for effect in effects]

    def promising(self, model: FittedMotion, screened: Sequence[Trial]) -> Sequence[Trial]:
        """The first few."""
        return screened[:_TRIED]

    def refit(self, model: FittedMotion, promising: Sequence[Trial]) -> list[list[Trial]]:
        """Each fitted beside the model's effects, from where it promises to be."""
        found = []
        for trial in promising:
            [promise] = [p for p in self._promised[id(model)] if p.effect == trial.effect]
            self._starts |= promise.starts
            after = self._with(model, (*model.added, trial.effect))
            found.append([Attempt(trial.effect, after, after.free - model.free)])
        return found

    def starts(self, effects: Sequence[MotionCandidate], model: FittedMotion) -> dict[str, float]:
        """Those of new parameters as they promised, all others as they are."""
        return {**self._starts, **super().starts(effects, model)}
