"""Simulated motion as the loop that adds effects sees it: a study's problem, the effects that may be missing
from it, and records that judge.

A model is dear (a simulation of every record for every step of its fit), so that looking at an effect is
fitting it, and a set of effects is fitted once, whichever way the loop comes to it.
"""

from __future__ import annotations

from collections.abc import Sequence

from identify.fitting.fit import Progress, fit
from identify.fitting.plan import StageSettings
from identify.fitting.selection.gain import Rule
from identify.fitting.selection.policy import Policy
from identify.fitting.selection.workbench import Attempt, Option, Step, Story
from identify.motion.changed import merged, with_effects, with_numbers
from identify.motion.judging import FittedMotion, JudgingRecords, free_parameters
from identify.motion.plan import fitted_objective, motion_plan
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate

_REFIT = {"kind": "gauss-newton", "evaluations": 40, "tolerance": 1e-5}
"""How a model with an effect added is fitted, from where the model without it ended."""
_CAREFUL = Rule(log_odds=2.0, explained=0.01)
"""Log odds of 2 are enough of records that were not fitted, but noise is never as white as the odds take it
for: the gap there must fall by a hundredth too."""

POLICY = Policy(admit=_CAREFUL, retain=(_CAREFUL,), rival_log_odds=3.0)

Trial = Attempt[MotionCandidate, FittedMotion]
TrialOption = Option[MotionCandidate, FittedMotion]
TrialStep = Step[MotionCandidate, FittedMotion]


class MotionWorkbench:
    """A study of motion (`identify.fitting.selection.workbench.Workbench`)."""

    def __init__(self, problem: MotionProblem, progress: Progress) -> None:
        self.problem, self.progress = problem, progress
        self._fitted: dict[frozenset[str], FittedMotion] = {}

    @property
    def policy(self) -> Policy:
        """What is asked of the effects."""
        return POLICY

    @property
    def stage(self) -> StageSettings:
        """How a model with an effect added is fitted, from where the model without it ended."""
        return StageSettings.parse(_REFIT)

    def begin(self) -> FittedMotion:
        """The model as the study has it, fitted as the study says."""
        study = self.problem.file.study
        first = self._fit(self.problem, (), study.optimizer, study.starts)
        return self._fitted.setdefault(frozenset(), first)

    def added(self, model: FittedMotion) -> Sequence[MotionCandidate]:
        """All of its effects."""
        return model.added

    def candidates(self, model: FittedMotion) -> list[MotionCandidate]:
        """Those of the study that the model does not have, nor another one in their place."""
        known = self.problem.file.study.candidates
        return [one for one in known if not any(one.instead_of(other) for other in model.added)]

    def screen(self, model: FittedMotion, effects: Sequence[MotionCandidate], story: Story) -> list[Trial]:
        """Each fitted beside the model's effects."""
        trials = []
        for number, effect in enumerate(effects, start=1):
            after = self._with(model, (*model.added, effect))
            trials.append(Attempt(effect, after, after.free - model.free))
            story.done(number, len(effects))
        return trials

    def promising(self, model: FittedMotion, screened: Sequence[Trial]) -> Sequence[Trial]:
        """All: to look is to fit."""
        return screened

    def refit(self, model: FittedMotion, promising: Sequence[Trial]) -> list[list[Trial]]:
        """As they were looked at."""
        return [[trial] for trial in promising]

    def criterion(self, models: Sequence[FittedMotion]) -> JudgingRecords:
        """By all records, on one scale, where those that judge confirm it."""
        return JudgingRecords(models, self.policy.admit.log_odds)

    def quick_criterion(self, model: FittedMotion) -> JudgingRecords:
        """The same."""
        return self.criterion([model])

    def pair(
        self, step: TrialStep, screened: Sequence[Trial], banned: Sequence[MotionCandidate]
    ) -> tuple[TrialOption, ...] | None:
        """None: every pair would be a fit; effects that hide each other can be one candidate of the study."""
        return None

    def settled(self, model: FittedMotion) -> FittedMotion:
        """The model itself, which was fitted."""
        return model

    def ended(self, model: FittedMotion) -> tuple[FittedMotion, dict[str, str]]:
        """The last model, and what is left of its effects, by their names: as they are."""
        return model, {}

    def leave_out(self, model: FittedMotion, effects: Sequence[MotionCandidate]) -> list[FittedMotion]:
        """Refitted without each of them."""
        return [self._with(model, others(model, effect)) for effect in effects]

    def removable(self, model: FittedMotion) -> Sequence[MotionCandidate]:
        """All that were added."""
        return model.added

    def replaceable(self, model: FittedMotion, effect: MotionCandidate) -> bool:
        """One with many parameters, which can stand for many things."""
        return self.size(model, effect) >= self.policy.many

    def can_replace(self, effect: MotionCandidate) -> bool:
        """Always."""
        return True

    def implausible(self, model: FittedMotion, effect: MotionCandidate) -> bool:
        """Never: bounds keep values where they can be."""
        return False

    def size(self, model: FittedMotion, effect: MotionCandidate) -> int:
        """Number of free parameters that the model has no more without the effect."""
        return model.free - free_parameters(self._problem(others(model, effect), model))

    def standing(self, model: FittedMotion) -> str:
        """The gap on the fitted records and on those that judge."""
        return f"gap {model.fit.cost:.2f}, {model.gap:.2f} on validation records"

    def _with(self, model: FittedMotion, effects: tuple[MotionCandidate, ...]) -> FittedMotion:
        """The study's model with these effects, from the values of another model unless it is known."""
        key = self._key(effects)
        if key not in self._fitted:
            problem = self._problem(effects, model)
            self._fitted[key] = self._fit(problem, effects, [self.stage])
        return self._fitted[key]

    def _key(self, effects: Sequence[MotionCandidate]) -> frozenset[str]:
        return frozenset(effect.model_dump_json() for effect in effects)

    def _fit(
        self,
        problem: MotionProblem,
        effects: tuple[MotionCandidate, ...],
        stages: Sequence[StageSettings],
        starts: int = 1,
    ) -> FittedMotion:
        objective = fitted_objective(problem)
        found = fit(motion_plan(problem, stages, starts, objective), self.progress)
        return FittedMotion(problem, found, effects, objective)

    def _problem(self, effects: Sequence[MotionCandidate], model: FittedMotion) -> MotionProblem:
        begun, values = self.problem, self.starts(effects, model)
        for smoothing in (effect.smoothing for effect in effects if effect.smoothing is not None):
            begun = begun.with_smoothing(smoothing)
        begun = with_effects(begun, [spring for effect in effects for spring in effect.effects], values)
        return with_numbers(begun, merged([effect.numbers for effect in effects]), values)

    def starts(self, effects: Sequence[MotionCandidate], model: FittedMotion) -> dict[str, float]:
        """Where parameters start in a model with these effects, by name: as another model has them."""
        return model.problem.by_name(model.fit.values)


def others(model: FittedMotion, effect: MotionCandidate) -> tuple[MotionCandidate, ...]:
    """The added effects of a model but one."""
    return tuple(one for one in model.added if one != effect)
