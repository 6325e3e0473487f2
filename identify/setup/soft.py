"""The physical rival of every mistake of the set-up: the same study where every bearing, the base and the
links give way.

What only looks like a mistake of the set-up, such as a bearing that tilts, such a model explains as it is; a
true mistake it does not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.setup.score import ROUGH, Score, scored
from identify.vibration.all_springs import all_springs
from identify.vibration.problem import Problem, with_effects, with_given

_LINES, _SETS = 10, 2
_STIFFER, _ARM = 10.0, 0.15
"""A bearing is about ten times as stiff as its drive, in rotation, and on a lever of 0.15 m."""
_STEPS = GaussNewton(evaluations=20, tolerance=5e-3)


def softened(score: Score) -> Score:
    """A variant with every spring free, fitted from what was found without; of fewer lines."""
    values = {p.name: float(v) for p, v in zip(score.problem.parameters, score.values, strict=True)}
    small = _smaller(score.problem)
    rigid = scored(small, score.values)
    if score.cost <= ROUGH:
        return rigid  # it explains the data as it is, up to a factor
    effects = [*small.file.study.effects, *all_springs(small, shrink=False)]
    model = with_effects(small, effects, values)
    free = scored(model, _usual(model, values), _STEPS)
    return min(free, rigid, key=lambda one: one.cost)  # rigid is the limit of free, which steps may not reach


def _smaller(problem: Problem) -> Problem:
    """The first measurements at every other line or so: a dense model takes its time."""
    given = []
    for m in problem.measurements[:_SETS]:
        data = m.given.data
        some = np.unique(np.linspace(0, len(data.frequency_hz) - 1, _LINES).astype(int))
        keep = np.isin(np.arange(len(data.frequency_hz)), some)
        given.append(replace(m.given, data=data.lines(keep)))  # type: ignore[union-attr]
    return with_given(problem, given)


def _usual(model: Problem, values: dict[str, float]) -> Array:
    """Start values (parameters,): what was found, and bearings as stiff as they usually are."""
    drives = [value for name, value in values.items() if name.endswith("rz.stiffness")]
    usual = model.initial
    for n, parameter in enumerate(model.parameters):
        body, axis, *what = parameter.name.split(".")
        if parameter.name in values or what != ["stiffness"] or not drives:
            continue
        drive = values.get(f"{body}.rz.stiffness", max(drives) if body == "base" else min(drives))
        stiffness = _STIFFER * drive / (_ARM**2 if axis.startswith("t") else 1.0)
        usual[n] = np.clip(stiffness, parameter.lower, parameter.upper)
    return usual
