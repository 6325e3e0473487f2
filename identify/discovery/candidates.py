"""What could be missing: every effect of the catalogue at every place where it can sit and that the model
does not have yet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from identify.core.plugin import PluginError, note_broken
from identify.core.thresholds import QUIET
from identify.discovery.amplitude import level_gap, torque_gaps
from identify.model.effects.base import EFFECTS, Effect
from identify.vibration.problem import Problem

_NEAREST = 2
"""Coordinates at which effects that depend on amplitude are tried: those where a torque would explain most.
"""


def candidates(problem: Problem, known: Sequence[Effect]) -> list[Effect]:
    """All of them; of a group of axes those that nothing in `known` releases."""
    taken = {name for effect in known for name in effect.free_coordinates(problem.robot)}
    found, levels = [], level_gap(problem) > QUIET
    for kind in EFFECTS.usable().values():
        if kind.last_resort or (kind.needs_levels and not levels):
            continue
        try:
            rest = [_beyond(one, problem, taken) for one in kind.instances(problem.robot, problem.points)]
        except PluginError as error:
            note_broken(error)
            continue
        found += [effect for effect in rest if effect is not None and effect not in known]
    return found


def plausible(problem: Problem, values: Mapping[str, float], found: Sequence[Effect]) -> list[Effect]:
    """Of what depends on amplitude, and takes long to try, only what acts where a torque could explain most;
    all else.

    problem has the present model, and values are its parameters.
    """
    simulated = [effect for effect in found if effect.of_amplitude]
    if not simulated:
        return list(found)
    gaps = torque_gaps(problem.targets().frf, problem.at(values))
    places = sorted(
        {tuple(effect.coordinates(problem.robot)) for effect in simulated},
        key=lambda names: min(gaps.get(n, np.inf) for n in names),
    )
    return [
        e for e in found if not e.of_amplitude or tuple(e.coordinates(problem.robot)) in places[:_NEAREST]
    ]


def _beyond(effect: Effect, problem: Problem, taken: set[str]) -> Effect | None:
    """The effect without the axes that are released already; None where nothing is left of it."""
    released = effect.free_coordinates(problem.robot)
    free = [name not in taken for name in released]
    if all(free):
        return effect
    axes: Any = getattr(effect, "axes", None)
    if not any(free) or axes is None or len(axes) != len(free):
        return None
    return effect.model_copy(update={"axes": [axis for axis, own in zip(axes, free, strict=True) if own]})
