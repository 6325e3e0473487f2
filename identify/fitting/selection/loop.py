"""The loop: say where the model stands, try what could be missing, add what explains it, look again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from identify.fitting.selection.prune import exchange, prune, still_there
from identify.fitting.selection.turn import turn
from identify.fitting.selection.workbench import Named, Option, Step, Story, Workbench

E = TypeVar("E", bound=Named)
M = TypeVar("M")


@dataclass(frozen=True)
class Selection(Generic[E, M]):
    """How it went: the model at the start and at the end, and what was added, as it was found."""

    first: M
    final: M
    options: tuple[Option[E, M], ...]


def select(bench: Workbench[E, M], story: Story | None = None) -> Selection[E, M]:
    """Add effects to the model of a workbench as its policy asks, until nothing more is supported.

    Steps of the story that are there already count as earlier turns of the same selection.  What was dropped
    once may be right later, but not for ever, or two effects could take turns.
    """
    story, each = story or Story(), bench.policy.prune_each
    first = bench.begin()
    story.say(f"The present model: {bench.standing(first)}.")
    if each:
        first, _ = prune(bench, first, story)
    model, options, banned = first, list[Option[E, M]](), list[E]()
    while not story.late:
        step = turn(bench, model, story, banned)
        story.steps.append(step)
        if step.best is None:
            story.say("No candidate is supported by the data.")
            break
        model, options = bench.settled(step.found[-1].model), [*options, *step.found]
        names = " and ".join(option.effect.sentence() for option in step.found)
        story.say(f"{names}: {bench.standing(model)}.")
        if each:
            model, dropped = prune(bench, model, story)
            options = still_there(bench, options, model)
            found = [option.effect for option in found_in(story.steps)]
            banned += [effect for effect in dropped if found.count(effect) > 1]
    if not each:
        model, _ = prune(bench, model, story)
        options = still_there(bench, options, model)
    options, model = exchange(bench, options, model, story)
    return Selection(first, model, tuple(options))


def found_in(steps: Sequence[Step[E, M]]) -> list[Option[E, M]]:
    """Everything that steps found, in order."""
    return [option for step in steps for option in step.found]
