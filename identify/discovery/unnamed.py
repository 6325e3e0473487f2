"""What gives way without evidence: no bearing, base, mount or link is rigid, and what one that is taken to be
so gives way is found in the drives that it is in series with.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.discovery.decimated import decimated
from identify.discovery.sparse.fit import STEPS
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.unknowns import Unknowns
from identify.discovery.state import State
from identify.discovery.task import FEW_STEPS, Task
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.vibration.all_springs import usual_springs
from identify.vibration.problem import with_effects


def beside_unnamed(workers: Workers, state: State, story: Story) -> State:
    """The state beside all that may give way unnoticed: what was found keeps its names, and its values are
    no longer those of an arm that is rigid elsewhere.
    """
    if not state.added or any(one.of_amplitude for one in state.effects):
        return state
    values = state.model.values
    new = usual_springs(with_effects(state.problem, state.effects, values), values)
    if not new:
        return state
    values = workers.recall(
        [
            "unnamed",
            [one.model_dump(mode="json") for one in (*state.effects, *new)],
            dict(state.model.values),
        ],
        lambda: _on_few_lines(state, new, story),
        "what may give way unnoticed",
    )
    task = Task(state.effects, new, values, whole=True, steps=FEW_STEPS)
    [model] = workers.run([task], "what may give way unnoticed")
    return State(state.problem, model, state.added)


def _on_few_lines(state: State, new: Sequence[Effect], story: Story) -> dict[str, float]:
    """Values by name where the fit ends that begins with rigid ones."""
    every = (*state.effects, *new)
    problem = with_effects(decimated(state.problem), every, state.model.values)
    unknowns = Unknowns(problem, len(every))
    start = unknowns.to_x(problem.initial)
    start = np.where(np.isin(unknowns.names, list(state.model.values)), start, unknowns.reference)
    last = Penalised(unknowns, price=0.0).minimise(Point(start), STEPS, story.until)
    return {**state.model.values, **unknowns.by_name(last.x)}
