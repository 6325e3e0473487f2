"""The loop that adds effects (`identify.fitting.selection`) on a study of motion, with the catalogue in place
of a list of candidates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.thresholds import CONVINCING, MATERIAL
from identify.fitting.fit import Fit, Progress, Start
from identify.fitting.plan import StageSettings
from identify.fitting.selection.policy import Policy
from identify.fitting.selection.workbench import Attempt, Story
from identify.motion.changed import coarse, resolved, with_numbers
from identify.motion.judging import FittedMotion, JudgingRecords, free_parameters
from identify.motion.missing.catalogue import Kind, acts, log_prior
from identify.motion.missing.instead import instead
from identify.motion.missing.linear import Place, effect_of
from identify.motion.missing.long_steps import LongSteps, changed, foreseen
from identify.motion.missing.screen import Lanes, Promise, look, promises
from identify.motion.missing.springs import SpringKind
from identify.motion.missing.worth import ENOUGH, needed, worth
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate
from identify.motion.trajectory_fit import MotionFit
from identify.motion.workbench import MotionWorkbench, Trial, others

_TRIED = 5
"""Effects that are refitted together, at most: what they promise is without what is free fitted anew."""
_ENDED, _CLOSE = 2, 0.5
"""How many of them are fitted to their end; what part of the best one's odds, and then of its fall of ln gap,
is close.
"""
_ALIKE = 0.9
"""What part of an effect's odds, to first order at the last model, something else has that may stand in its
place: what explains less then is another pattern.
"""
_STEP_SHARE, _PARTS = 0.1, 4
"""Error of the step, over the gap, from which it is taken off what was recorded, so that what makes up for it
cannot take a hundredth off the gap; into how many parts a step is divided to know it.
"""
_SURE = 20 * CONVINCING
"""Log odds by the curvature at a fit above which an effect stays, whatever all others would make up for."""
_LAST = StageSettings.parse({"kind": "gauss-newton", "evaluations": 6, "tolerance": 1e-3})
_REFIT, _BRIEF = (
    StageSettings.parse({"kind": "gauss-newton", "evaluations": evaluations, "tolerance": 1e-2})
    for evaluations in (15, 4)
)
"""To a hundredth of the squares: less than what an effect must take off."""
POLICY = Policy(admit=ENOUGH, retain=(ENOUGH,), rival_log_odds=3.0, persistent=True)


class MissingBench(MotionWorkbench):
    """A study of motion with all that may be missing."""

    def __init__(self, problem: MotionProblem, progress: Progress) -> None:
        super().__init__(coarse(problem), progress)
        self._fine = problem
        self._steps: LongSteps | None = None
        self._looks: dict[int, tuple[FittedMotion, list[tuple[Lanes, list[Place]]]]] = {}
        self._promised: dict[int, tuple[FittedMotion, list[Promise]]] = {}
        self._instead: dict[frozenset[str], list[Promise]] = {}
        self._starts: dict[str, float] = {}
        self._known: dict[str, tuple[Kind | SpringKind | None, tuple[int, ...]]] = {}

    @property
    def policy(self) -> Policy:
        """What is asked of the effects."""
        return POLICY

    @property
    def stage(self) -> StageSettings:
        """In few steps: what is chosen is fitted on beside what comes next."""
        return _REFIT

    def begin(self) -> FittedMotion:
        """The model as the study has it, fitted where anything is free."""
        return self.settled(super().begin())

    def settled(self, model: FittedMotion) -> FittedMotion:
        """The model beside records less the error of its step, where that is not small beside its gap, or is
        another than at the model that it was computed at.
        """
        at, values = model.problem.step_s, model.fit.values
        measured = replace(model.problem, records=self._fine.records)
        before = None if self._steps is None else self._steps.foreseen(at)
        now = foreseen(measured, values, at)
        if changed(before, now) <= _STEP_SHARE * model.fit.cost:
            return model
        shortest = min(self.problem.step_s / _PARTS, self._fine.step_s)
        self._steps = LongSteps(measured, values, shortest, {at: now})
        self._fitted.clear()
        return self._with(model, model.added)

    def _at_hand(self, problem: MotionProblem) -> MotionProblem:
        """A problem beside records less the error of its step, where that is known."""
        records = self._fine.records if self._steps is None else self._steps.records(problem.step_s)
        return replace(problem, records=records)

    def criterion(self, models: Sequence[FittedMotion]) -> JudgingRecords:
        """By all records, on one scale, and by what is believed of amplitudes before."""
        return replace(super().criterion(models), prior=self._prior)

    def _prior(self, model: FittedMotion) -> float:
        values, known = model.problem.by_name(model.fit.values), (self._known[e.name] for e in model.added)
        return sum(log_prior(kind, places, values) for kind, places in known if kind is not None)

    def candidates(self, model: FittedMotion) -> list[MotionCandidate]:
        """Those that promise something to first order, the most promising first."""
        if id(model) not in self._promised:
            foreseen = self._instead.pop(self._key(model.added), None)
            self._promised[id(model)] = model, foreseen or promises(model, self._look(model))
        found = [promise.effect for promise in self._promised[id(model)][1]]
        return [one for one in found if not any(one.instead_of(other) for other in model.added)]

    def _look(self, model: FittedMotion) -> list[tuple[Lanes, list[Place]]]:
        if id(model) not in self._looks:
            self._looks = {id(model): (model, look(model))}
        return self._looks[id(model)][1]

    def replaceable(self, model: FittedMotion, effect: MotionCandidate) -> bool:
        """One of which something else would explain nine tenths, to first order; it is tried."""
        kind, at = self._known[effect.name]
        if kind is None:
            return False
        left = others(model, effect)
        places = [place for _, some in self._look(model) for place in some]
        itself, *rest = instead(model, effect, kind, at, places)
        able = [one for one in rest if one.log_odds >= _ALIKE * itself.log_odds]
        able = [one for one in able if one.effect in self._standing((*left, one.effect))]
        found = sorted([itself, *able], key=lambda one: -one.log_odds)
        self._instead[self._key(self._standing(left))] = found
        return bool(able)

    def screen(self, model: FittedMotion, effects: Sequence[MotionCandidate], story: Story) -> list[Trial]:
        """As they promise."""
        return [Attempt(effect, model, 0) for effect in effects]

    def promising(self, model: FittedMotion, screened: Sequence[Trial]) -> Sequence[Trial]:
        """The first few that are different, and what is the same as one of them, of those that promise what
        is asked although all were looked at.
        """
        known = {id(p.effect): p for p in self._promised[id(model)][1]}
        most = max((known[id(trial.effect)].log_odds for trial in screened), default=0.0)
        different, found = list[Promise](), list[Trial]()
        for trial in screened:
            promise = known[id(trial.effect)]
            new = not any(promise.same(one) for one in different)
            enough = promise.log_odds > max(_CLOSE * most, self.policy.admit.log_odds)
            if not enough or (new and len(different) == _TRIED):
                break
            different += [promise] if new else []
            found.append(trial)
        return found

    def refit(self, model: FittedMotion, promising: Sequence[Trial]) -> list[list[Trial]]:
        """Each fitted beside the model's effects in a few steps, from where it promises to be; the best ones
        to their end, and once more without places of which nothing is left.
        """
        named = {p.effect.name: p for p in self._promised[id(model)][1]}
        promised = [named[trial.effect.name] for trial in promising]
        found = list[tuple[Promise, FittedMotion]]()
        for promise in promised:
            if any(promise.same(other) for other, _ in found):
                continue
            self._starts |= promise.starts
            self._known[promise.effect.name] = promise.kind, promise.places
            effects = (*model.added, promise.effect)
            after = self._fitted.get(self._key(effects))
            if after is None:
                begun = with_numbers(self._problem(effects, model), {}, promise.starts)
                after = self._fit(begun, effects, [_BRIEF])
            found.append((promise, after))
        found.sort(key=lambda pair: pair[1].fit.cost)
        falls = [np.log(model.fit.cost / after.fit.cost) for _, after in found]
        close = sum(fall >= _CLOSE * falls[0] for fall in falls[:_ENDED])
        ends = [(one, self._to_its_end(model, after, one.effect)) for one, after in found[:close]]
        groups = []
        for promise, after in [*ends, *found[close:]]:
            alike = [one.effect for one in promised if one is not promise and one.same(promise)]
            groups += [[Attempt(one, after, after.free - model.free)] for one in (after.added[-1], *alike)]
        return groups

    def _to_its_end(self, model: FittedMotion, brief: FittedMotion, effect: MotionCandidate) -> FittedMotion:
        """A model with an effect more, fitted to its end, without places that it does not need."""
        if not brief.fit.best.spent:  # it has ended already
            self._fitted.setdefault(self._key(brief.added), brief)
        after = self._with(brief, brief.added)
        leaner = self._leaner(after, effect)
        return after if leaner == effect else self._with(after, (*model.added, leaner))

    def _leaner(self, model: FittedMotion, effect: MotionCandidate) -> MotionCandidate:
        """An effect of a model at those of its places where the fit needs it."""
        kind, places = self._known[effect.name]
        if kind is None or len(places) < 2:
            return effect
        kept = [n for n in needed(model, kind, places) if not self._usurps(model, effect, kind, n)]
        if not 0 < len(kept) < len(places):
            return effect
        leaner = effect_of(kind, kept)
        self._known[leaner.name] = kind, tuple(kept)
        return leaner

    def _usurps(self, model: FittedMotion, effect: MotionCandidate, kind: Kind | SpringKind, at: int) -> bool:
        """Whether an effect is at one of its places what would be convincing elsewhere only: hardly believed
        before any data, and something else is likelier there, to first order.
        """
        if log_prior(kind, [at], model.problem.by_name(model.fit.values)) > -CONVINCING:
            return False
        places = [place for _, some in self._look(model) for place in some]
        itself, *rest = instead(model, effect, kind, [at], places)
        return any(one.log_odds > itself.log_odds for one in rest)

    def ended(self, model: FittedMotion) -> tuple[FittedMotion, dict[str, str]]:
        """The last model without places that others made needless, unless the judges miss them."""
        left = {effect.name: self._leaner(model, effect) for effect in model.added}
        leaner = self._with(model, tuple(left.values()))
        if leaner.gap > model.gap * (1 + MATERIAL):
            return model, {}
        return leaner, {name: effect.name for name, effect in left.items()}

    def starts(self, effects: Sequence[MotionCandidate], model: FittedMotion) -> dict[str, float]:
        """Those of new parameters as they promised, all others as they are."""
        return {**self._starts, **super().starts(effects, model)}

    def removable(self, model: FittedMotion) -> Sequence[MotionCandidate]:
        """Those that are not missed beyond doubt: to leave one out is to fit all others again."""
        return [effect for effect in model.added if self._worth(model, effect) < _SURE]

    def _worth(self, model: FittedMotion, effect: MotionCandidate) -> float:
        """Log odds for an effect of a model by the curvature there; none where it has no number."""
        kind, places = self._known[effect.name]
        return 0.0 if kind is None else worth(model, kind, places).log_odds

    def leave_out(self, model: FittedMotion, effects: Sequence[MotionCandidate]) -> list[FittedMotion]:
        """Refitted without each of them, and what is nothing without it."""
        return [self._with(model, self._standing(others(model, effect))) for effect in effects]

    def _standing(self, effects: tuple[MotionCandidate, ...]) -> tuple[MotionCandidate, ...]:
        """Those that do something beside each other."""
        given = self.problem.table.given
        there = {key for key in given if np.any(given[key])} | {key for e in effects for key in e.numbers}
        return tuple(e for e in effects if all(acts(key, there) for key in e.numbers))

    def _fit(
        self,
        problem: MotionProblem,
        effects: tuple[MotionCandidate, ...],
        stages: Sequence[StageSettings],
        starts: int = 1,
    ) -> FittedMotion:
        free = free_parameters(problem) > 0
        return super()._fit(problem, effects, stages, starts) if free else _unfitted(problem, effects)

    def _problem(self, effects: Sequence[MotionCandidate], model: FittedMotion) -> MotionProblem:
        return self._at_hand(coarse(super()._problem(effects, model)))

    def finished(self, found: MotionFit) -> MotionFit:
        """The model that was found, beside records as measured, fitted in the steps of the study or shorter
        ones.
        """
        problem, records = replace(found.problem, records=self._fine.records), self._fine.records
        if found.first is not None:
            begun = replace(found.first.problem, records=records)
            found = replace(found, first=replace(found.first, problem=begun))
        step = min(problem.step_s, self._fine.step_s, *([] if self._steps is None else [self._steps.step_s]))
        fine = resolved(replace(problem, step_s=step))
        if free_parameters(fine):
            if fine.step_s == problem.step_s:
                return replace(found, problem=fine)
            near = with_numbers(found.problem, {}, problem.by_name(found.fit.values))
            fine = with_numbers(fine, {}, problem.by_name(self._fit(near, (), [_LAST]).fit.values))
        last = self._fit(fine, (), [_LAST])
        return replace(found, problem=fine, fit=last.fit, objective=last.fitted)


def _unfitted(problem: MotionProblem, effects: tuple[MotionCandidate, ...]) -> FittedMotion:
    """A problem of which nothing is to be fitted, at its start values."""
    values = problem.initial
    cost = float(fitted_objective(problem).costs(values[None])[0])
    start = Start(values, values, cost, 1, 0.0, True, "nothing was to be fitted")
    return FittedMotion(problem, Fit(values, cost, (start,), np.zeros((0, 5)), 0.0), effects)
