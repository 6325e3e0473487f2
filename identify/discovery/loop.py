"""What is missing from the model of a hammer test: the loop that adds effects (`identify.fitting.selection`),
and what each one adds in the end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identify.core.errors import InputError
from identify.discovery.evidence import EvidenceCriterion, closed, variance_inflation
from identify.discovery.places.screen import PlaceFit
from identify.discovery.promotion import in_fitting_forms, judge_of, promoted
from identify.discovery.records import timed
from identify.discovery.sparse.at_once import at_once
from identify.discovery.task import Option, Step, Task, Trial
from identify.discovery.workbench import ImpactWorkbench
from identify.discovery.workers import Workers
from identify.fitting.selection.loop import Selection, select
from identify.fitting.selection.prune import still_there
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem
from identify.vibration.study import StudyFile

_SEVERAL, _MANY = 2, 5
_SHAPES = ("appended-resonator", "link-flexibility", "joint-relaxation")


@dataclass(frozen=True)
class Discovery:
    """How it went: the model at the start and at the end, the effects added in order, and every step that was
    looked at, with the places that it looked at, best first.

    problem: with what was found to be uncertain besides what the study says.
    """

    problem: Problem
    first: Trial
    final: Trial
    added: tuple[Option, ...]
    steps: tuple[Step, ...]
    places: tuple[list[PlaceFit], ...] = ()

    @property
    def kept(self) -> tuple[bool, ...]:
        """For each step whether its best option is in the final model, in this variant or another."""
        effects = self.final.task.effects

        def there(effect: Effect) -> bool:
            return any(one in effects for one in (effect, *effect.variants()))

        return tuple(step.best is not None and there(step.best.effect) for step in self.steps)


def discover(problem: Problem, workers: Workers, story: Story | None = None) -> Discovery:
    """Find what is missing from the model of a problem, effect by effect.

    Raises InputError where a measurement to be fitted has no FRFs or their noise is not known.
    """
    check_data(problem)
    story = story or Story()
    problem = timed(problem)
    workers.turn_to(problem, with_errors=workers.with_errors)
    bench = ImpactWorkbench(problem, workers)
    found, named = _found(bench, story)
    first, problem = found.first, bench.problem
    if named and not closed(found.final):
        # What was blamed on what was told is named, and something else may stand out beside it.
        bench.go_on_from(found.final)
        earlier, (found, _) = found.options, _selected(bench, story)
        options = (*still_there(bench, earlier, found.final), *found.options)
        found = Selection(first, found.final, options)
    added = in_turn(problem, workers, first, found.options, found.final, bench.refitted)
    places = tuple(bench.places(step.before) for step in story.steps)
    return Discovery(problem, first, found.final, tuple(added), tuple(story.steps), places)


def _found(bench: ImpactWorkbench, story: Story) -> tuple[Selection[Effect, Trial], bool]:
    """What is missing at once and, where that leaves something open, by search; whichever the data prefer."""
    first = bench.begin()
    bench.go_on_from(first)
    study = bench.problem
    together = at_once(bench, first, story)
    if together is not None and (_settles(together) or story.late):
        return together, False
    steps, story.steps, problem = story.steps, [], bench.problem
    if problem is not study:
        bench.turn_to(study, with_errors=False)
    found, named = _selected(bench, story)
    if together is not None and _likelier(bench, together.final, found.final):
        story.steps = steps
        if problem is not bench.problem:
            bench.turn_to(problem, with_errors=True)
        return together, False
    return found, named


def _settles(together: Selection[Effect, Trial]) -> bool:
    """Whether no search is needed: few effects that leave noise alone, or more of the structure than one by
    one could find.

    Bodies on several links, what entered by a shape beside others, or wrong instruments where something stays
    open, can stand for one effect that the dense model does not have.
    """
    kinds = [one.effect.kind for one in together.options]
    of_structure = sum(not one.effect.of_measurement for one in together.options)
    shapes = any(kind in _SHAPES for kind in kinds) and len(kinds) > 1
    few = closed(together.final) and not shapes and kinds.count("added-mass") < _SEVERAL
    return few or of_structure > _MANY


def _likelier(bench: ImpactWorkbench, one: Trial, other: Trial) -> bool:
    """Whether the data, those that were not fitted too, prefer one of two models that may both leave
    something open.
    """
    criterion = EvidenceCriterion(
        variance_inflation(bench.problem, min(one, other, key=lambda trial: trial.gap))
    )
    return criterion.log_odds(other, one) > 0


def _selected(bench: ImpactWorkbench, story: Story) -> tuple[Selection[Effect, Trial], bool]:
    """What is missing, and whether any of it was named because errors of what was told were beyond belief."""
    found, problem = select(bench, story), bench.problem
    # A law that no effect has is only near what acts, and errors make up for the rest.
    if not problem.nuisances.entries or any(one.last_resort for one in found.final.task.effects):
        return found, False
    judge, options = in_fitting_forms(judge_of(problem, found.final), bench, found.options, story)
    named, final = promoted(judge, bench.workers, options, story)
    if final is not found.final:
        final = bench.settled(final)
    return Selection(found.first, final, tuple(named)), len(named) > len(options)


def check_data(problem: Problem) -> None:
    """Raise an InputError unless every measurement to be fitted has FRFs with known noise."""
    _check_frfs(problem.file)
    for m in problem.measurements:
        assert isinstance(m.target, FrfTarget)
        _ = m.target.sigma


def _check_frfs(file: StudyFile) -> None:
    """Raise an InputError for modal tables."""
    measurements = file.study.measurements
    tables = [number for number, m in enumerate(measurements) if m.modes is not None]
    alone = len(tables) == len(measurements)
    for number in tables:
        fix = "give the FRFs that the modes were found in, as `file`" if alone else "leave the table out"
        where = f"{file.path}, key measurements.{number}"
        raise InputError(where, "a modal table", "FRFs, whose noise tells what is evidence", fix)


def with_likelihood(file: StudyFile) -> tuple[StudyFile, str]:
    """The study with the likelihood for its cost, which evidence is weighed by; and a note where it has
    another one, else an empty text.
    """
    _check_frfs(file)
    cost, likelihood = file.study.cost, parse_cost("frf-least-squares")
    if cost == likelihood:
        return file, ""
    changed = file.study.model_copy(update={"cost": likelihood})
    note = (
        f"the search compares FRFs by {likelihood.kind}, their likelihood, in place of the study's"
        f" {cost.kind}{' with options' * (cost.kind == likelihood.kind)}: nothing else weighs evidence"
    )
    return file.model_copy(update={"study": changed}), note


def in_turn(
    problem: Problem,
    workers: Workers,
    first: Trial,
    options: Sequence[Option],
    final: Trial,
    refitted: Callable[[Sequence[Effect]], Trial | None] = lambda effects: None,
) -> list[Option]:
    """The options with what each adds to those before it, which is not what it was found with where others
    were taken out since; the last one with the final model, which was taken further than it was found.

    refitted: a model of these effects that was fitted on the way.
    """
    known = first.task.effects
    effects = [(*known, *(one.effect for one in options[: n + 1])) for n in range(len(options))]
    if all(option.model.task.effects == own for option, own in zip(options, effects, strict=True)):
        return [*options[:-1], *(replace(one, model=final) for one in options[-1:])]
    criterion, before = EvidenceCriterion(variance_inflation(problem, final)), first
    result: list[Option] = []
    for option, own in zip(options, effects, strict=True):
        trial = final if len(own) == len(final.task.effects) else refitted(own)
        if trial is None:
            [trial] = workers.run([Task(own, (), {**final.values, **before.values}, "thorough")])
        gain = criterion.gain(before, trial)
        result.append(Option(option.effect, trial, trial.free - before.free, gain))
        before = trial
    return result
