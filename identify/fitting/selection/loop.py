"""The loop: say where the model stands, try what could be missing, add what explains it, look again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from identify.fitting.selection.policy import Policy
from identify.fitting.selection.prune import exchange, prune, still_there
from identify.fitting.selection.turn import as_options, ranked, turn
from identify.fitting.selection.workbench import Criterion, Named, Option, Step, Story, Workbench

E = TypeVar("E", bound=Named)
M = TypeVar("M")


@dataclass(frozen=True)
class Selection(Generic[E, M]):
    """How it went: the model at the start and at the end, and what was added, as it was found."""

    first: M
    final: M
    options: tuple[Option[E, M], ...]


@dataclass
class _State(Generic[E, M]):
    """Where the loop stands: the model under way with what was added to it, and the last one settled on."""

    present: M
    settled: M
    options: list[Option[E, M]] = field(default_factory=list)
    kept: list[Option[E, M]] = field(default_factory=list)


def select(bench: Workbench[E, M], story: Story | None = None) -> Selection[E, M]:
    """Add effects to the model of a workbench as its policy asks, until nothing more is supported.

    Steps of the story that are there already count as earlier turns of the same selection.
    """
    story, policy = story or Story(), bench.policy
    first = bench.begin()
    story.say(f"The present model: {bench.standing(first)}.")
    if policy.prune_each:
        first, _ = prune(bench, first, story)
    state: _State[E, M] = _State(first, first)
    patience, banned = policy.patience, list[E]()
    while len(state.options) < policy.most and not story.late:
        step = turn(bench, state.present, story, banned)
        story.steps.append(step)
        if step.best is None:
            story.say("No candidate is supported by the data.")
            break
        _follow(bench, state, step, story)
        if _settles(policy, step.criterion, state):
            banned += _settle(bench, first, state, story)
            patience = policy.patience
        elif (patience == 0 and not _promised(policy, step)) or _hopeless(bench, first, state.settled, step):
            break
        else:
            patience = max(patience - 1, 0)
    options, final = state.kept, state.settled
    if not policy.prune_each:
        final, _ = prune(bench, final, story)
        options = still_there(bench, options, final)
    options, final = exchange(bench, options, final, story)
    return Selection(first, final, tuple(options))


def _follow(bench: Workbench[E, M], state: _State[E, M], step: Step[E, M], story: Story) -> None:
    """Take what a step found into the model under way."""
    state.present = bench.settled(step.found[-1].model)
    state.options = [*state.options, *step.found]
    names = " and ".join(option.effect.sentence() for option in step.found)
    story.say(f"{names}: {bench.standing(state.present)}.")


def _settles(policy: Policy, criterion: Criterion[M], state: _State[E, M]) -> bool:
    """Whether the model under way is not only better than the last one settled on but explains enough."""
    rule = policy.settle if len(state.options) == len(state.kept) + 1 else policy.settle_several
    return rule is None or rule.holds(criterion.gain(state.settled, state.present))


def _settle(bench: Workbench[E, M], first: M, state: _State[E, M], story: Story) -> list[E]:
    """Settle on the model under way, once variants were tried and effects pruned; what is banned from now on.

    What was dropped once may be right later, but not for ever, or two effects could take turns.
    """
    _try_variants(bench, first, state, story)
    banned = list[E]()
    if bench.policy.prune_each:
        state.present, dropped = prune(bench, state.present, story)
        state.options = still_there(bench, state.options, state.present)
        found = [option.effect for option in found_in(story.steps)]
        banned = [effect for effect in dropped if found.count(effect) > 1]
    state.settled, state.kept = state.present, list(state.options)
    return banned


def _try_variants(bench: Workbench[E, M], first: M, state: _State[E, M], story: Story) -> None:
    """Give one of the added effects another variant if that explains what little is left: details show once
    nothing is in their way.
    """
    final = state.present
    criterion = bench.quick_criterion(final)
    nearly = bench.policy.nearly
    if nearly > 1 or bench.at_noise(final) or criterion.gain(first, final).explained <= nearly:
        return
    options = ranked(as_options(criterion, final, bench.variants(final)))
    if not options or not bench.policy.admit.holds(options[0].gain):
        return
    best = options[0]
    story.steps.append(Step(final, tuple(options), (best,), (), criterion, best.gain.explained))
    story.say(f"{best.effect.sentence()} in place of another form of it: {bench.standing(best.model)}.")
    state.options, state.present = [*still_there(bench, state.options, best.model), best], best.model


def _hopeless(bench: Workbench[E, M], first: M, settled: M, step: Step[E, M]) -> bool:
    """Whether a step that does not settle by itself is not worth following either: of what passes as noise
    any few additions explain some.
    """
    explained = step.criterion.gain(first, settled).explained
    enough = bench.at_noise(settled) or explained > bench.policy.nearly
    return enough or step.promise < bench.policy.tentative


def _promised(policy: Policy, step: Step[E, M]) -> bool:
    """Whether what a step found explains enough together with one more, so that the next step may settle."""
    rule = policy.settle_several
    return rule is not None and step.promise >= rule.explained > step.found[-1].gain.explained


def found_in(steps: Sequence[Step[E, M]]) -> list[Option[E, M]]:
    """Everything that steps found, in order."""
    return [option for step in steps for option in step.found]
