"""The normal equations of a place: the unknowns of every line are eliminated line by line, the known
parameters are left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.discovery.places.predict import Predicted

_RANK = 1e-12
"""Share of the largest eigenvalue, of columns of one length, below which a combination of unknowns of a line
is not determined."""
_SURE = 1e3
"""How many times better than that combinations must be known at least for a plain inverse."""
LEAST = 1e-8
"""Least damping of a step."""


class Linearised(Protocol):
    """Residuals (lines, ...) and their derivatives by the unknowns of their line (lines, ..., m) and by the
    known parameters (lines, ..., p).
    """

    @property
    def residual(self) -> Complex:
        """Over noise."""

    @property
    def by_unknown(self) -> Complex:
        """Likewise."""

    @property
    def by_parameter(self) -> Complex:
        """Likewise."""


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
        return self.taken + float(self.gradient @ np.linalg.solve(self.damped(LEAST), self.gradient))

    def damped(self, damping: float) -> Array:
        """The information, so much more on its diagonal."""
        size = np.diag(self.information)
        return np.asarray(self.information + np.diag(damping * size + 1e-12 * size.max(initial=1.0)))

    def change(self, step: Array) -> Complex:
        """(l, m): of the unknowns, to their least squares after a step (p,) of the parameters."""
        pull = self.slope + self.coupling @ step
        return np.asarray(-(self.inverse @ pull[..., None])[..., 0])


@dataclass(frozen=True)
class Sums:
    """Products of the derivatives and the residual: gram (l, m, m) and both (l, m, p + 1) line by line,
    whole (p + 1, p + 1) over everything, the residual last.
    """

    gram: Complex
    both: Complex
    whole: Array

    def without(self, other: Linearised, numbers: Index) -> Sums:
        """What is left when a part of the data at these lines is left out."""
        own = _products(other)
        gram, both = self.gram.copy(), self.both.copy()
        gram[numbers] -= own.gram
        both[numbers] -= own.both
        return Sums(gram, both, self.whole - own.whole)

    def normal(self) -> Normal:
        """Without the unknowns."""
        p = self.both.shape[-1] - 1
        inverse, determined = _inverse(self.gram)
        through = (inverse @ self.both).reshape(-1, p + 1)
        taken = (np.conj(self.both.reshape(-1, p + 1)).T @ through).real
        left, both = self.whole - taken, self.both
        return Normal(
            self.gram,
            inverse,
            both[..., :p],
            both[..., p],
            left[:p, :p],
            left[:p, p],
            float(taken[p, p]),
            determined,
        )


def _products(part: Linearised) -> Sums:
    """Of one part, by its own lines."""
    rows, m, p = len(part.residual), part.by_unknown.shape[-1], part.by_parameter.shape[-1]
    unknown = part.by_unknown.reshape(rows, -1, m)
    right = np.concatenate([part.by_parameter, part.residual[..., None]], axis=-1).reshape(rows, -1, p + 1)
    turned = np.conj(np.swapaxes(unknown, 1, 2))
    flat = right.reshape(-1, p + 1)
    return Sums(turned @ unknown, turned @ right, np.asarray((np.conj(flat).T @ flat).real))


def sums(parts: Sequence[Linearised], lines: Sequence[Index], count: int) -> Sums:
    """Over parts of the data, whose lines have the given numbers among `count` shared ones, each once."""
    m, p = parts[0].by_unknown.shape[-1], parts[0].by_parameter.shape[-1]
    gram = np.zeros((count, m, m), dtype=complex)
    both = np.zeros((count, m, p + 1), dtype=complex)
    whole = np.zeros((p + 1, p + 1))
    for part, numbers in zip(parts, lines, strict=True):
        own = _products(part)
        gram[numbers] += own.gram
        both[numbers] += own.both
        whole += own.whole
    return Sums(gram, both, whole)


def normal_equations(parts: Sequence[Linearised], lines: Sequence[Index], count: int) -> Normal:
    """Of all parts of the data (`sums`)."""
    return sums(parts, lines, count).normal()


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


def step_of(normal: Normal, damping: float) -> tuple[Array, Complex]:
    """Change of the parameters on the search scale and of the unknowns."""
    step = -np.linalg.solve(normal.damped(damping), normal.gradient)
    return np.asarray(step), normal.change(np.clip(step, -1, 1))


def scaled(parts: Sequence[Predicted], slope: Array) -> list[Predicted]:
    """With derivatives by the parameters on the search scale, of which slope (p,) is the derivative."""
    return [replace(part, by_parameter=part.by_parameter * slope) for part in parts]
