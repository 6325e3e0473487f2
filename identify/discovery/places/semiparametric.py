"""The semi-parametric fit of one place: one unknown per line for all sets, which are eliminated line by line
(variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10-2, 1973), and Gauss-Newton steps on the known
parameters alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.discovery.places.normal import LEAST, Normal, normal_equations, scaled, step_of
from identify.discovery.places.predict import PlaceModel, Unknown

COMMON = 5.0
"""Squares that an unknown takes out of noise alone, where the noise of a force is in all responses: the least
variance inflation that has been seen."""
_FELL = 1e-3
"""Share of the squares: a step that promises or does less is the last."""
_OWN = 2
"""Steps of the unknowns alone after each step of the parameters."""
_STEPS = (1.0, 0.4, 0.1, 0.02)


@dataclass(frozen=True)
class SemiParametricFit:
    """How a place ended.

    before, squares: sum of |residual / noise|^2 where it began and where it ended; count: real numbers
    measured; unknowns: real numbers that were fitted; values (parameters,).
    """

    unknown: Unknown
    values: Array
    before: float
    squares: float
    count: int
    unknowns: int
    normal: Normal

    @property
    def gap_before(self) -> float:
        """RMS residual over noise where it began."""
        return float(np.sqrt(self.before / max(self.count, 1)))

    @property
    def fall(self) -> float:
        """Fall of the gap beyond what so many unknowns may take out of noise that is common to channels."""
        left = (self.squares + COMMON * self.unknowns) / max(self.count, 1)
        return self.gap_before - float(np.sqrt(left))

    @property
    def gap(self) -> float:
        """RMS residual over noise by what is left to explain it."""
        return float(np.sqrt(self.squares / max(self.count - self.unknowns, 1)))


def fit_place(
    model: PlaceModel, scale: Scale, values: Array, steps: int = 6, unknown: Unknown | None = None
) -> SemiParametricFit:
    """A few damped steps from parameter values, and from nothing missing if no unknown is given."""
    unknown = unknown or model.start(values)
    lines, count = [view.lines for view in model.views], len(unknown.values)
    x, free = scale.to_x(values), scale.free
    lower, upper = scale.bounds()
    rests = model.rests(unknown, values)
    parts, damping = model.predict(unknown, values, free, rests), 1e-4
    squares = before = model.squares(unknown, values, rests)
    for _ in range(steps):
        normal = normal_equations(scaled(parts, scale.slope(x)), lines, count)
        if normal.promised < _FELL * squares:
            break
        step, change = step_of(normal, damping)
        for fraction in _STEPS:
            trial = np.clip(x + fraction * np.clip(step, -1, 1), lower, upper)
            moved = Unknown(unknown.values + fraction * change, unknown.reference)
            new = scale.to_values(trial)
            moved = _settled(model, model.refreshed(moved, new), new, rests)
            # The end of the record was that of the unknown before: the fall must hold with its own.
            ends = model.rests(moved, new)
            tried = model.squares(moved, new, ends)
            if tried < squares:
                break
        else:
            damping *= 100
            if damping > 1e3:
                break
            continue
        fell = 1 - tried / squares
        x, values, damping = trial, new, max(damping / 10, LEAST)
        unknown, rests, squares = moved, ends, tried
        parts = model.predict(unknown, values, free, rests)
        if fell < _FELL:
            break
    normal = normal_equations(scaled(parts, scale.slope(x)), lines, count)
    measured = sum(2 * int(np.count_nonzero(view.weight)) for view in model.views)
    return SemiParametricFit(unknown, values, before, squares, measured, 2 * normal.determined, normal)


def _settled(model: PlaceModel, unknown: Unknown, values: Array, rests: Sequence[Complex]) -> Unknown:
    """The unknowns after Gauss-Newton steps of their own, while these go down: they are few in each line, and
    what they are to the data bends more than what the parameters are.
    """
    lines, count = [view.lines for view in model.views], len(unknown.values)
    squares = model.squares(unknown, values, rests)
    for _ in range(_OWN if np.isfinite(squares) else 0):
        parts = model.predict(unknown, values, np.zeros(0, dtype=int), rests)
        normal = normal_equations(parts, lines, count)
        moved = Unknown(unknown.values + normal.change(np.zeros(0)), unknown.reference)
        tried = model.squares(moved, values, rests)
        if not tried < squares:
            break
        unknown, squares = model.refreshed(moved, values), tried
    return unknown
