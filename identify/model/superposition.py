"""FRFs as sums over the modes of a model, also of records that ended, by one product over
all outputs and inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Complex, real_product
from identify.model.modes import state_eigen
from identify.model.truncation import left_at_end

TOLERANCE, _OF_MODES = 1e-9, 1e-7
"""Largest relative residual |Z x - B| / |B| of a route before the next one is taken instead; of modes more:
rounding leaves some 1e-8 where parts are very stiff, and exponentials of such a model know no more.
"""
Part = tuple[Complex, Complex]
"""What each mode (..., r) has of a function of the lines (..., lines): factor and value of a product."""


class Modal(NamedTuple):
    """Modes of a model: eigenvalues (..., r), shapes (..., n, r) and what a force does to them (..., r,
    inputs); paired: one of each conjugate pair.
    """

    eigenvalues: Complex
    shapes: Complex
    participation: Complex
    paired: bool

    def superposed(self, out: Array, s: Complex, parts: Sequence[Part]) -> Complex:
        """(..., lines, outputs, inputs) at s (..., lines)."""
        return _superpose(out @ self.shapes, self.eigenvalues, self.participation, s, parts, self.paired)

    def left(self, s: Complex, power: int, record: float | Array) -> Complex | None:
        """lambda^p e^(lambda T), (..., r): what is left of the modes after `record` seconds; None where that
        is nothing.
        """
        left = left_at_end(self.eigenvalues, s, record)
        return np.asarray(self.eigenvalues**power * left) if left.any() else None


def modal_form(mass: Array, damping: Array, stiffness: Array, s: Complex, force: Array) -> Modal | None:
    """None where the model is (nearly) defective: the modes do not solve Z x = B at some lines."""
    eigenvalues, shapes = state_eigen(mass, damping, stiffness)
    without = None if is_symmetric(damping) else _without_symmetry(mass, eigenvalues, shapes, force)
    # LAPACK puts the conjugate pairs of a real matrix side by side, Im > 0 first.
    paired = not np.iscomplexobj(stiffness) and bool(np.all(eigenvalues[..., ::2].imag > 0))
    if paired:
        eigenvalues, shapes, without = (
            eigenvalues[..., ::2],
            shapes[..., ::2],
            None if without is None else without[..., ::2, :],
        )
    probe = s[..., probed(s.shape[-1])]
    with np.errstate(all="ignore"):  # a defective system divides by zero here, which the residual notices
        participation = (
            _participation(mass, damping, eigenvalues, shapes, force) if without is None else without
        )
        whole = [(np.ones_like(probe), np.ones_like(eigenvalues))]
        x = _superpose(shapes, eigenvalues, participation, probe, whole, paired)
    line = probe[..., None, None]
    m, c, k = (matrix[..., None, :, :] for matrix in (mass, damping, stiffness))
    residual = k @ x + line * (c @ x + line * (m @ x)) - force
    if not np.abs(residual).max(initial=0.0) <= _OF_MODES * np.abs(force).max(initial=0.0):
        return None
    return Modal(eigenvalues, shapes, participation, paired)


def _participation(
    mass: Array, damping: Array, eigenvalues: Complex, shapes: Complex, force: Array
) -> Complex:
    """phi_r' B / phi_r' (2 lambda_r M + C) phi_r, (..., r, inputs): the left vectors of a symmetric system
    are its right ones.
    """
    norm = np.sum(shapes * (2 * eigenvalues[..., None, :] * (mass @ shapes) + damping @ shapes), axis=-2)
    return np.asarray(np.swapaxes(shapes, -1, -2) @ force / norm[..., None])


def is_symmetric(damping: Array) -> bool:
    """Whether matrices (..., n, n) are symmetric: all are but the damping of a robot that moves, which has
    Coriolis terms.
    """
    return bool(
        np.abs(damping - np.swapaxes(damping, -1, -2)).max(initial=0.0)
        <= 1e-12 * np.abs(damping).max(initial=0.0)
    )


def _without_symmetry(mass: Array, eigenvalues: Complex, shapes: Complex, force: Array) -> Complex:
    """(..., r, inputs): participation of all modes without symmetry, by the inverse of the matrix of state
    vectors.
    """
    states = np.concatenate([shapes, eigenvalues[..., None, :] * shapes], axis=-2)
    pushed = np.linalg.solve(mass, np.broadcast_to(force, (*mass.shape[:-1], force.shape[1])))
    return np.asarray(np.linalg.solve(states, np.concatenate([np.zeros_like(pushed), pushed], axis=-2)))


def _superpose(
    shapes: Complex,
    eigenvalues: Complex,
    participation: Complex,
    s: Complex,
    parts: Sequence[Part],
    paired: bool,
) -> Complex:
    """sum_r R_r n_r(s) / (s - lambda_r), R_r = shapes_r participation_r, with the conjugate terms where
    paired, (..., lines, outputs, inputs), by one product over all output-input pairs; n_r(s) the sum of the
    parts.
    """
    outputs, inputs = shapes.shape[-2], participation.shape[-1]
    residues = shapes[..., :, None, :] * np.swapaxes(participation, -1, -2)[..., None, :, :]
    residues = residues.reshape(*residues.shape[:-3], outputs * inputs, -1)
    if paired and outputs * inputs <= eigenvalues.shape[-1]:
        summed = _part_by_part(residues, eigenvalues, s, parts)
    elif paired:
        both = np.concatenate([residues.real, residues.imag], axis=-1)
        summed = real_product(both, _with_parts(eigenvalues, s, parts))
    else:
        numerator = sum(value[..., None] * factor[..., None, :] for factor, value in parts)
        summed = residues @ (numerator / (s[..., None, :] - eigenvalues[..., None]))
    found = np.ascontiguousarray(np.swapaxes(summed, -1, -2))
    return found.reshape(*found.shape[:-1], outputs, inputs)


def _part_by_part(residues: Complex, eigenvalues: Complex, s: Complex, parts: Sequence[Part]) -> Complex:
    """Sums (..., pairs, lines) with residues (..., pairs, r) of its own for each part and one table for all:
    less work than `_with_parts` where pairs are fewer than modes.
    """
    each = np.concatenate([value[..., None, :] * residues for _, value in parts], axis=-2)
    real = np.concatenate([2 * each.real, -2 * eigenvalues.imag[..., None, :] * each.imag], axis=-1)
    shares = np.split(real_product(real, _paired_table(eigenvalues, s)), len(parts), axis=-2)
    return np.asarray(sum(factor[..., None, :] * one for (factor, _), one in zip(parts, shares, strict=True)))


def _with_parts(eigenvalues: Complex, s: Complex, parts: Sequence[Part]) -> Complex:
    """(..., 2r, lines): what Re R and Im R are multiplied by in R n / (s - l) + R* n' / (s - l*), where n = f
    v and n' = f v* for each part.

    Both have the denominator (s - Re l)^2 + (Im l)^2, and the numerators 2 f (Re(v) s - Re(v l*)) and 2 f
    (Im(v l*) - Im(v) s), real in l and v.
    """
    lines = np.broadcast_arrays(*(factor * line for factor, _ in parts for line in (s, 1.0)))
    steep = []
    for _, value in parts:
        turned = value * np.conj(eigenvalues)
        steep += [np.concatenate([value.real, -value.imag], axis=-1)]
        steep += [np.concatenate([-turned.real, turned.imag], axis=-1)]
    table = real_product(2 * np.stack(steep, axis=-1), np.stack(lines, axis=-2))
    inverse = _inverse(eigenvalues, s)[0]
    return np.asarray(table * np.concatenate([inverse, inverse], axis=-2))


def _paired_table(eigenvalues: Complex, s: Complex) -> Complex:
    """(..., 2r, lines): what 2 Re R and -2 Im l Im R are multiplied by in R / (s - l) + R* / (s - l*)."""
    inverse, away = _inverse(eigenvalues, s)
    return np.concatenate([away * inverse, inverse], axis=-2)


def _inverse(eigenvalues: Complex, s: Complex) -> tuple[Complex, Complex]:
    """1 / ((s - Re l)^2 + (Im l)^2) and s - Re l, (..., r, lines)."""
    away = s[..., None, :] - eigenvalues.real[..., None]
    return 1.0 / (away * away + (eigenvalues.imag**2)[..., None]), away


def probed(lines: int) -> list[int]:
    """Numbers of the lines at which the residual is looked at."""
    return [0, lines // 2, lines - 1]
