"""How well a variant of a study can explain the data, quickly: a few steps on logarithmic residuals, up to a
common factor of all FRFs, from the best of several scales of all stiffnesses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.fitting.optimizers.base import Search, minimized
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.vibration.log_shape import LogShape
from identify.vibration.problem import Problem
from identify.vibration.scales import SLOPES, scaled_drives

ROUGH = 1.0
"""RMS of logarithms, in tenths, up to which a set-up is right."""
SLIGHT = np.log(1.25)
"""Logarithm of a common factor that calibrations may have."""
_QUICK = GaussNewton(evaluations=14, tolerance=2e-3)
_TOWARDS = 6
"""Evaluations on magnitudes alone, whose valley is wider still."""

Found = TypeVar("Found")


@dataclass(frozen=True, eq=False)
class Score:
    """A variant that was fitted quickly: values (parameters,), RMS of logarithms in tenths, and the logarithm
    of the factor that the measured FRFs have; asked: what was found of it.
    """

    problem: Problem
    values: Array
    cost: float
    level: float
    asked: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def by_name(self) -> dict[str, float]:
        """Its values by parameter."""
        names = (parameter.name for parameter in self.problem.parameters)
        return dict(zip(names, map(float, self.values), strict=True))

    def once(self, name: str, find: Callable[[], Found]) -> Found:
        """What was found of it under a name, or is found now."""
        if name not in self.asked:
            self.asked[name] = find()
        found: Found = self.asked[name]
        return found

    def residuals(self, *, levelled: bool) -> list[Complex]:
        """(lines, pairs) of each set, in tenths of a logarithm; levelled: beside the common factor."""
        return LogShape(self.problem).left(self.values, self.level if levelled else 0.0)

    def squares(self, *, levelled: bool) -> list[Array]:
        """Their squares by FRF (pairs,) of each set."""
        return [np.sum(np.abs(one) ** 2, axis=0) for one in self.residuals(levelled=levelled)]


def scored(
    problem: Problem,
    start: Array | None = None,
    optimizer: GaussNewton = _QUICK,
    shape: LogShape | None = None,
    slopes: Sequence[float] = SLOPES,
    most: float = np.inf,
) -> Score:
    """A variant, fitted from the best scale of its start values by magnitudes, or from `start` (parameters,)
    if that is better; shape: of the problem, where it is there already; slopes: of scales along the arm, none
    where it begins at `start` in any case; most: cost above which it is given up where steps as large as the
    last would not reach it.
    """
    scale, shape = Scale(problem.parameters), shape or LogShape(problem)
    given = [] if start is None else [scale.to_x(start)]
    scaled = [scale.to_x(values) for values in scaled_drives(problem, slopes)]
    starts, best = np.clip([*given, *scaled], *scale.bounds()), 0
    if scaled:
        magnitudes = shape.of_magnitudes()
        costs = magnitudes.of_first().costs(scale.to_values(starts))
        best = int(np.argmin(costs))
        if start is None or costs[0] > costs[best]:
            towards = GaussNewton(evaluations=_TOWARDS, tolerance=2e-3)
            starts[best] = _led(magnitudes, scale, starts[best], towards)
    values = scale.to_values(_led(shape, scale, starts[best], optimizer, most))
    return Score(problem, values, float(shape.costs(values[None])[0]), shape.level(values))


def _led(objective: LogShape, scale: Scale, x: Array, optimizer: GaussNewton, most: float = np.inf) -> Array:
    search = Search(objective, scale, 10 * optimizer.evaluations, rival=most)
    minimized(optimizer, search, x, np.random.default_rng(0))
    return x if search.best_x is None else search.best_x
