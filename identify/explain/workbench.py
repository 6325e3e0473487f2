"""Recorded motion as the loop that adds effects sees it: one target of two records, one of them fitted, the
other the judge.

A coefficient never sees the record that says whether its effect is real.  Of noise alone, two records agree
on a coefficient so well with a chance below 1e-3 per coefficient.  Where no single effect passes, pairs at
one joint are tried, because each of two large effects can hide the other.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from identify.core.arrays import Array
from identify.core.interruption import check
from identify.core.latest import Latest
from identify.explain.effects.base import MotionEffect
from identify.explain.gain import loses_a_direction, record_gain, samples
from identify.explain.intervals import told_from_nothing
from identify.explain.regression import Fit, RegressionProblem, aligned, solve, without
from identify.explain.screen import Screen, refine
from identify.explain.workers import Job, Stage, ahead
from identify.fitting.memory import Memory, digest
from identify.fitting.processes import Processes
from identify.fitting.selection.gain import Gain, Rule
from identify.fitting.selection.policy import Policy
from identify.fitting.selection.workbench import Attempt, Option, Step, Story

POLICY = Policy(
    admit=Rule(log_odds=2.0, explained=0.003),
    retain=(Rule(log_odds=0.0, confirmed=False), Rule(explained=0.003)),
    rival=Rule(log_odds=0.0, confirmed=False),
    rival_log_odds=3.0,
    rival_part=0.5,
    parsimony=0.9,
    prune_each=True,
    rivals_each=False,
)
"""Evidence is on a record that was not fitted, so log odds of 2 are enough; what is explained is a fraction
of what a joint's residual still holds there, in squares.  An effect stays while the odds are for it, or while
its gain is worth a name and spread over the record."""
_SEEDS = 4
_SETTLE = 3
"""How often joints are weighted anew at first: errors of bodies are held to what is stated the more, the more
is left.
"""
_PAIR = Rule(explained=0.2)
"""A pair must explain a good part of what is left: only large effects hide each other."""

MotionAttempt = Attempt[MotionEffect, Fit]
MotionOption = Option[MotionEffect, Fit]
MotionStep = Step[MotionEffect, Fit]


@dataclass(frozen=True)
class HeldOut:
    """Gains are judged on a record that was not fitted; label: which stage of which target it is.

    An effect that humbler ones may look like gains only what it gains over them, and none gains that loses
    the other way: fitted to the judge and judged by the fitted record; no wave gains that loses in one
    direction of motion.  tried: names of all effects that are looked for; each of them has its price, because
    the odds for one of n that nothing speaks for are 1 to n before the data speak.
    """

    fitted: RegressionProblem
    judge: RegressionProblem
    memory: Memory
    label: str
    tried: frozenset[str]

    def gain(self, before: Fit, after: Fit) -> Gain:
        """See `identify.explain.gain.record_gain`."""
        kept = self.memory.recall(self.key(before, after), lambda: self.found(before, after))
        log_odds, explained, confirmed, parts, chance = kept
        return Gain(log_odds, explained, confirmed, True, np.array(parts), chance)

    def key(self, before: Fit, after: Fit) -> str:
        """Of the gain in the memory."""
        return digest("gain", self.label, key_of(before), key_of(after))

    def found(self, before: Fit, after: Fit) -> list[float | bool | list[float]]:
        """The gain, as the memory keeps it."""
        return _as_list(self._gain(before, after))

    def _gain(self, before: Fit, after: Fit) -> Gain:
        price = (len(after.effects) - len(before.effects)) * float(np.log(len(self.tried)))
        gain = record_gain(self.judge, before, after, self.fitted)
        if gain.log_odds > price:
            back = self._the_other_way(before, after)
            lesser = _lesser(gain, back)
            gain = lesser if back.log_odds <= 0 else replace(gain, explained=lesser.explained)
        if (gain.log_odds > price or gain.confirmed) and self._one_way_only(before, after):
            gain = replace(gain, log_odds=0.0, explained=0.0, confirmed=False)
        for other in self._humbler(before, after):
            if gain.log_odds <= price:
                break
            gain = _lesser(gain, other())
        return replace(gain, log_odds=gain.log_odds - price)

    def _humbler(self, before: Fit, after: Fit) -> Iterator[Callable[[], Gain]]:
        """The gain over each of what new effects may look like."""
        there = {effect.name for effect in before.effects}
        new = [effect for effect in after.effects if effect.name not in there]
        for instead in (one for effect in new for one in effect.humbler(self.fitted.scene)):
            known = [one for one in instead if one.name in self.tried or not one.looked_for]
            more = [one for one in known if one.name not in there]
            if more:
                yield partial(self._beyond, before, more, after)

    def _beyond(self, before: Fit, more: Sequence[MotionEffect], after: Fit) -> Gain:
        """What a fit gains over further effects beside `before`."""
        nonlinear = [*before.nonlinear, *(np.zeros(0) for _ in more)]
        other = solve(self.fitted, [*before.effects, *more], nonlinear, before.weights)
        return record_gain(self.judge, other, after, self.fitted)

    def _the_other_way(self, before: Fit, after: Fit) -> Gain:
        """The gain on the fitted record of both fitted to the judge."""
        return record_gain(self.fitted, *self._of_judge(before, after), self.judge)

    @cached_property
    def _fitted_to_judge(self) -> Latest[Fit]:
        return Latest(2)

    def _of_judge(self, before: Fit, after: Fit) -> tuple[Fit, Fit]:
        """Both fitted to the judge, parameters inside the columns kept; one that is compared with one after
        another once.
        """

        def of(fit: Fit) -> Fit:
            return solve(self.judge, fit.effects, fit.nonlinear, fit.weights)

        first, last = (self._fitted_to_judge.of((fit,), partial(of, fit)) for fit in (before, after))
        return first, last

    def _one_way_only(self, before: Fit, after: Fit) -> bool:
        """Whether new waves lose on either record, fitted to the other, in one direction of motion."""
        return loses_a_direction(self.judge, before, after, self.fitted) or loses_a_direction(
            self.fitted, *self._of_judge(before, after), self.judge
        )


def _search(model: Fit, taken: str, effect: MotionEffect, stage: Stage) -> list[list[float]]:
    """The search for an effect's own parameters beside a model, less what it takes the place of, as kept."""
    name = f"screen {key_of(model)} {taken}"
    screen: Screen = stage.kept(name, lambda: Screen(stage.fitted, model, taken))
    return screen.found(effect)


