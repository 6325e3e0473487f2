"""What is taken out again: effects that others made needless, and broad ones that something simpler can
replace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from identify.fitting.selection.gain import Gain
from identify.fitting.selection.turn import turn
from identify.fitting.selection.workbench import Criterion, Named, Option, Step, Story, Workbench

E = TypeVar("E", bound=Named)
M = TypeVar("M")


def left_out(
    bench: Workbench[E, M], criterion: Criterion[M], model: M, effects: Sequence[E]
) -> list[tuple[M, Gain]]:
    """For each effect, the model without it, and what the model gains over that: what the effect is worth
    when all others stay.
    """
    return [(less, criterion.gain(less, model)) for less in bench.leave_out(model, effects)]


def prune(bench: Workbench[E, M], model: M, story: Story) -> tuple[M, list[E]]:
    """Leave out, worst first, effects that cannot be as they are and those that the data do not miss; the
    model and what was dropped.
    """
    dropped: list[E] = []
    while len(bench.added(model)) > 1:
        effects = bench.removable(model)
        without = left_out(bench, bench.quick_criterion(model), model, effects)
        loose = [n for n, effect in enumerate(effects) if bench.implausible(model, effect)] or [
            n
            for n, (_, gain) in enumerate(without)
            if not any(rule.holds(gain) for rule in bench.policy.retain)
        ]
        if not loose:
            break
        worst = min(loose, key=lambda n: without[n][1].explained)
        model = bench.settled(without[worst][0])
        dropped.append(effects[worst])
        story.say(f"{effects[worst].sentence()} is not needed any more: {bench.standing(model)}.")
    return model, dropped


def exchange(
    bench: Workbench[E, M], options: Sequence[Option[E, M]], model: M, story: Story
) -> tuple[list[Option[E, M]], M]:
    """The added effects after each that can stand for something else has been looked for anew beside the
    others.

    The first effect that was found had to explain what the later ones now do; with them, something simpler
    may take its place (sequential replacement: Miller, Subset Selection in Regression, 2002, section 3.4).
    What was replaced once does not come back, or two effects could take turns.  Rivals of one that stays are
    those beside all others.
    """
    options, number, replaced = list(options), 0, list[E]()
    while len(effects := bench.added(model)) > 1 and number < len(effects) and not story.late:
        effect, number = effects[number], number + 1
        if not bench.replaceable(model, effect):
            continue
        [without] = bench.leave_out(model, [effect])
        others = [one for one in bench.candidates(without) if not bench.can_replace(one)]
        step = turn(bench, without, story, [*replaced, *others])
        best = step.best
        if best is None or best.effect == effect or step.criterion.gain(model, best.model).log_odds <= 0:
            _rivals_at_last(story, effect, step)
            continue
        story.steps.append(step)
        found = step.found[-1].model
        story.say(f"{best.effect.sentence()} in place of {effect.sentence()}: {bench.standing(found)}.")
        options = [*(option for option in options if option.effect != effect), *step.found]
        model, _ = prune(bench, bench.settled(found), story)
        options, number = still_there(bench, options, model), 0
        replaced.append(effect)
    return options, model


def _rivals_at_last(story: Story, effect: E, last: Step[E, M]) -> None:
    """The steps that found an effect, with its rivals in the last one, where it was found once more."""
    if last.best is None or last.best.effect != effect:
        return
    for number, step in enumerate(story.steps):
        if step.best is not None and step.best.effect == effect:
            story.steps[number] = replace(step, rivals=last.rivals)


def still_there(bench: Workbench[E, M], options: Sequence[Option[E, M]], model: M) -> list[Option[E, M]]:
    """The options whose effects a model has."""
    effects = bench.added(model)
    return [option for option in options if option.effect in effects]
