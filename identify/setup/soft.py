"""The physical rival of every mistake of the set-up: the same study where every bearing, the base and the
links give way.

What only looks like a mistake of the set-up, such as a bearing that tilts, such a model explains as it is; a
true mistake it does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import QUIET
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.setup.score import ROUGH, Score, scored
from identify.setup.within import within
from identify.vibration.all_springs import all_springs, usual_stiffness
from identify.vibration.nuisances.settings import UncertaintySettings
from identify.vibration.problem import Problem, with_effects, with_given

LINES = 10
"""Of each measurement, every other one or so: a dense model takes its time."""
_STEPS = GaussNewton(evaluations=20, tolerance=5e-3)


def softened(score: Score) -> Score:
    """A variant with every spring free, fitted from what was found without; of fewer lines; made once."""
    return score.once("softened", lambda: _softened(score))


def springs_explain(score: Score, uncertain: UncertaintySettings | None) -> bool:
    """Whether every spring that may be missing explains all that a variant leaves, down to the noise: then
    nothing is left that only a mistake would explain.
    """
    soft = softened(score)
    return soft.cost <= ROUGH and within(soft, uncertain, QUIET).explained


def with_springs(problem: Problem, values: Mapping[str, float]) -> Problem:
    """A problem with every spring free; parameters named in `values` start there."""
    effects = [*problem.file.study.effects, *all_springs(problem, shrink=False)]
    return with_effects(problem, effects, values)


def read_otherwise(problem: Problem, known: Score) -> Problem | None:
    """A problem with every spring free as in a known one, of which it only reads the channels otherwise; None
    where it is of another robot, other points or postures.
    """
    pairs = list(zip(problem.measurements, known.problem.measurements, strict=False))
    own, effects = problem.file.study.effects, known.problem.file.study.effects
    same = (
        problem.robot is known.problem.robot
        and all(point is known.problem.points.get(node) for node, point in problem.points.items())
        and len(effects) > len(own)
        and effects[: len(own)] == own
        and all(one.given.posture.tobytes() == other.given.posture.tobytes() for one, other in pairs)
    )
    return with_given(known.problem, [m.given for m in problem.measurements]) if same else None


def _softened(score: Score) -> Score:
    small = _smaller(score.problem)
    rigid = scored(small, score.values)
    if score.cost <= ROUGH:
        return rigid  # it explains the data as it is, up to a factor
    model = with_springs(small, score.by_name)
    free = scored(model, _usual(model, score.by_name), _STEPS)
    return min(free, rigid, key=lambda one: one.cost)  # rigid is the limit of free, which steps may not reach


def _smaller(problem: Problem) -> Problem:
    """The same at few lines."""
    some = [m.given for m in problem.measurements]
    return with_given(
        problem,
        [replace(one, data=one.data.evenly(LINES)) for one in some],  # type: ignore[union-attr]
    )


def _usual(model: Problem, values: dict[str, float]) -> Array:
    """Start values (parameters,): what was found, and bearings as stiff as they usually are."""
    usual = model.initial
    if not any(name.endswith(".rz.stiffness") for name in values):
        return usual
    for n, parameter in enumerate(model.parameters):
        body, axis, *what = parameter.name.split(".")
        if parameter.name not in values and what == ["stiffness"]:
            usual[n] = np.clip(usual_stiffness(body, axis, values), parameter.lower, parameter.upper)
    return usual
