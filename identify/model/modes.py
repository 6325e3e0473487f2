"""Modes of a linear system: undamped and complex, with their shapes and the exact sensitivities of
eigenvalues.

Complex modes solve (lambda^2 M + lambda C + K) phi = 0; frequency |lambda|/2 pi, damping ratio -Re
lambda/|lambda|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.threads import each, threads
from identify.model.system import Factors

_WORTH_A_THREAD = 500_000
"""Cubes of the sizes of matrices, in all, whose eigenvalues take some ten times as long as to begin a thread.
"""


@dataclass(frozen=True)
class ComplexModes:
    """Oscillating modes in order of frequency: eigenvalues (m,), rad/s, Im > 0; shapes (m, n) over the
    coordinates.

    Shapes are scaled to phi' (2 lambda M + C) phi = 1.
    """

    eigenvalues: Complex
    shapes: Complex

    @property
    def frequency_hz(self) -> Array:
        """|lambda| / 2 pi, (m,)."""
        return np.asarray(np.abs(self.eigenvalues) / (2 * np.pi))

    @property
    def damping_ratio(self) -> Array:
        """-Re lambda / |lambda|, (m,)."""
        return np.asarray(-self.eigenvalues.real / np.abs(self.eigenvalues))


def state_eigen(mass: Array, damping: Array, stiffness: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (..., 2n) and the displacement parts (..., n, 2n) of the right eigenvectors of the state
    matrix for [x, x'].
    """
    size = mass.shape[-1]
    state = np.zeros((*mass.shape[:-2], 2 * size, 2 * size), dtype=stiffness.dtype)
    state[..., :size, size:] = np.eye(size)
    state[..., size:, :] = -np.linalg.solve(mass, np.concatenate([stiffness, damping], axis=-1))
    eigenvalues, right = _eigen(state.reshape(-1, 2 * size, 2 * size))
    shapes = right[:, :size].reshape(*mass.shape[:-1], 2 * size)
    return eigenvalues.reshape(*mass.shape[:-2], 2 * size), shapes


def _eigen(matrices: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (m, r) and right eigenvectors (m, r, r) of matrices (m, r, r), in threads where they take
    some time; NaN of a matrix that is not finite.

    Each is taken by itself, so that the results are the same in however many threads.
    """
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    if not finite.all():
        values, vectors = np.full(matrices.shape[:-1], np.nan + 0j), np.full(matrices.shape, np.nan + 0j)
        if finite.any():
            values[finite], vectors[finite] = _eigen(matrices[finite])
        return values, vectors
    worth = int(len(matrices) * matrices.shape[-1] ** 3 // _WORTH_A_THREAD)
    parts = np.array_split(matrices, max(1, min(threads(), len(matrices), worth)))
    found = each(np.linalg.eig, parts)
    values, vectors = (np.concatenate(one).astype(complex, copy=False) for one in zip(*found, strict=True))
    return values, vectors


def complex_modes(mass: Array, damping: Array, stiffness: Array) -> ComplexModes:
    """The oscillating modes of one system (n, n); overdamped ones have no frequency and are left out.

    With a complex stiffness (hysteretic damping) only those with Im > 0 are physical: the others belong to
    negative frequencies.
    """
    values, right = state_eigen(mass, damping, stiffness)
    kept = np.flatnonzero(values.imag > 1e-9 * np.abs(values))
    kept = kept[np.argsort(np.abs(values[kept]))]
    values, shapes = values[kept], right[:, kept].T
    norm = np.einsum("mi,mij,mj->m", shapes, 2 * values[:, None, None] * mass + damping, shapes)
    return ComplexModes(values, shapes / np.sqrt(norm)[:, None])


def eigenvalue_gradient(modes: ComplexModes, factors: Factors, parameters: int) -> Complex:
    """d lambda / dp (m, parameters), exact for simple eigenvalues: -phi' (lambda^2 M_j + lambda C_j + K_j)
    phi.
    """
    if not parameters:
        return np.zeros((len(modes.eigenvalues), 0), dtype=complex)
    through = (modes.shapes @ factors.vectors) ** 2
    columns = -through * factors.weight * modes.eigenvalues[:, None] ** factors.power
    return np.asarray(columns @ (factors.owner[:, None] == np.arange(parameters)))


def eigenvalue_change(modes: ComplexModes, mass: Array, stiffness: Array) -> Complex:
    """Change of lambda (m, q) with changes (q, n, n) of mass and stiffness."""
    moved, bent = (
        np.einsum("mi,qij,mj->mq", modes.shapes, one, modes.shapes, optimize=True)
        for one in (mass, stiffness)
    )
    return np.asarray(-(modes.eigenvalues[:, None] ** 2 * moved + bent))


def frequency_and_damping_gradient(
    modes: ComplexModes, factors: Factors, parameters: int
) -> tuple[Array, Array]:
    """d frequency_hz / dp and d damping_ratio / dp, each (m, parameters)."""
    return frequency_and_damping_change(modes, eigenvalue_gradient(modes, factors, parameters))


def frequency_and_damping_change(modes: ComplexModes, change: Complex) -> tuple[Array, Array]:
    """Changes of frequency_hz and of damping_ratio, (m, q) each, with those of lambda (m, q)."""
    values = modes.eigenvalues[:, None]
    size = np.abs(values)
    d_size = (np.conj(values) * change).real / size
    return d_size / (2 * np.pi), -change.real / size + values.real * d_size / size**2