def _comparison(before: Fit, after: Fit, stage: Stage) -> list[float | bool | list[float]]:
    """What one fit gains over another, as kept."""
    return HeldOut(stage.fitted, stage.judge, Memory(), stage.label, stage.tried).found(before, after)


@dataclass(frozen=True)
class RecordWorkbench:
    """One target of two records (`identify.fitting.selection.workbench.Workbench`).

    effects: all that may be tried; begun: a fit to begin with, as when the loads became known better, as far
    as it still holds; label: what tells this stage of the run from others in the memory; examined: names of
    effects which, together, an earlier stage has found no better ones for; workers: who computes ahead.
    """

    fitted: RegressionProblem
    judge: RegressionProblem
    effects: Sequence[MotionEffect]
    label: str
    memory: Memory = field(default_factory=Memory)
    begun: Fit | None = None
    examined: frozenset[str] = frozenset()
    workers: Processes | None = None

    @cached_property
    def _stage(self) -> Stage:
        tried = frozenset(effect.name for effect in self.effects)
        return Stage(self.fitted, self.judge, self.label, tried)

    @cached_property
    def _told(self) -> Latest[dict[MotionEffect, bool]]:
        return Latest(1)

    def _ahead(self, jobs: Callable[[], Mapping[str, Job]]) -> None:
        """Have it computed by the workers, where there are any."""
        if self.workers is not None:
            ahead(self.workers, self._stage, jobs(), self.memory)

    @property
    def policy(self) -> Policy:
        """What is asked of the effects."""
        return POLICY

    def begin(self) -> Fit:
        """What was begun with, on these records; else no effects."""
        if self.begun is not None:
            return self._refined(
                solve(self.fitted, self.begun.effects, self.begun.nonlinear, self.begun.weights)
            )
        fit = reweighted(self.fitted, solve(self.fitted, (), (), np.ones(self.fitted.target.shape[1])))
        for _ in range(_SETTLE if self.fitted.bodies is not None else 0):
            fit = reweighted(self.fitted, fit)
        return fit

    def added(self, model: Fit) -> Sequence[MotionEffect]:
        """All of its effects."""
        return model.effects

    def candidates(self, model: Fit) -> list[MotionEffect]:
        """Those that are not there, nor something richer in their place, and have what they refine."""
        there = {effect.name for effect in model.effects}
        replaced = {effect.supersedes for effect in model.effects}
        return [
            effect
            for effect in self.effects
            if effect.name not in there | replaced and (not effect.needs or effect.needs in there)
        ]

    def screen(self, model: Fit, effects: Sequence[MotionEffect], story: Story) -> list[MotionAttempt]:
        """Each beside the model's effects, whose own parameters stay; in place of what it supersedes."""
        there = {effect.name for effect in model.effects}
        places = [effect.supersedes if effect.supersedes in there else "" for effect in effects]
        screens = {
            taken: Screen(self.fitted, model, taken, self.memory, self.label)
            for taken in dict.fromkeys(places)
        }
        self._ahead(
            lambda: {
                screens[taken].key(effect): partial(_search, model, taken, effect)
                for effect, taken in zip(effects, places, strict=True)
                if not screens[taken].searched(effect)
            }
        )
        found = []
        for number, (effect, taken) in enumerate(zip(effects, places, strict=True), start=1):
            check()
            after = screens[taken].added(effect)
            if after is not None:
                found.append(Attempt(effect, after, self.size(after, effect)))
            story.done(number, len(effects))
        return found

    def promising(self, model: Fit, screened: Sequence[MotionAttempt]) -> Sequence[MotionAttempt]:
        """All: to look is to fit."""
        return screened

    def refit(self, model: Fit, promising: Sequence[MotionAttempt]) -> list[list[MotionAttempt]]:
        """As they were looked at."""
        return [[attempt] for attempt in promising]

    def criterion(self, models: Sequence[Fit]) -> HeldOut:
        """By the record that was not fitted; what the others gain over the first is asked next."""
        held = HeldOut(self.fitted, self.judge, self.memory, self.label, self._stage.tried)
        before, *others = models
        self._ahead(lambda: {held.key(before, one): partial(_comparison, before, one) for one in others})
        return held

    def quick_criterion(self, model: Fit) -> HeldOut:
        """The same."""
        return self.criterion([model])

    def pair(
        self, step: MotionStep, screened: Sequence[MotionAttempt], banned: Sequence[MotionEffect]
    ) -> tuple[MotionOption, ...] | None:
        """Two effects at one joint that pass together, the likelier first; None where no pair does.

        Harmonics hide nothing and are not tried.
        """
        options = {option.effect: option for option in step.options}
        singles = [options[one.effect] for one in screened if not one.effect.harmonic]
        singles.sort(key=lambda option: -option.gain.explained)
        open_ones = [effect for effect in self.effects if not effect.harmonic and effect not in banned]
        best: tuple[MotionOption, MotionAttempt] | None = None
        most = _PAIR.explained
        pairs = list(self._pairs(singles, open_ones))
        criterion = self.criterion([step.before, *(second.model for _, second in pairs)])
        for first, second in pairs:
            both = criterion.gain(step.before, second.model)
            if self.policy.admit.holds(both) and _PAIR.holds(both) and both.explained > most:
                best, most = (first, second), both.explained
        if best is None:
            return None
        first, attempt = best
        gain = criterion.gain(first.model, attempt.model)
        return first, Option(attempt.effect, attempt.model, attempt.size, gain)

    def _pairs(
        self, singles: Sequence[MotionOption], effects: Sequence[MotionEffect]
    ) -> Iterator[tuple[MotionOption, MotionAttempt]]:
        """Joint by joint, each of the best of `singles` with every one of `effects` beside it."""
        for axis in {effect.axis for effect in effects}:
            beside = [effect for effect in effects if effect.axis == axis]
            for first in [one for one in singles if one.effect.axis == axis][:_SEEDS]:
                others = [effect for effect in self.candidates(first.model) if effect in beside]
                for second in self.screen(first.model, others, Story()):
                    yield first, second

    def settled(self, model: Fit) -> Fit:
        """Parameters inside the columns searched together, joints weighted by what they leave."""
        return reweighted(self.fitted, self._refined(model))

    def leave_out(self, model: Fit, effects: Sequence[MotionEffect]) -> list[Fit]:
        """Without each of them, parameters inside the columns kept."""
        return [without(self.fitted, model, effect.name) for effect in effects]

    def removable(self, model: Fit) -> Sequence[MotionEffect]:
        """Those that no other one refines."""
        held = {effect.needs for effect in model.effects}
        return [effect for effect in model.effects if effect.name not in held]

    def replaceable(self, model: Fit, effect: MotionEffect) -> bool:
        """All but harmonics and what others need, where that has not been looked at."""
        known = {one.name for one in model.effects} == self.examined
        return not known and self.can_replace(effect) and effect in self.removable(model)

    def can_replace(self, effect: MotionEffect) -> bool:
        """All but harmonics, which nothing else looks like."""
        return not effect.harmonic

    def implausible(self, model: Fit, effect: MotionEffect) -> bool:
        """Whether its sign, or what it found, cannot be, or need not be anything."""
        told = self._told.of((model,), lambda: told_from_nothing(self.fitted, model))
        return not (effect.possible(model.of(effect)) and told[effect])

    def size(self, model: Fit, effect: MotionEffect) -> int:
        """Coefficients, and parameters inside the columns."""
        return len(effect.coefficients) + len(effect.parameters(self.fitted.scene))

    def standing(self, model: Fit) -> str:
        """RMS residual per joint on the judging record."""
        left = rms(self.judge, aligned(self.judge, model))
        return f"RMS residual on record {self.judge.name} {', '.join(f'{value:.3g}' for value in left)}"

    def _refined(self, model: Fit) -> Fit:
        """The parameters inside the columns of all effects searched together."""

        def refined() -> list[list[float]]:
            return [parameters.tolist() for parameters in refine(self.fitted, model).nonlinear]

        if not any(map(len, model.nonlinear)):
            return refine(self.fitted, model)
        kept = self.memory.recall(digest("refine", self.label, key_of(model)), refined)
        return solve(self.fitted, model.effects, [np.array(parameters) for parameters in kept], model.weights)


