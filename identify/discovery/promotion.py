"""Errors of what was told that are beyond belief, once a gap is closed, become effects; what was added gives
way to what needs no such error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import MATERIAL
from identify.discovery.candidates import candidates
from identify.discovery.evidence import (
    CLOSED,
    EvidenceCriterion,
    disagreement,
    errors_of,
    variance_inflation,
)
from identify.discovery.refit_softly import promising_softly, thorough_softly
from identify.discovery.screen import attempt
from identify.discovery.screen_softly import screened_softly
from identify.discovery.siblings import with_springs_beside, with_struts
from identify.discovery.suspects import (
    Suspect,
    alike,
    beyond_belief,
    by_chance,
    causes,
    foreseen_fall,
    log_chance,
    turning_with,
    without_errors_at,
)
from identify.discovery.task import Attempt, Option, Step, Task, Trial, squares_of
from identify.discovery.workbench import ImpactWorkbench
from identify.discovery.workers import Workers, further
from identify.fitting.selection.workbench import Story
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.vibration.nuisances.stated import times_as_large
from identify.vibration.problem import Problem

_PROMOTED = 6
"""Errors of what was told that become effects at most."""
_AT_ONCE = 2
"""How many of them are tried at once, on the chance that the first is refused."""
_RIVALS = 3
"""What is compared in full with a wrong sensor, of what comes nearest in a step."""
_AS_MUCH = 0.5
"""Of what the best candidate explains of a wrong link, what another one must: the gap is closed, so that
nothing is missing beside it."""
_BEYOND_CHANCE = float(np.log(100))
"""They must be rarer than once in a hundred tests."""
_HOPE = 0.75
"""Share of that which an effect must reach by what is foreseen of its fit to be fitted."""


@dataclass(frozen=True, eq=False)
class Promotion:
    """What tells errors of a model that are beyond belief from chance.

    inflation_of: how many times too sure naive variances are for a model; disagreement_of: how many times the
    variance of noise its forces disagree by; errors_of: covariance and scatter (e, e) of its errors, in
    stated standard deviations (`identify.vibration.uncertainty.fitted_errors`).
    """

    problem: Problem
    inflation_of: Callable[[Trial], float]
    disagreement_of: Callable[[Trial], float]
    errors_of: Callable[[Trial], tuple[Array, Array]]
    model: Trial

    @cached_property
    def _inflation(self) -> float:
        return max(self.inflation_of(self.model), 1.0)

    @cached_property
    def _disagreement(self) -> float:
        return max(self.disagreement_of(self.model), 1.0)

    @cached_property
    def suspects(self) -> list[Suspect]:
        """Effects that stand for errors beyond belief, but those that correlated residuals may have made and
        those whose fit could not show it.
        """
        found = beyond_belief(self.problem.nuisances, self.model.values, self.problem.robot)
        if not found:
            return []
        (covariance, scatter), shift = self._errors_found, self._shift

        def may(one: Suspect) -> bool:
            own, part = shift[one.errors], np.ix_(one.errors, one.errors)
            if by_chance(own, scatter[part]):
                return False
            fall = foreseen_fall(own, covariance[part])
            least = _HOPE * _BEYOND_CHANCE  # what forces disagree by takes longer to tell
            return self._log_odds(fall, 1) > least and self._log_odds(fall / self._disagreement, 1) > least

        return [one for one in found if may(one)]

    def suspects_but(self, tried: Sequence[Effect]) -> list[Suspect]:
        """Those whose effects were neither tried nor are in the model."""
        return [one for one in self.suspects if one.effect not in (*tried, *self.model.task.effects)]

    @cached_property
    def too_large(self) -> bool:
        """Whether all errors together are larger than stated, beyond chance."""
        covariance, _ = self._errors_found
        return times_as_large(self._shift, np.sqrt(np.diag(covariance))) > 1

    @cached_property
    def _errors_found(self) -> tuple[Array, Array]:
        return self.errors_of(self.model)

    @cached_property
    def _shift(self) -> Array:
        return np.array([self.model.values[one.name] for one in self.problem.nuisances.entries])

    def log_odds(self, after: Trial, rival: Trial | None = None) -> float:
        """Minus the logarithm of the chance that any of the causes of errors would gain so much.

        Residuals count for less, as in all evidence; errors of what was told are independent.  Beside a rival
        whose gap is the same but for what noise models get wrong, they count as that one's: a spring under a
        body fits a little of that.  Where forces disagree the model's form is not quite what was measured,
        and errors of what was told make up for it: all of it counts for less.  What predicts data that were
        not fitted worse is no cause.
        """
        if after.count_validation and after.gap_validation - self.model.gap_validation >= MATERIAL:
            return float("-inf")
        errors = self._errors(self.model) - self._errors(after)
        like = rival if rival and abs(rival.gap - after.gap) < MATERIAL else after
        residuals = self.model.squares - like.squares - self._errors(self.model) + self._errors(like)
        squares = (errors + residuals / self._inflation) / self._disagreement
        return self._log_odds(squares, after.free - self.model.free)

    def beyond_chance(self, after: Trial) -> bool:
        """Whether that chance is too small to be one."""
        return self.log_odds(after) > _BEYOND_CHANCE

    def _log_odds(self, squares: float, free: int) -> float:
        return -log_chance(squares, free) - float(np.log(causes(self.problem.nuisances)))

    def log_odds_of_size(self, after: Trial) -> float:
        """The same less what free parameters cost (Schwarz 1978): by an angle of its own a turned sensor
        comes as near as a reversed channel where that one hardly moves.
        """
        return self.log_odds(after) - (after.free - self.model.free) * float(np.log(after.count)) / 2

    def _errors(self, trial: Trial) -> float:
        return sum(trial.values[one.name] ** 2 for one in self.problem.nuisances.entries)


def judge_of(problem: Problem, model: Trial) -> Promotion:
    """Of a fitted model."""
    doubts = partial(variance_inflation, problem), partial(disagreement, problem)
    return Promotion(problem, *doubts, partial(errors_of, problem), model)


def in_fitting_forms(
    judge: Promotion, bench: ImpactWorkbench, options: Sequence[Option], story: Story
) -> tuple[Promotion, list[Option]]:
    """The model and its options, where it closes the gap with errors beyond belief, with an added effect in a
    richer form, or a rival in its place, that needs none.
    """
    model = judge.model
    if model.gap >= CLOSED or not judge.suspects:
        return judge, list(options)
    fewer = [one for one in rivals(model, story.steps) if judge.beyond_chance(one)]
    ended = further(bench.workers, fewer[:_AT_ONCE], "settled")
    others = [attempt(model, one) for one in ended if not replace(judge, model=one).suspects]
    forms = bench.variants(model, richer=True)
    return in_place_of(judge, [*forms, *others], options, story)


def rivals(model: Trial, steps: Sequence[Step]) -> list[Trial]:
    """What closes the gap as the model does, with another effect than the one that a step took."""
    every = (option.model for step in steps for option in step.options)
    there = model.task.effects
    return [
        one
        for one in every
        if one.count == model.count
        and one.gap < CLOSED
        and one.task.new[0] not in there
        and len(one.task.effects) == len(there)
        and all(effect in there for effect in one.task.known)
    ]


def in_place_of(
    judge: Promotion, others: Sequence[Attempt], options: Sequence[Option], story: Story
) -> tuple[Promotion, list[Option]]:
    """The model and its options with an added effect in another form, or another effect in its place, where
    that takes away errors beyond chance: what an effect cannot say must not be blamed on sensors and links.
    """
    best = max(others, key=lambda one: judge.log_odds(one.model), default=None)
    if best is None or not judge.beyond_chance(best.model):
        return judge, list(options)
    effects = best.model.task.effects
    kept = [
        one
        if one.effect in effects
        else replace(one, effect=best.effect, model=best.model, size=one.size + best.size)
        for one in options
    ]
    old = " and ".join(one.effect.sentence() for one in options if one.effect not in effects)
    story.say(f"{best.effect.sentence()} in place of {old}: fewer errors of what was told.")
    return replace(judge, model=best.model), kept


def promoted(
    judge: Promotion, workers: Workers, options: Sequence[Option], story: Story
) -> tuple[list[Option], Trial]:
    """The options and the model where errors of what was told that are beyond belief have become effects.

    Only once the gap is closed: before, they make up for what was not found.  What looks like a wrong link is
    compared with what else adds inertia, where all errors together are too large once beside each model even
    if no body on that link explains it; a wrong sensor with whatever else may be wrong there.
    """
    kept, tried, ahead = list(options), list[Effect](), list[Trial]()
    searched: Trial | None = None
    for _ in range(_PROMOTED if judge.model.gap < CLOSED else 0):
        model, left = judge.model, judge.suspects_but(tried)
        if not left:
            break
        effect = left[0].effect
        trial = next((one for one in ahead if one.task.new == (effect,)), None)
        if trial is None:
            tasks = [
                Task(model.task.effects, (one.effect,), {**model.values, **one.start}, "onward")
                for one in left[:_AT_ONCE]
            ]
            trial, *_ = ahead = workers.run(tasks)
        tried.append(effect)
        compare = judge.beyond_chance(trial)
        if isinstance(effect, AddedMass) and searched is not model and judge.too_large:
            searched, compare = model, True
            story.say(f"Errors of {effect.link} are beyond what was stated: looking for what causes them.")
        if compare:
            trial = _best_alike(judge, workers, trial, story.one_more())
        if judge.beyond_chance(trial):
            [trial] = further(workers, [trial], "settled")
        if judge.beyond_chance(trial):
            [named], criterion = trial.task.new, EvidenceCriterion(max(trial.gap**2, 1.0))
            gain = replace(criterion.gain(model, trial), log_odds=judge.log_odds(trial))
            kept.append(Option(named, trial, trial.free - model.free, gain))
            judge, ahead = replace(judge, model=trial), []  # which were beside another model
            story.say(f"{named.sentence()}: more than stated uncertainty allows.")
    return kept, judge.model


def _best_alike(judge: Promotion, workers: Workers, trial: Trial, done: Callable[[], None]) -> Trial:
    """The trial of an effect beside a model, or of what looks like it where that explains more."""
    problem, model, [effect] = judge.problem, judge.model, trial.task.new
    known = model.task.effects
    if isinstance(effect, AddedMass):
        # Whatever is missing in small may have moved a link's inertia.
        structure = [
            one
            for one in candidates(problem, known)
            if one != effect and not one.of_measurement and not one.of_amplitude
        ]
        screened = screened_softly(workers, problem, structure, model, done, part=_AS_MUCH)
        groups = thorough_softly(workers, promising_softly(screened))
        groups = with_struts(workers, with_springs_beside(workers, problem, screened, groups))
        turning = [one for one in turning_with(effect, problem.robot) if one not in known]
        fresh = workers.run([Task(known, (one,), model.values, "afresh") for one in turning])
        every = [trial, *chain.from_iterable(groups), *further(workers, fresh, "onward")]
        return max(every, key=lambda one: judge.log_odds(one, trial))
    rivals = [one for one in alike(effect, problem.robot, problem.points) if one not in known]
    clean = without_errors_at(effect, problem.nuisances, model.values)
    first = sorted(workers.run([Task(known, (one,), clean, "beside") for one in rivals]), key=squares_of)
    tasks = [
        Task(known, (effect,), trial.values, "nearby"),
        *(replace(one.task, how="nearby") for one in first[:_RIVALS]),
    ]
    best = max(workers.run(tasks), key=judge.log_odds_of_size)
    if best.task.new == trial.task.new:
        return trial
    [other] = workers.run([Task(known, best.task.new, best.values, "onward")])
    return max(trial, other, key=judge.log_odds_of_size)
