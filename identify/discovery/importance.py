"""How much each effect that was found matters."""

from __future__ import annotations

from dataclasses import replace

from identify.core.thresholds import CLOSED
from identify.discovery.decimated import decimated
from identify.discovery.state import Added, State
from identify.vibration.problem import with_effects
from identify.vibration.uncertainty import gap


def ranked(state: State) -> State:
    """The state's effects, those first without which the gap is largest, all else staying as it is: what
    could stand in for an effect says how sure it is, not how much it matters.

    Where a gap stays, the gap is that on data that are not fitted, if there are any.
    """
    model, elsewhere = state.model, state.model.gap >= CLOSED and state.problem.validated
    problem, use = (state.problem, "validate") if elsewhere else (decimated(state.problem), "fit")

    def without(one: Added) -> Added:
        rest = with_effects(problem, state.without(one.effect), model.values)
        return replace(one, gap_without=gap(rest.targets(use), rest.initial))

    order = sorted(map(without, state.added), key=lambda one: -one.gap_without)
    return replace(state, added=tuple(order))
