"""What is missing from the model of a hammer test: the present model, all that a linear model may lack at
once, other forms of that, what depends on amplitude, laws that no effect has; and what each adds in the end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from identify.core.errors import InputError
from identify.core.thresholds import CONVINCING
from identify.discovery.by_amplitude import by_amplitude
from identify.discovery.by_law import by_law
from identify.discovery.evidence import EvidenceCriterion, variance_inflation
from identify.discovery.forms import in_other_forms
from identify.discovery.importance import ranked
from identify.discovery.places.screen import PlaceFit
from identify.discovery.present import present_model
from identify.discovery.records import timed
from identify.discovery.sparse.at_once import at_once
from identify.discovery.state import State, likelier
from identify.discovery.task import FEW_STEPS, Option, Step, Task, Trial
from identify.discovery.unnamed import left_open
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.target import FrfTarget
from identify.vibration.intervals import odds_over_ends
from identify.vibration.problem import Problem, with_effects
from identify.vibration.study import StudyFile

_FOLLOWED = 6
"""Effects whose path is fitted on all lines, with the gap on data that are not fitted."""


@dataclass(frozen=True)
class Discovery:
    """How it went: the model at the start and at the end, the effects added, the most important first, and
    every step that was looked at, with the places that it looked at, best first.

    problem: with what was found to be uncertain besides what the study says.  probabilities: of each effect
    added; gaps_without: the gap if it alone is taken away.  late: the time that was given was over before
    all was looked at.  unnamed: what that which has no name leaves open of parameters, by name
    (`identify.discovery.unnamed`).
    """

    problem: Problem
    first: Trial
    final: Trial
    added: tuple[Option, ...]
    steps: tuple[Step, ...]
    places: tuple[list[PlaceFit], ...] = ()
    probabilities: tuple[float, ...] = ()
    gaps_without: tuple[float, ...] = ()
    late: bool = False
    unnamed: Mapping[str, float] = field(default_factory=dict)

    @property
    def kept(self) -> tuple[bool, ...]:
        """For each step whether its best option is in the final model."""
        effects = self.final.task.effects
        return tuple(step.best is not None and step.best.effect in effects for step in self.steps)


def discover(problem: Problem, workers: Workers, story: Story | None = None) -> Discovery:
    """Find what is missing from the model of a problem.

    Raises InputError where a measurement to be fitted has no FRFs or their noise is not known.
    """
    check_data(problem)
    story, problem = story or Story(), timed(problem)
    workers.turn_to(problem)
    first = present_model(problem, workers)
    story.say(f"The present model: {standing(first)}.")
    state = State(problem, first)
    for stage in (by_amplitude, at_once, in_other_forms, by_amplitude):
        state = stage(workers, state, story)
    state, places = by_law(workers, state, story)
    state = ranked(_confirmed(workers, state, story))
    story.say(f"The final model: {standing(state.model)}.")
    steps = _path(workers, first, state, FEW_STEPS if story.late else Task.steps)
    looked = [*([] for _ in steps), places] if places else [[] for _ in steps]
    if places:
        criterion = EvidenceCriterion(variance_inflation(state.problem, state.model))
        steps = [*steps, Step(state.model, (), (), (), criterion)]
    added = tuple(step.found[0] for step in steps if step.found)
    odds = tuple(one.probability for one in state.added)
    without = tuple(one.gap_without for one in state.added)
    late, unnamed = story.late, left_open(workers, state)
    return Discovery(
        state.problem, first, state.model, added, tuple(steps), tuple(looked), odds, without, late, unnamed
    )


def standing(model: Trial) -> str:
    """The gap on fitted and on other data."""
    elsewhere = f", {model.gap_validation:.2f} on data not fitted" if model.count_validation else ""
    return f"gap {model.gap:.2f}{elsewhere}"


def _confirmed(workers: Workers, state: State, story: Story) -> State:
    """Without what a refit on all lines, and data that are not fitted, do not support; with their odds where
    those from the curvature on few lines are small, which are near the truth where they are large.

    The least supported first, until one of large odds holds; all of them where one depends on amplitude,
    which the others may have compensated for before it was found.  What the end of a link that bends may do
    as well is no bearing.
    """
    every = any(one.effect.of_amplitude for one in state.added)
    most = _over_ends(state)
    told = (replace(one, evidence=min(one.evidence, most(one.effect))) for one in state.added)
    state = replace(state, added=tuple(told))
    for one in sorted(state.added, key=lambda one: one.evidence):
        if len(state.added) == 1 or story.late:
            break
        values = state.model.values
        [model] = workers.run([Task(state.without(one.effect), (), values, whole=True)], "confirmation")
        odds = min(-likelier(state, model), most(one.effect))
        if odds < CONVINCING:
            story.say(f"Not confirmed: {one.effect.sentence()}.")
            state = State(state.problem, model, tuple(other for other in state.added if other != one))
            most = _over_ends(state)  # of another model
        elif one.evidence < CONVINCING:
            told = (replace(one, evidence=odds) if other == one else other for other in state.added)
            state = replace(state, added=tuple(told))
        elif not every:
            break
    return state


def _over_ends(state: State) -> Callable[[Effect], float]:
    """Log odds at most of an effect of the state over what ends of links that bend may do."""
    model = with_effects(state.problem, state.effects, state.model.values)
    return partial(odds_over_ends, model, model.initial)


def _path(workers: Workers, first: Trial, state: State, most: int) -> list[Step]:
    """As if the effects had been added one by one, the most important first, each refitted beside those
    before it.
    """
    if not state.added:
        return []
    known, final = first.task.effects, state.model
    effects = [one.effect for one in state.added]
    whole = len(effects) <= _FOLLOWED
    steps = most if whole else FEW_STEPS  # of the many, the picture shows how the gap falls
    tasks = [Task(known, tuple(effects[:n]), final.values, whole, steps) for n in range(1, len(effects))]
    models = [*workers.run(tasks, "the path"), final]
    criterion = EvidenceCriterion(variance_inflation(state.problem, final))
    found, before = list[Step](), first
    for one, model in zip(state.added, models, strict=True):
        # Models of few lines and of all have no odds over each other: these are those of the fits.
        gain = replace(criterion.gain(before, model), log_odds=one.evidence)
        option = Option(one.effect, model, max(model.free - before.free, 0), gain)
        odds = [(rival, replace(gain, log_odds=one.evidence + rival.log_odds)) for rival in one.rivals]
        rivals = tuple(Option(rival.effect, rival.model, option.size, own) for rival, own in odds)
        found.append(Step(before, (option, *rivals), (option,), rivals, criterion))
        before = model
    return found


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
        raise InputError(where, "a modal table", "FRFs, whose noise is needed to weigh evidence", fix)


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
        f"the search uses the cost {likelihood.kind}, the likelihood of FRFs, in place of the study's"
        f" {cost.kind}{' with options' * (cost.kind == likelihood.kind)}, because evidence needs a likelihood"
    )
    return file.model_copy(update={"study": changed}), note
