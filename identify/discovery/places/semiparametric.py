"""The semi-parametric fit of one place: one unknown per line for all sets, which are eliminated line by line
(variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10-2, 1973), and Gauss-Newton steps on the known
parameters alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.parameters import Scale
from identify.discovery.places.predict import PlaceModel, Predicted, Unknown

_RANK = 1e-12
"""Share of the largest eigenvalue, of columns of one length, below which a combination of unknowns of a line
is not determined."""
COMMON = 5.0
"""Squares that an unknown takes out of noise alone, where the noise of a force is in all responses: the least
variance inflation that has been seen."""
_SURE = 1e3
"""How many times better than that combinations must be known at least for a plain inverse."""
_LEAST = 1e-8
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
        return self._fall_to(self.squares)

    @property
    def fall_foreseen(self) -> float:
        """The same after one more linear step of everything, if all were linear."""
        return self._fall_to(max(self.squares - self.normal.promised, 0.0))

    def _fall_to(self, squares: float) -> float:
        return self.gap_before - float(np.sqrt((squares + COMMON * self.unknowns) / max(self.count, 1)))

    @property
    def gap(self) -> float:
        """RMS residual over noise by what is left to explain it."""
        return float(np.sqrt(self.squares / max(self.count - self.unknowns, 1)))


@dataclass(frozen=True)
class Normal:
    """Normal equations with the unknowns of each line (l, m) still in them: their Gram matrix (l, m, m) and
    its inverse, coupling (l, m, p), gradient (l, m); information (p, p) and gradient (p,) of the parameters
    without the unknowns; taken: squares that a linear step of the unknowns takes away; determined: how many
    unknowns the data determine.
    """

    gram: Complex
    inverse: Complex
    coupling: Complex
    slope: Complex
    information: Array
    gradient: Array
    taken: float
    determined: int

    @property
    def promised(self) -> float:
        """Squares that a linear step of everything takes away."""
        size = np.diag(self.information)
        matrix = self.information + np.diag(_LEAST * size + 1e-12 * size.max(initial=1.0))
        return self.taken + float(self.gradient @ np.linalg.solve(matrix, self.gradient))


def normal_equations(parts: Sequence[Predicted], lines: Sequence[Index], count: int) -> Normal:
    """Of all sets, whose lines have the given numbers among `count` shared ones."""
    m, p = parts[0].by_unknown.shape[-1], parts[0].by_parameter.shape[-1]
    gram = np.zeros((count, m, m), dtype=complex)
    both = np.zeros((count, m, p + 1), dtype=complex)
    information = np.zeros((p + 1, p + 1))
    for part, numbers in zip(parts, lines, strict=True):
        rows = len(part.residual)
        unknown = part.by_unknown.reshape(rows, -1, m)
        right = np.concatenate([part.by_parameter, part.residual[..., None]], axis=3).reshape(rows, -1, p + 1)
        turned = np.conj(np.swapaxes(unknown, 1, 2))
        gram[numbers] += turned @ unknown  # a set has each line once
        both[numbers] += turned @ right
        flat = right.reshape(-1, p + 1)
        information += (np.conj(flat).T @ flat).real
    inverse, determined = _inverse(gram)
    through = (inverse @ both).reshape(-1, p + 1)
    taken = (np.conj(both.reshape(-1, p + 1)).T @ through).real
    left = information - taken
    return Normal(
        gram, inverse, both[..., :p], both[..., p], left[:p, :p], left[:p, p], float(taken[p, p]), determined
    )


def _inverse(gram: Complex) -> tuple[Complex, int]:
    """Inverses (l, m, m) of Gram matrices over what they determine, and how many unknowns that is."""
    size = np.sqrt(np.einsum("lmm->lm", gram).real)
    size = np.where(size > 0, size, 1.0)
    scaled = gram / (size[:, :, None] * size[:, None, :])
    try:
        inverse = np.linalg.inv(scaled)
        poor = ~(_norm(scaled) * _norm(inverse) < 1 / (_SURE * _RANK))
    except np.linalg.LinAlgError:
        inverse, poor = np.zeros_like(scaled), np.ones(len(scaled), dtype=bool)
    count = (len(scaled) - int(poor.sum())) * scaled.shape[1]
    if poor.any():
        inverse[poor], few = _determined(scaled[poor])
        count += few
    return np.asarray(inverse / (size[:, :, None] * size[:, None, :])), count


def _norm(matrix: Complex) -> Array:
    return np.asarray(np.sqrt(np.einsum("lmn,lmn->l", matrix, matrix.conj()).real))


def _determined(gram: Complex) -> tuple[Complex, int]:
    """The same by eigenvalues, where some combinations are not determined."""
    values, vectors = np.linalg.eigh(gram)
    kept = values > _RANK * values.max(axis=1, keepdims=True, initial=1e-300)
    scaled = vectors * np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)[:, None, :]
    return np.asarray(scaled @ np.conj(np.swapaxes(vectors, 1, 2))), int(kept.sum())


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
        normal = normal_equations(_scaled(parts, scale.slope(x)), lines, count)
        if normal.promised < _FELL * squares:
            break
        step, change = _step(normal, damping)
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
        x, values, damping = trial, new, max(damping / 10, _LEAST)
        unknown, rests, squares = moved, ends, tried
        parts = model.predict(unknown, values, free, rests)
        if fell < _FELL:
            break
    normal = normal_equations(_scaled(parts, scale.slope(x)), lines, count)
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
        change = -(normal.inverse @ normal.slope[..., None])[..., 0]
        moved = Unknown(unknown.values + change, unknown.reference)
        tried = model.squares(moved, values, rests)
        if not tried < squares:
            break
        unknown, squares = model.refreshed(moved, values), tried
    return unknown


def _step(normal: Normal, damping: float) -> tuple[Array, Complex]:
    """Change of the parameters on the search scale and of the unknowns."""
    size = np.diag(normal.information)
    matrix = normal.information + np.diag(damping * size + 1e-12 * size.max(initial=1.0))
    step = -np.linalg.solve(matrix, normal.gradient)
    pull = normal.slope + normal.coupling @ np.clip(step, -1, 1)
    change = -(normal.inverse @ pull[..., None])[..., 0]
    return np.asarray(step), np.asarray(change)


def _scaled(parts: Sequence[Predicted], slope: Array) -> list[Predicted]:
    return [replace(part, by_parameter=part.by_parameter * slope) for part in parts]