def key_of(fit: Fit) -> str:
    """What tells a fit from all others on the same records."""
    found = hashlib.sha256(",".join(effect.name for effect in fit.effects).encode())
    for values in (*fit.nonlinear, fit.coefficients, fit.weights):
        found.update(values.tobytes())
    return found.hexdigest()


def rms(problem: RegressionProblem, fit: Fit) -> Array:
    """RMS of what is left (joints,) over the samples that count."""
    residual = fit.residual(problem)
    return np.asarray(np.sqrt((residual**2).sum(axis=0) / np.maximum(problem.mask.sum(axis=0), 1)))


def weights(problem: RegressionProblem, fit: Fit) -> Array:
    """One over the size of what is left per joint, where it counts as many samples as it is worth."""
    sizes = rms(problem, fit)
    part = np.sqrt(np.array(samples(problem, fit)) / np.maximum(problem.mask.sum(axis=0), 1))
    return np.asarray(np.where(sizes > 0, part / np.maximum(sizes, 1e-300), 1.0))


def reweighted(problem: RegressionProblem, fit: Fit) -> Fit:
    """The fit with joints weighted anew."""
    return solve(problem, fit.effects, fit.nonlinear, weights(problem, fit))


def _lesser(one: Gain, other: Gain) -> Gain:
    """The one with the lower odds, that explains as little as either."""
    least = min(one, other, key=lambda gain: gain.log_odds)
    return replace(least, explained=min(one.explained, other.explained))


def _as_list(gain: Gain) -> list[float | bool | list[float]]:
    return [gain.log_odds, gain.explained, gain.confirmed, gain.parts.tolist(), gain.chance]
