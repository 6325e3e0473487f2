"""The loop: fit, say where it disagrees, try what could be missing, add what explains it, look again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.core.thresholds import CONVINCING, QUIET
from identify.discovery.evidence import HALF, MOST, EvidenceCriterion, confirmed, convinces, removed
from identify.discovery.search import Option, Step, as_options, inflation, search
from identify.discovery.trial import Task, Trial
from identify.discovery.workers import Workers
from identify.fitting.fit import ENOUGH, agreeing, starting_points
from identify.model.effects.base import Effect
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem

_PATIENCE = 2
"""How many additions that do not explain enough by themselves are followed, because two effects of equal size
hide each other.
"""
_TENTATIVE = 0.2
"""A step that removes less than this share of what is above noise, also with another one, is not even
followed.
"""
_MOST = 6
_NEARLY = 0.9
"""Once this share of what was above noise is gone, only what convinces by itself is added."""
_MANY = 8
"""An effect with this many parameters can stand for many things."""
_TOGETHER = 4
"""Starts of the first fit that are tried at once."""


@dataclass(frozen=True)
class Discovery:
    """How it went: the model at the start and at the end, the effects added in order, and every step that was
    looked at.

    kept: for each step, whether what it found is in the final model.
    """

    first: Trial
    final: Trial
    added: tuple[Option, ...]
    steps: tuple[Step, ...]

    @property
    def kept(self) -> tuple[bool, ...]:
        """For each step whether its best option is in the final model, in this form or another."""
        effects = self.final.task.effects

        def there(effect: Effect) -> bool:
            return any(one in effects for one in (effect, *effect.variants()))

        return tuple(step.best is not None and there(step.best.effect) for step in self.steps)


@dataclass
class Story:
    """Who is told of the progress: `say` gets a sentence at each turn, `done` the number of finished trials
    and of all in a step.
    """

    say: Callable[[str], None] = lambda sentence: None
    done: Callable[[int, int], None] = lambda number, total: None
    steps: list[Step] = field(default_factory=list)


def discover(problem: Problem, workers: Workers, story: Story | None = None) -> Discovery:
    """Find what is missing from the model of a problem, effect by effect.

    Raises InputError where a measurement to be fitted has no FRFs or their noise is not known.
    """
    story = story or Story()
    check_data(problem)
    first = accepted = _base(problem, workers)
    story.say(f"The present model: gap {first.gap:.2f}{_elsewhere(first)}.")
    present, kept, patience = accepted, 0, _PATIENCE
    options: list[Option] = []
    while len(options) < _MOST:
        step = search(workers, problem, present, story.done)
        story.steps.append(step)
        if step.best is None:
            story.say("No candidate is supported by the data.")
            break
        present = step.best.trial
        options.append(step.best)
        story.say(f"{step.best.effect.sentence()}: gap {present.gap:.2f}{_elsewhere(present)}.")
        if convinces(step.judge, accepted, present, HALF if len(options) == kept + 1 else MOST):
            options, present = _reshaped(workers, first, options, present, story)
            accepted, kept, patience = present, len(options), _PATIENCE
        elif patience == 0 or _hopeless(first, accepted, step):
            break
        else:
            patience -= 1
    added, final = _without_needless(workers, options[:kept], accepted, story)
    added, final = _exchanged(workers, problem, added, final, story)
    return Discovery(first, final, tuple(_in_turn(workers, problem, first, added, final)), tuple(story.steps))


def check_data(problem: Problem) -> None:
    """Raise an InputError unless every measurement to be fitted has FRFs with known noise."""
    for m in problem.measurements:
        if not isinstance(m.target, FrfTarget):
            raise InputError(
                m.name,
                "a modal table",
                "FRFs",
                "discovery compares FRFs with their noise; leave the table out",
            )
        _ = m.target.sigma


def _base(problem: Problem, workers: Workers) -> Trial:
    """The present model, fitted from several starts: a local minimum looks exactly like something missing."""
    study, names, scale = problem.file.study, [p.name for p in problem.parameters], Scale(problem.parameters)
    points = starting_points(problem.parameters, study.starts, study.start_factor, study.seed)
    known, starts = tuple(study.effects), [scale.to_values(x) for x in points]
    tasks = [Task(known, (), dict(zip(names, map(float, values), strict=True)), "start") for values in starts]
    ends: list[Trial] = []
    for first in range(0, len(tasks), _TOGETHER):
        ends = sorted(
            [*ends, *workers.run(tasks[first : first + _TOGETHER])], key=lambda trial: trial.squares
        )
        if agreeing([end.gap for end in ends]) >= ENOUGH and (ends[0].gap <= QUIET or len(ends) > _TOGETHER):
            break
    [trial] = workers.run([Task(known, (), ends[0].values, "thorough")])
    if not np.isfinite(trial.squares):
        raise InputError(
            "effects",
            f"the present model has no solution ({trial.failure})",
            "a model that `identify fit` can fit",
        )
    return trial


def _hopeless(first: Trial, accepted: Trial, step: Step) -> bool:
    """Whether a step that does not convince by itself is not worth following either."""
    return removed(first.gap, accepted.gap) > _NEARLY or removed(step.before.gap, step.reach) < _TENTATIVE


def _reshaped(
    workers: Workers, first: Trial, options: list[Option], final: Trial, story: Story
) -> tuple[list[Option], Trial]:
    """The added effects, one of them in another form if that explains what little is left: details show once
    nothing is in their way.
    """
    if removed(first.gap, final.gap) <= _NEARLY or final.gap <= QUIET:
        return options, final
    tasks = []
    for option in options:
        tasks += [
            Task(_without(final, option.effect), (variant,), final.values, "thorough")
            for variant in option.effect.variants()
        ]
    judge = EvidenceCriterion(final.gap**2)
    variants = as_options(judge, final, workers.run(tasks))
    if not variants or variants[0].evidence <= CONVINCING or not confirmed(final, variants[0].trial):
        return options, final
    best = variants[0]
    story.steps.append(Step(final, tuple(variants), best, (), judge, best.trial.gap))
    story.say(
        f"{best.effect.sentence()} in place of another form of it: gap"
        f" {best.trial.gap:.2f}{_elsewhere(best.trial)}."
    )
    return [*(option for option in options if option.effect in best.trial.task.known), best], best.trial


def _without_needless(
    workers: Workers, options: list[Option], final: Trial, story: Story
) -> tuple[list[Option], Trial]:
    """What is left of the added effects when those are taken out again that later ones have made needless."""
    number = 0
    while len(options) > 1 and number < len(options):
        effect = options[number].effect
        [without] = workers.run([Task(_without(final, effect), (), final.values, "thorough")])
        judge = EvidenceCriterion(final.gap**2)
        if (
            judge.evidence(without, final) > CONVINCING
            and confirmed(without, final)
            and without.gap - final.gap > 0.1 * (final.gap - 1)
        ):
            number += 1
            continue
        story.say(f"{effect.sentence()} is not needed any more: gap {without.gap:.2f}{_elsewhere(without)}.")
        options, final, number = options[:number] + options[number + 1 :], without, 0
    return options, final


def _exchanged(
    workers: Workers, problem: Problem, options: list[Option], final: Trial, story: Story
) -> tuple[list[Option], Trial]:
    """The added effects after each that can stand for many things has been looked for anew beside the others.

    The first effect that was found had to explain what the later ones now do; with them, something simpler
    may take its place (sequential replacement: Miller, Subset Selection in Regression, 2002, section 3.4).
    """
    number = 0
    while len(options) > 1 and number < len(options):
        effect = options[number].effect
        [without] = workers.run([Task(_without(final, effect), (), final.values, "thorough")])
        number += 1
        if final.free - without.free < _MANY:
            continue
        step = search(workers, problem, without, story.done)
        if (
            step.best is None
            or step.best.effect == effect
            or step.judge.evidence(final, step.best.trial) <= 0
        ):
            continue
        story.steps.append(step)
        story.say(
            f"{step.best.effect.sentence()} in place of {effect.sentence()}: gap {step.best.trial.gap:.2f}."
        )
        options = [*options[: number - 1], *options[number:], step.best]
        options, final = _without_needless(workers, options, step.best.trial, story)
        number = 0
    return options, final


def _in_turn(
    workers: Workers, problem: Problem, first: Trial, options: list[Option], final: Trial
) -> list[Option]:
    """The options with what each adds to those before it, which is not what it was found with where others
    were taken out since.
    """
    effects = [(*first.task.effects, *(one.effect for one in options[: n + 1])) for n in range(len(options))]
    if all(option.trial.task.effects == own for option, own in zip(options, effects, strict=True)):
        return options
    judge, before, result = EvidenceCriterion(inflation(problem, final)), first, []
    for option, own in zip(options, effects, strict=True):
        trial = final
        if len(own) < len(final.task.effects):
            [trial] = workers.run([Task(own, (), {**final.values, **before.values}, "thorough")])
        result.append(Option(option.effect, trial, judge.evidence(before, trial)))
        before = trial
    return result


def _without(trial: Trial, effect: Effect) -> tuple[Effect, ...]:
    """The effects of a trial but one."""
    return tuple(other for other in trial.task.effects if other != effect)


def _elsewhere(trial: Trial) -> str:
    return f", {trial.gap_validation:.2f} on data not fitted" if trial.count_validation else ""
