"""What no effect of the catalogue explains: which place would explain it, whatever acts there, and a dynamic
stiffness of simple form at the best of them.
"""

from __future__ import annotations

from identify.discovery.decimated import without_amplitude
from identify.discovery.evidence import closed, removed
from identify.discovery.places.job import Known
from identify.discovery.places.look import look, unknown_laws
from identify.discovery.places.screen import PlaceFit
from identify.discovery.state import Added, State, convincing
from identify.discovery.task import Task
from identify.discovery.workers import Workers
from identify.fitting.selection.workbench import Story

_MOSTLY, _WHOLE = 0.5, 1
"""Share of what is above noise that a law must explain: any law compensates for some of what is missing
elsewhere.
"""


def by_law(workers: Workers, state: State, story: Story) -> tuple[State, list[PlaceFit]]:
    """The state, with a law at the place that explains most, if that is most of what is open; and the places
    beside the model it was looked at with, best first.
    """
    if closed(state.model) or story.late:
        return state, []
    known = Known(state.effects, state.model.values)
    problem = without_amplitude(state.problem, known.effects, known.values)
    places = look(workers, problem, known)
    laws = unknown_laws(workers, known, places)
    quick = workers.run(
        [Task(state.effects, (law,), {**state.model.values, **values}) for law, values in laws]
    )
    found = convincing(workers, state, sorted(quick, key=lambda one: one.squares), _WHOLE)
    if found is None or removed(state.model.gap, found[0].gap) < _MOSTLY:
        return state, places
    model, gain = found
    story.say(f"With {model.task.new[0].sentence()}: gap {model.gap:.2f}.")
    return State(state.problem, model, (*state.added, Added(model.task.new[0], gain))), places
