"""What is missing, found at once: the dense fits, and what they name refitted exactly and told in the
order of evidence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from identify.core.text import listed
from identify.discovery.amplitude import level_gap
from identify.discovery.evidence import CLOSED, EvidenceCriterion, closed, variance_inflation
from identify.discovery.sparse.names import Named
from identify.discovery.sparse.search import explain
from identify.discovery.task import Option, Step, Task, Trial
from identify.discovery.thinned import thinned
from identify.discovery.workbench import ImpactWorkbench
from identify.fitting.selection.loop import Selection
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.vibration.problem import Problem, uncertain_as, with_effects
from identify.vibration.uncertainty import gap

Found = Selection[Effect, Trial]


def at_once(bench: ImpactWorkbench, first: Trial, story: Story) -> Found | None:
    """What a dense model names beyond the first, refitted; None where nothing is open, where amplitude
    matters, which no linear model has, or where nothing has evidence.
    """
    if closed(first) or level_gap(bench.problem) > CLOSED:
        return None
    problem = with_effects(thinned(bench.problem), first.task.effects, first.values)
    unseen = partial(_unseen, bench.problem) if bench.problem.validated else None
    found = explain(_from_the_study(problem, bench.problem), story, unseen)
    named, values = found.named, found.values
    if not named:
        return None
    problem = uncertain_as(bench.problem, found.problem)
    if problem is not bench.problem:
        bench.turn_to(problem, with_errors=True)
    final = _refitted(bench, first, named, values)
    found_all = listed([one.effect.sentence() for one in named])
    story.say(f"With {found_all}, refitted on all lines: {bench.standing(final)}.")
    return _told(bench, first, named, final, story)


def _unseen(study: Problem, found: Problem, effects: Sequence[Effect], values: Mapping[str, float]) -> float:
    """The gap that effects and values leave on the study's data for validation, with what was found to be
    uncertain.
    """
    study = uncertain_as(study, found)
    model = with_effects(study, [*study.file.study.effects, *effects], values)
    values = {**{p.name: p.initial for p in model.parameters}, **values}
    return gap(model.targets("validate"), model.at(values))


def _from_the_study(problem: Problem, study: Problem) -> Problem:
    """The problem from the study's own values: the present model's have made up for what is missing."""
    told = {p.name: p.initial for p in study.parameters}
    return with_effects(problem, problem.file.study.effects, told)


def _refitted(
    bench: ImpactWorkbench, first: Trial, named: Sequence[Named], values: dict[str, float]
) -> Trial:
    """The model with all that was named, on all lines, from the values that the dense fit ended with."""
    own = {name: value for one in named for name, value in one.values.items()}
    new = tuple(one.effect for one in named)
    bounded = _within(bench.problem, (*first.task.effects, *new), {**values, **own})
    [trial] = bench.workers.run([Task(first.task.effects, new, bounded, "settled")])
    return trial


def _within(problem: Problem, effects: Sequence[Effect], values: dict[str, float]) -> dict[str, float]:
    """The values within the bounds of the effects' parameters."""
    found = dict(values)
    for p in with_effects(problem, effects, {}).parameters:
        if p.name in found and not p.nuisance:
            found[p.name] = min(max(found[p.name], p.lower), p.upper)
    return found


def _told(bench: ImpactWorkbench, first: Trial, named: Sequence[Named], final: Trial, story: Story) -> Found:
    """The same as if the effects had been added one by one, the best supported first."""
    known, added = first.task.effects, [one.effect for one in named]
    tasks = [Task(known, tuple(added[:n]), {**final.values}, "quick") for n in range(1, len(added))]
    trials = [*bench.workers.run(tasks), final]
    criterion = EvidenceCriterion(variance_inflation(bench.problem, final))
    options, before = list[Option](), first
    for one, trial in zip(named, trials, strict=True):
        # Trials of few lines and of all have no odds over each other: these are those of the dense fit.
        gain = replace(criterion.gain(before, trial), log_odds=one.evidence)
        option = Option(one.effect, trial, max(trial.free - before.free, 0), gain)
        story.steps.append(Step(before, (option,), (option,), (), criterion, option.gain.explained))
        options.append(option)
        before = trial
    return Selection(first, final, tuple(options))
