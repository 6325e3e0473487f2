"""What a measured FRF matrix gains where something is missing: low-rank formulas on arrays, line by line.

For a place with d coordinates, columns V (n, d) say what the model moves when the place moves (or is pushed)
by one unit, and zeta (d, d) is what the model itself opposes there.  With A symmetric,

    A_p = A (1 + (zeta_p - zeta_0) A)^-1,   X B = X_0 B + sign V A_p V' B,   S X = S X_0 + sign S V A_p V'

at posture p, where A belongs to a reference zeta_0 that all postures share.  A constraint that gives way has
sign 1 and A = (kappa + zeta_0)^-1, something attached has sign -1 and A = (Delta^-1 + zeta_0)^-1; kappa and
Delta are the same at every posture.  A = 0 is the model as it is, and H is linear in A where zeta is alike at
all postures.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from identify.core.arrays import Array, Complex
from identify.model.frf import dynamic_stiffness


@dataclass(frozen=True)
class Base:
    """The model without what is missing, at lines (l): moved (l, n, inputs), to_out (l, outputs, n), columns
    (l, n, d) and zeta (l, d, d).
    """

    moved: Complex
    to_out: Complex
    columns: Complex
    zeta: Complex
    out: Array
    force: Array
    sign: float


def pairs_of(size: int) -> list[tuple[int, int]]:
    """The entries of a symmetric matrix (size, size) that are unknown: the upper triangle."""
    return list(combinations_with_replacement(range(size), 2))


def symmetric(entries: Complex, size: int) -> Complex:
    """(..., size, size) from its upper triangle (..., m)."""
    matrix = np.zeros((*entries.shape[:-1], size, size), dtype=entries.dtype)
    for number, (i, j) in enumerate(pairs_of(size)):
        matrix[..., i, j] = matrix[..., j, i] = entries[..., number]
    return matrix


def triangle(matrix: Complex) -> Complex:
    """(..., m): the upper triangle of symmetric matrices."""
    pairs = pairs_of(matrix.shape[-1])
    return np.asarray(matrix[..., [i for i, _ in pairs], [j for _, j in pairs]])


def released(matrices: tuple[Array, Array, Array], s: Complex, known: int, out: Array, force: Array) -> Base:
    """A constraint that gives way: coordinates beyond the first `known` of M, C, K (n, n) are the locked
    ones; out (outputs, n), force (n, inputs).
    """
    z = dynamic_stiffness(*matrices, s)
    inverse = np.linalg.inv(z[:, :known, :known])
    bound, size = -inverse @ z[:, :known, known:], z.shape[1] - known
    unit = np.broadcast_to(np.eye(size, dtype=complex), (len(s), size, size))
    zeta = z[:, known:, known:] + z[:, known:, :known] @ bound
    moved, to_out = _padded(inverse @ force[:known], size, 1), _padded(out[:, :known] @ inverse, size, 2)
    return Base(moved, to_out, np.concatenate([bound, unit], axis=1), zeta, out, force, 1.0)


def attached(
    matrices: tuple[Array, Array, Array], s: Complex, directions: Array, out: Array, force: Array
) -> Base:
    """Something attached along directions (d, n) of the model's coordinates."""
    inverse = np.linalg.inv(dynamic_stiffness(*matrices, s))
    columns = inverse @ directions.T
    zeta = directions @ columns
    return Base(inverse @ force, out @ inverse, columns, zeta, out, force, -1.0)


def _padded(array: Complex, size: int, axis: int) -> Complex:
    width = [(0, 0)] * 3
    width[axis] = (0, size)
    return np.pad(array, width)


@dataclass(frozen=True)
class Updated:
    """The model with the place: moved X B (l, n, inputs), to_out S X (l, outputs, n), slopes (l, outputs,
    inputs, m) of S X B by the entries of A.
    """

    moved: Complex
    to_out: Complex
    slopes: Complex


def updated(base: Base, a: Complex, reference: Complex) -> Updated:
    """The model with a symmetric A (l, d, d) that belongs to a reference zeta (l, d, d)."""
    size = a.shape[-1]
    turn = _inverse(np.eye(size) + (base.zeta - reference) @ a)
    at = a @ turn
    outwards, inwards = base.out @ base.columns, np.swapaxes(base.columns, 1, 2) @ base.force
    moved = base.moved + base.sign * (base.columns @ (at @ inwards))
    to_out = base.to_out + base.sign * (outwards @ at) @ np.swapaxes(base.columns, 1, 2)
    left, right = outwards @ np.swapaxes(turn, 1, 2), turn @ inwards
    rows, columns = np.triu_indices(size)
    back = np.swapaxes(right, 1, 2)
    slopes = left[:, :, None, rows] * back[:, None][..., columns]
    apart = rows != columns
    if apart.any():
        slopes[..., apart] += left[:, :, None, columns[apart]] * back[:, None][..., rows[apart]]
    return Updated(moved, to_out, np.asarray(base.sign * slopes))


def moved_by(base: Base, a: Complex, reference: Complex) -> Complex:
    """X B (l, n, inputs) of `updated` alone."""
    inwards = np.swapaxes(base.columns, 1, 2) @ base.force
    at = recharted(a, reference, base.zeta)
    return np.asarray(base.moved + base.sign * (base.columns @ (at @ inwards)))


def recharted(a: Complex, old: Complex, new: Complex) -> Complex:
    """A (l, d, d) of a reference zeta, as it is of another one; what it stands for is the same.  NaN where a
    line has a resonance without damping, at which nothing stands for it.
    """
    return np.asarray(a @ _inverse(np.eye(a.shape[-1]) + (new - old) @ a))


def _inverse(matrix: Complex) -> Complex:
    """Of matrices (l, d, d); NaN where one of them has none, so that a step there is not taken."""
    try:
        return np.asarray(np.linalg.inv(matrix))
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)


def stiffness_of(a: Complex, reference: Complex, sign: float) -> Complex:
    """The dynamic stiffness kappa or Delta (..., l, d, d) that A (..., l, d, d) stands for."""
    if sign > 0:
        singular = (np.linalg.det(a) == 0)[..., None, None]
        inverse = np.linalg.inv(np.where(singular, np.eye(a.shape[-1]), a))
        return np.where(singular, np.nan, inverse - reference)
    return np.asarray(a @ _inverse(np.eye(a.shape[-1]) - reference @ a))


def a_of(stiffness: Complex, reference: Complex, sign: float) -> Complex:
    """A (l, d, d) of a dynamic stiffness."""
    if sign > 0:
        return np.asarray(np.linalg.inv(stiffness + reference))
    return np.asarray(stiffness @ np.linalg.inv(np.eye(stiffness.shape[-1]) + reference @ stiffness))
