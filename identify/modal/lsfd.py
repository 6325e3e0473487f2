"""Least-squares frequency domain: shapes and residuals from given poles and participation factors.

The receptance is sum_r phi_r L_r^T / (s - lambda_r) + conjugate + upper + lower / s^2, with s = sigma + j
omega, so that an exponential window needs no correction here; the measured quantity is s^p times that.  The
unknowns are real, and the same regressors serve every response.  Source: Heylen, Lammens and Sas, Modal
Analysis Theory and Testing (1997), A.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.modal.layout import Layout

MORE_RESIDUALS = (("s^-1", "s^1"), ("s^-4", "s^-3", "s^2"))
"""Terms that join where modes beyond the band leave more than a constant and 1 / s^2."""


def power_of(kind: str) -> int:
    """The power of s of a residual term of the receptance: "lower" (-2), "upper" (0) or "s^k"."""
    return {"lower": -2, "upper": 0}[kind] if kind in ("lower", "upper") else int(kind.removeprefix("s^"))


@dataclass(frozen=True)
class ModalModel:
    """poles (m,), rad/s; participation (m, references), largest component 1; shapes (m, responses), so that
    the receptance residue of mode r is the outer product shapes[r] participation[r]; residuals {kind:
    (responses, references)}, real.
    """

    poles: Complex
    participation: Complex
    shapes: Complex
    residuals: dict[str, Array]

    def __len__(self) -> int:
        return len(self.poles)


def unit_participation(participation: Complex) -> Complex:
    """Each row (references,) divided by its largest component."""
    largest = np.argmax(np.abs(participation), axis=1)
    return np.asarray(participation / participation[np.arange(len(participation)), largest][:, None])


def synthesise(model: ModalModel, s: Complex, power: int) -> Complex:
    """FRFs of the model, (lines, responses, references), at s (lines,) in the quantity of that power of s."""
    frf = np.einsum(
        "lm,mo,mi->loi", 1 / (s[:, None] - model.poles), model.shapes, model.participation, optimize=True
    )
    mirror = 1 / (s[:, None] - model.poles.conj())
    frf = frf + np.einsum(
        "lm,mo,mi->loi", mirror, model.shapes.conj(), model.participation.conj(), optimize=True
    )
    for kind, value in model.residuals.items():
        frf = frf + (s ** power_of(kind))[:, None, None] * value
    return np.asarray(frf * (s**power)[:, None, None])


def regressors(layout: Layout, poles: Complex, participation: Complex, residuals: tuple[str, ...]) -> Array:
    """Real design matrix (2 L references, 2 m + residuals x references), line by reference, real rows then
    imaginary rows.

    Columns 2r and 2r + 1 belong to the real and the imaginary part of shape r.
    """
    s, refs = layout.s, len(layout.references)
    scale = (s**layout.power)[:, None, None]
    direct = scale * participation / (s[:, None, None] - poles[:, None])
    mirror = scale * participation.conj() / (s[:, None, None] - poles.conj()[:, None])
    modal = (
        np.stack([direct + mirror, 1j * (direct - mirror)], axis=2)
        .transpose(0, 3, 1, 2)
        .reshape(len(s) * refs, 2 * len(poles))
    )
    terms = [np.kron((s ** (layout.power + power_of(kind)))[:, None], np.eye(refs)) for kind in residuals]
    return stack(np.concatenate([modal, *terms], axis=1))


def stack(values: Complex) -> Array:
    """Real rows above imaginary rows."""
    return np.concatenate([values.real, values.imag])


def targets(frf: Complex) -> Array:
    """Measured FRFs (L, responses, references) in the row order of `regressors`, (2 L references,
    responses).
    """
    return stack(frf.transpose(0, 2, 1).reshape(-1, frf.shape[1]))


def lsfd(
    layout: Layout,
    poles: Complex,
    participation: Complex,
    residuals: tuple[str, ...],
    weight: Array | None = None,
) -> ModalModel:
    """Shapes and residuals by linear least squares; weight (L, references) multiplies the equations.

    A response that was not measured against every reference is fitted to those it has; its residuals
    elsewhere are NaN.
    """
    participation = unit_participation(participation)
    matrix = regressors(layout, poles, participation, residuals)
    rows = np.ones(len(matrix)) if weight is None else np.tile(weight.ravel(), 2)
    y = targets(layout.frf)
    known = np.isfinite(layout.frf).all(axis=0)
    solution = np.full((matrix.shape[1], y.shape[1]), np.nan)
    for pattern in np.unique(known, axis=0):
        responses = np.flatnonzero((known == pattern).all(axis=1))
        used = np.tile(pattern, 2 * len(layout.frequency_hz))
        columns = np.concatenate([np.ones(2 * len(poles), dtype=bool), np.tile(pattern, len(residuals))])
        whole = bool(pattern.all() and len(responses) == y.shape[1])  # then there is nothing to pick, or copy
        own, values = (matrix, y) if whole else (matrix[np.ix_(used, columns)], y[np.ix_(used, responses)])
        found = solve(own * rows[used, None], values * rows[used, None])
        solution[np.ix_(columns, responses)] = found
    return _model(poles, participation, solution, residuals)


def solve(matrix: Array, y: Array) -> Array:
    """Least squares with columns scaled to unit length."""
    size = np.linalg.norm(matrix, axis=0)
    return np.asarray(np.linalg.lstsq(matrix / size, y, rcond=None)[0] / size[:, None])


def _model(poles: Complex, participation: Complex, solution: Array, residuals: tuple[str, ...]) -> ModalModel:
    m, refs = len(poles), participation.shape[1]
    shapes = solution[0 : 2 * m : 2] + 1j * solution[1 : 2 * m : 2]
    blocks = {kind: solution[2 * m + k * refs : 2 * m + (k + 1) * refs].T for k, kind in enumerate(residuals)}
    return ModalModel(poles, participation, shapes, blocks)


def contributions(
    layout: Layout, poles: Complex, participation: Complex, residuals: tuple[str, ...]
) -> Array:
    """What only this mode explains, (m,): rise of the squared error when it is left out and the rest is
    fitted again, over the energy of the complete responses within two half-bandwidths of it.
    """
    frf = layout.frf[:, layout.complete]
    matrix = regressors(layout, poles, unit_participation(participation), residuals)
    matrix = matrix / np.linalg.norm(matrix, axis=0)
    inverse = np.linalg.pinv(matrix.T @ matrix, hermitian=True)
    solution = inverse @ (matrix.T @ targets(frf))
    energy = np.sum(np.abs(frf) ** 2, axis=(1, 2))
    share = np.zeros(len(poles))
    for r, pole in enumerate(poles):
        block = slice(2 * r, 2 * r + 2)
        rise = np.sum(solution[block] * np.linalg.solve(inverse[block, block], solution[block]))
        # Of a pole beyond the band the lines at the edge are what it acts on.
        centre = np.clip(abs(pole) / (2 * np.pi), layout.frequency_hz[0], layout.frequency_hz[-1])
        reach = max(2 * -pole.real / (2 * np.pi), layout.spacing_hz(centre))
        near = np.abs(layout.frequency_hz - centre) <= reach
        share[r] = rise / max(np.sum(energy[near]), np.finfo(float).tiny)
    return share
