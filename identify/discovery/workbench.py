"""Hammer tests as the loop that adds effects sees them: a problem, its trials, and what a trial says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.core.thresholds import MATERIAL, MISSING, QUIET
from identify.discovery import pairs, screen
from identify.discovery.candidates import candidates, plausible
from identify.discovery.evidence import (
    CLOSED,
    FAR,
    POLICY,
    EvidenceCriterion,
    above_noise,
    closed,
    nearly_closed,
    variance_inflation,
)
from identify.discovery.laws_softly import with_laws
from identify.discovery.places.screen import PlaceFit
from identify.discovery.refit_softly import closing, promising_softly, varied_softly
from identify.discovery.screen_softly import faults_beside, stands_out
from identify.discovery.siblings import (
    with_coupled,
    with_leaning,
    with_siblings,
    with_springs_beside,
    with_struts,
)
from identify.discovery.task import Attempt, Option, Step, Task, Trial, near_enough, squares_of
from identify.discovery.workers import Workers, further
from identify.fitting.fit import ENOUGH, agreeing, starting_points
from identify.fitting.selection.policy import Policy
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.model.effects.joint_compliance import JointCompliance
from identify.vibration.nuisances.settings import FORMS_ALONE, IMPACTS_ALONE
from identify.vibration.problem import Problem, with_effects, with_uncertainty
from identify.vibration.records import check_records

_AT_ONCE, _TWO, _ALIKE = 4, 2, 1.01
"""Starts of the first fit that are tried at once; with errors of what was told; how many times the best one's
gap another may leave there, and agree with it."""


class ImpactWorkbench:
    """FRFs of a hammer test and the model of a study (`identify.fitting.selection.workbench.Workbench`)."""

    def __init__(self, problem: Problem, workers: Workers) -> None:
        self.problem, self.workers = problem, workers
        self._begun: Trial | None = None
        self._places: list[tuple[tuple[Effect, ...], list[PlaceFit]]] = []
        self._looked_at: Sequence[Effect] = ()
        self._pairs: Sequence[Trial] = ()
        self._screened: Sequence[Trial] = ()
        self._models: dict[frozenset[str], Trial] = {}
        self._refitted: dict[frozenset[str], Trial] = {}

    @property
    def policy(self) -> Policy:
        """What is asked of the effects."""
        return POLICY

    def begin(self) -> Trial:
        """The present model, fitted from several starts: a local minimum looks exactly like something
        missing; or the one to go on from.
        """
        if self._begun is not None:
            return self._begun
        problem, workers = self.problem, self.workers
        study, scale = problem.file.study, Scale(problem.parameters)
        names, known = [p.name for p in problem.parameters], tuple(study.effects)
        count = min(study.starts, _AT_ONCE) if workers.with_errors else study.starts
        points = starting_points(problem.parameters, count, study.start_factor, study.seed)
        starts = [dict(zip(names, map(float, scale.to_values(x)), strict=True)) for x in points]
        tasks = [Task(known, (), values, "start") for values in starts]
        at_once = _TWO if workers.with_errors else _AT_ONCE
        ends: list[Trial] = []
        for first in range(0, len(tasks), at_once):
            more = workers.run(tasks[first : first + at_once])
            ends = sorted([*ends, *more], key=squares_of)
            if self._agree(ends):
                break
        if workers.with_errors:
            [trial] = further(workers, further(workers, ends[:1], "likely"), "onward")
        else:
            [trial] = workers.run([Task(known, (), ends[0].values, "thorough")])
        if not np.isfinite(trial.squares):
            raise InputError(
                "effects",
                f"the present model has no solution ({trial.failure})",
                "a model that `identify fit` can fit",
            )
        check_records(problem, problem.at(trial.values), trial.gap)
        return trial

    def turn_to(self, problem: Problem, *, with_errors: bool) -> None:
        """Go on with another problem, and whether errors of what was told are fitted along."""
        self.problem = problem
        self.workers.turn_to(problem, with_errors=with_errors)

    def go_on_from(self, model: Trial) -> None:
        """Begin the next selection with a model, beside which nothing has been looked at."""
        self._begun, self._pairs = model, ()

    def _agree(self, ends: Sequence[Trial]) -> bool:
        """Whether enough starts, the best first, have ended in the best minimum; beside errors of what was
        told they are only led near it.
        """
        if self.workers.with_errors:
            return len(ends) > 1 and ends[1].gap <= _ALIKE * ends[0].gap
        enough = agreeing([end.gap for end in ends]) >= ENOUGH
        return enough and (ends[0].gap <= QUIET or len(ends) > _AT_ONCE)

    def added(self, model: Trial) -> Sequence[Effect]:
        """Effects beyond those of the study."""
        return model.task.effects[len(self.problem.file.study.effects) :]

    def candidates(self, model: Trial) -> list[Effect]:
        """Every effect of the catalogue wherever it can sit, but those that an amplitude rules out."""
        present = with_effects(self.problem, model.task.effects, model.values)
        # Stated uncertainty and what is known suffice; at other postures the form of a link tells more.
        along = model.task.has_form or self.problem.file.study.uncertainty == IMPACTS_ALONE
        closes = closed(model) or (model.gap < CLOSED and along)
        if present.nuisances.entries and closes:
            return []
        return plausible(present, model.values, candidates(self.problem, model.task.effects))

    def screen(self, model: Trial, effects: Sequence[Effect], story: Story) -> list[Attempt]:
        """Trials on few lines, best first."""
        self.came_through(model)
        self._looked_at = effects
        if self.workers.with_errors and not effects:
            return []
        trials = pairs.second_of_two(self.workers, model, self._pairs)
        if not trials:
            places, trials = screen.screened(self.workers, self.problem, effects, model, story)
            self._places.append((model.task.effects, places))
        self._screened = trials
        return [screen.attempt(model, trial) for trial in trials]

    def came_through(self, model: Trial) -> None:
        """Keep a model that effects are added to."""
        self._models.setdefault(_key(model.task.effects), model)

    def refitted(self, effects: Sequence[Effect]) -> Trial | None:
        """A model of these effects, in any order, that was fitted on all lines on the way."""
        key = _key(effects)
        return self._models.get(key) or self._refitted.get(key)

    def places(self, model: Trial) -> list[PlaceFit]:
        """The places that were looked at beside the effects of a model, best first."""
        return next((found for effects, found in reversed(self._places) if effects == model.task.effects), [])

    def promising(self, model: Trial, screened: Sequence[Attempt]) -> Sequence[Attempt]:
        """Those that may win."""
        trials = [one.model for one in screened]
        if self.workers.with_errors:
            chosen = promising_softly(trials)
        else:
            chosen = screen.promising(self.workers, model, trials)
        return [screen.attempt(model, trial) for trial in chosen]

    def refit(self, model: Trial, promising: Sequence[Attempt]) -> list[list[Attempt]]:
        """Each on all lines and from several starts, the best of them in their other variants too."""
        groups = screen.thorough(self.workers, [one.model for one in promising], model.gap)
        if self.workers.with_errors:
            groups = with_springs_beside(self.workers, self.problem, self._screened, groups)
            groups = with_laws(self.workers, self.problem, groups)
        elif not screen.anchor_of(model):
            groups = with_siblings(self.workers, self.problem, model, self._looked_at, groups)
            groups = with_coupled(self.workers, self._screened, groups)
        groups = with_leaning(self.workers, with_struts(self.workers, groups))
        self._refitted.update((_key(t.task.effects), t) for group in groups for t in group)
        return [[screen.attempt(model, trial) for trial in trials] for trials in groups]

    def criterion(self, models: Sequence[Trial]) -> EvidenceCriterion:
        """By the uncertainties of the best of these models."""
        return EvidenceCriterion(variance_inflation(self.problem, min(models, key=squares_of)))

    def quick_criterion(self, model: Trial) -> EvidenceCriterion:
        """By how far the model is from the data."""
        return EvidenceCriterion(model.gap**2)

    def pair(
        self,
        step: Step,
        screened: Sequence[Attempt],
        banned: Sequence[Effect],
    ) -> tuple[tuple[Option, ...], float] | None:
        """The better of two that hide each other; not where amplitude matters, because it would take long."""
        if screen.anchor_of(step.before):
            return None
        quick = pairs.various([one.model for one in screened])
        if self.workers.with_errors:
            return self._pair_softly(step, quick)
        if step.best is None:
            return None
        quick += self._of_its_bearing(step.before, quick)
        two = pairs.first_of_two(self.workers, step, quick)
        self._pairs = two.pairs
        return (two.best,), two.explained

    def _of_its_bearing(self, before: Trial, quick: Sequence[Trial]) -> list[Trial]:
        """Quick trials of the other directions in which the joint may give way whose compliance is ahead of
        all others': a bearing that is soft in one is often soft in several, which hide each other.
        """
        ahead = (one for trial in quick for one in trial.task.new if isinstance(one, JointCompliance))
        joints, there = next((one.joints for one in ahead), None), [trial.task.new for trial in quick]
        tasks = [
            Task(before.task.effects, (one,), before.values)
            for one in self._looked_at
            if isinstance(one, JointCompliance) and one.joints == joints and (one,) not in there
        ]
        return self.workers.run(tasks)

    def _pair_softly(self, step: Step, quick: Sequence[Trial]) -> tuple[tuple[Option, ...], float] | None:
        """Also of what is missing with a wrong channel, where neither was convincing; not of what little is
        left, beside effects that were added or in other data alone: any two fit some of that.
        """
        if not step.options or not quick or self._stands_out(step, quick):
            return None
        if nearly_closed(step.before) and (self.added(step.before) or not above_noise(step.before.gap)):
            return None
        faults = faults_beside(self.workers, self.problem, quick[0], self._looked_at)
        asked = step if step.found else replace(step, found=step.options[:1])
        two = pairs.first_of_two(self.workers, asked, [*quick, *faults])
        self._pairs = two.pairs
        self._refitted.update((_key(trial.task.effects), trial) for trial in two.single)
        if not step.found and two.best == asked.found[0] and two.explained == two.best.gain.explained:
            return None
        return (two.best,), two.explained

    def _stands_out(self, step: Step, quick: Sequence[Trial]) -> bool:
        """Whether what a step found has few parameters, and leaves nothing open or comes far nearer to the
        data than all else: it stands for no two others at once, and what is missing beside it the next step
        will see.
        """
        if step.best is None or step.best.size >= self.policy.many:
            return False
        [first] = quick[0].task.new
        ahead = step.best.effect in (first, *first.variants()) and stands_out(quick)
        return ahead or closed(step.best.model)

    def settled(self, model: Trial) -> Trial:
        """The trial itself, which was thorough; beside errors of what was told, whose valleys are long, taken
        to their end where little is left: what the last steps would do must not be taken for the next
        effect's.

        With a link that bends, which leaves little more than noise, its form too is fitted along from now on;
        where it leaves much it stands for something else.  Beside what depends on amplitude so are the
        impacts, if that closes the gap.
        """
        if not self.workers.with_errors and nearly_closed(model) and model.task.has_form:
            stated = self.problem.file.study.uncertainty is not None
            problem = self.problem if stated else with_uncertainty(self.problem, FORMS_ALONE)
            self.turn_to(problem, with_errors=True)
        if not self.workers.with_errors and above_noise(model.gap) and screen.anchor_of(model):
            return self._with_impacts(model)
        if not self.workers.with_errors or model.gap > MISSING or model.task.how == "settled":
            return model
        return further(self.workers, [model], "settled")[0]

    def _with_impacts(self, model: Trial) -> Trial:
        """With strengths and duration of the impacts fitted along, from now on, where that closes the gap;
        else the same, because everything else is missing beside impacts that are as they were told.

        By way of few lines, with the impacts from as they were told: on all lines, straight from where others
        made up for them, it ends in a poorer valley.
        """
        before = self.problem
        if before.file.study.uncertainty is not None:
            return model
        problem = with_uncertainty(before, IMPACTS_ALONE)
        self.workers.turn_to(problem, with_errors=True)
        [settled] = self.workers.run([replace(model.task, values=model.values, how="thorough")])
        if settled.gap < CLOSED and model.gap - settled.gap >= MATERIAL:
            self.problem = problem
            return settled
        self.workers.turn_to(before, with_errors=False)
        return model

    def leave_out(self, model: Trial, effects: Sequence[Effect]) -> list[Trial]:
        """Refitted without each of them, or models that it grew from where these are nearer to the data.

        These are not taken for the best there is: one that was stuck in a wrong valley would keep whatever
        was added to it.
        """
        tasks = [Task(_without(model, effect), (), model.values, "thorough") for effect in effects]
        if self.workers.with_errors:
            return self._left_out_softly(model, tasks, [self.refitted(task.known) for task in tasks])
        there = [self._models.get(_key(task.known)) for task in tasks]
        pairs = zip(self.workers.run(tasks), there, strict=True)
        return [min(filter(None, pair), key=squares_of) for pair in pairs]

    def _left_out_softly(
        self, model: Trial, tasks: Sequence[Task], there: Sequence[Trial | None]
    ) -> list[Trial]:
        """Beside errors of what was told, whose refits take long: on from the model, and from afresh only
        those that are not there, unless they are far from the data both so and where residuals count for
        little, because the errors they go on with may keep them in a wrong valley; none where all begins, and
        none of a model that leaves more than noise, that is there, nor of what does not come near the data.
        """
        first = tuple(self.problem.file.study.effects)
        found = {_key(task.known): [one] if one else [] for task, one in zip(tasks, there, strict=True)}
        missing = [task for task in tasks if not found[_key(task.known)]]

        def stuck(task: Task) -> bool:
            return task.known != first and closed(model) and not closed(found[_key(task.known)][0])

        def refit(some: Sequence[Task]) -> None:
            for trial in self.workers.run(some):
                found[_key(trial.task.effects)].append(trial)

        other = closing(self.workers, [task for task in tasks if task not in missing and stuck(task)], model)
        refit([replace(task, how="onward") for task in tasks if task in [*missing, *other]])
        far = [task for task in missing if found[_key(task.known)][0].gap > FAR * model.gap]
        refit([task for task in missing if task not in far] + closing(self.workers, far, model))
        return [min(found[_key(task.known)], key=squares_of) for task in tasks]

    def removable(self, model: Trial) -> Sequence[Effect]:
        """All that were added."""
        return self.added(model)

    def replaceable(self, model: Trial, effect: Effect) -> bool:
        """One with many parameters, which can stand for many things."""
        return self.size(model, effect) >= self.policy.many

    def can_replace(self, effect: Effect) -> bool:
        """Always."""
        return True

    def implausible(self, model: Trial, effect: Effect) -> bool:
        """Never: bounds keep values where they can be."""
        return False

    def size(self, model: Trial, effect: Effect) -> int:
        """Number of free parameters that the model has no more without the effect."""
        [without] = self.leave_out(model, [effect])
        return model.free - without.free

    def variants(self, model: Trial, *, richer: bool = False) -> list[Attempt]:
        """The model with an added effect in another variant, or only in one with more parameters, refitted;
        those that were tried when it was found are not tried anew.
        """
        tasks = [
            Task(_without(model, effect), (variant,), model.values)
            for effect in self.added(model)
            for variant in effect.variants()
            if not richer or self._richer(model, effect, variant)
        ]
        known = [trial for task in tasks if (trial := self._refitted.get(_key(task.effects)))]
        left = [task for task in tasks if _key(task.effects) not in self._refitted]
        if self.workers.with_errors:
            trials = varied_softly(self.workers, left, model, self.added(model))
        else:
            near = near_enough(self.workers.run(left), model.gap)
            trials = further(self.workers, near, "thorough")
        return [screen.attempt(model, trial) for trial in [*known, *trials] if np.isfinite(trial.squares)]

    def _richer(self, model: Trial, effect: Effect, variant: Effect) -> bool:
        """Whether a model has more parameters with a variant in place of an effect."""
        other = (*_without(model, effect), variant)
        mine, its = (with_effects(self.problem, effects, {}).size for effects in (model.task.effects, other))
        return its > mine

    def at_noise(self, model: Trial) -> bool:
        """Whether the residual passes as noise."""
        return model.gap <= QUIET

    def standing(self, model: Trial) -> str:
        """The gap on fitted and on other data."""
        elsewhere = f", {model.gap_validation:.2f} on data not fitted" if model.count_validation else ""
        return f"gap {model.gap:.2f}{elsewhere}"


def _without(trial: Trial, effect: Effect) -> tuple[Effect, ...]:
    """The effects of a trial but one."""
    return tuple(other for other in trial.task.effects if other != effect)


def _key(effects: Sequence[Effect]) -> frozenset[str]:
    """Models of the same effects are the same, in whatever order."""
    return frozenset(effect.model_dump_json() for effect in effects)
