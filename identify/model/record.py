"""What an FRF lacks whose record ended before the response had died out, and its exact sensitivities.

A record of length T, begun by the blow, sees an impulse response only up to T.  The rest is the free motion from the displacement
x(T) and velocity v(T) that a unit impulse leaves, so that the FRF of the record is H(s) less

    R(s) = e^(-sT) S Y_p(s),   Y_k = s^k X - s^(k-1) x(T) - s^(k-2) v(T),   Z(s) X = (s M + C) x(T) + M v(T)

where terms with negative powers of s do not exist.  An exponential window makes R small; it is e^-5 of H at a resonance of 10 Hz with 2 %
damping after 1.6 s with a window of 2 / s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from identify.model.modes import state_eigen
from identify.model.system import Factors

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

NEGLIGIBLE = 1e-4
"""Relative size of the rest, at a resonance, below which it is not computed."""


@dataclass(frozen=True)
class Rest:
    """R (lines, outputs, inputs), its derivatives with respect to parameters (..., p), and dR/ds."""

    value: Complex
    gradient: Complex
    slope: Complex


def lasts(eigenvalues: Complex, s: Complex, record: float) -> bool:
    """Whether any motion with these eigenvalues lasts beyond the record, as seen through the window that s implies."""
    return bool(np.exp((eigenvalues.real.max() - s.real.min()) * record) > NEGLIGIBLE)


def rest_by_exponential(
    mass: Array, damping: Array, stiffness: Array, s: Complex, out: Array, force: Array, power: int, record: float
) -> Complex:
    """R (..., lines, outputs, inputs) for a population (..., n, n) by matrix exponentials: any system, defective or not."""
    size = mass.shape[-1]
    lower = -np.linalg.solve(mass, np.concatenate([stiffness, damping], axis=-1))
    upper = np.broadcast_to(np.eye(size, 2 * size, size), lower.shape)
    moved = scipy.linalg.expm(record * np.concatenate([upper, lower], axis=-2))[..., size:] @ np.linalg.solve(mass, force)
    x, v = moved[..., :size, :], moved[..., size:, :]
    line = s[..., None, None]
    m, c, k, x, v = (matrix[..., None, :, :] for matrix in (mass, damping, stiffness, x, v))
    free = np.linalg.solve(k + line * c + line**2 * m, (line * m + c) @ x + m @ v)
    return np.asarray(np.exp(-line * record) * (out @ _later(free, x, v, line, power)))


def rest_and_gradient(
    matrices: tuple[Array, Array, Array],
    factors: Factors,
    at: tuple[Complex, Array, Array, int],
    record: float,
    parameters: NDArray[np.intp],
) -> Rest | None:
    """R at (s (lines,), out, force, power) with its derivatives for the parameters whose numbers are given; None where it is negligible."""
    (mass, damping, stiffness), (s, out, force, power) = matrices, at
    eigenvalues, shapes = state_eigen(*matrices)
    if not lasts(eigenvalues, s, record):
        return None
    columns = np.flatnonzero(np.isin(factors.owner, parameters))
    vectors, owned = factors.vectors[:, columns], (factors.owner[columns, None] == parameters).astype(float)
    norm = np.sum(shapes * (2 * eigenvalues * (mass @ shapes) + damping @ shapes), axis=0)
    participation = shapes.T @ force / norm[:, None]
    decayed = np.exp(eigenvalues * record)[:, None] * participation
    x, v = (shapes @ decayed).real, (shapes @ (eigenvalues[:, None] * decayed)).real
    dx, dv = (_end_slopes(eigenvalues, shapes, norm, participation, record, factors, columns, rate) @ owned for rate in (0, 1))
    line = s[:, None, None]
    z = stiffness + line * damping + line**2 * mass
    solved = np.linalg.solve(z, np.concatenate([(line * mass + damping) @ x + mass @ v, np.broadcast_to(out.T, (len(s), *out.T.shape))], 2))
    free, to_out = np.asarray(solved[:, :, : force.shape[1]]), np.swapaxes(solved[:, :, force.shape[1] :], 1, 2)
    left, right = (to_out @ vectors) * factors.weight[columns], np.zeros((len(s), len(columns), force.shape[1]), dtype=complex)
    for k in range(3):
        chosen = factors.power[columns] == k
        right[:, chosen] = vectors[:, chosen].T @ _later(free, x, v, line, k)
    d_free = np.einsum("lon,nij->loij", to_out @ (line * mass + damping), dx) + np.einsum("lon,nij->loij", to_out @ mass, dv)
    d_free = d_free - (left[:, :, None, :] * np.swapaxes(right, 1, 2)[:, None]) @ owned
    d_x, d_v = (np.einsum("on,nij->oij", out, slopes) for slopes in (dx, dv))
    gradient = _later(np.asarray(d_free, dtype=complex), d_x, d_v, line[..., None], power)
    value = out @ _later(free, x, v, line, power)
    d_ds = to_out @ (mass @ x - (damping + 2 * line * mass) @ free)
    slope = line**power * d_ds - record * value
    if power:
        slope = slope + power * line ** (power - 1) * (out @ free) - (out @ x if power == 2 else 0.0)
    scale = np.exp(-line * record)
    return Rest(scale * value, scale[..., None] * gradient, scale * slope)


def _later(free: Complex, x: Array, v: Array, line: Complex, power: int) -> Complex:
    """Transform of the free motion's displacement, velocity or acceleration (power 0, 1, 2) from that of its displacement."""
    if power == 0:
        return free
    return line * free - x if power == 1 else line**2 * free - line * x - v


def _end_slopes(
    eigenvalues: Complex,
    shapes: Complex,
    norm: Complex,
    participation: Complex,
    record: float,
    factors: Factors,
    columns: NDArray[np.intp],
    rate: int,
) -> Array:
    """Derivatives (n, inputs, columns) of x(T), or of v(T) with rate 1, for unit changes of Z by each column.

    x(T) = 1/(2 pi j) of the integral of e^(zT) Z(z)^-1 F around all eigenvalues; so its change is minus the sum over pairs of
    modes of residues times the divided difference of z^(k + rate) e^(zT), with k the power of s of the column.
    """
    modal = shapes.T @ factors.vectors[:, columns]
    near = np.abs(eigenvalues[:, None] - eigenvalues) < 1e-7 * np.abs(eigenvalues[:, None])
    apart = np.where(near, 1.0, eigenvalues[:, None] - eigenvalues)
    result = np.zeros((shapes.shape[0], participation.shape[1], len(columns)))
    for k in range(3):
        chosen = np.flatnonzero(factors.power[columns] == k)
        value = eigenvalues ** (k + rate) * np.exp(eigenvalues * record)
        tangent = value * (record + (k + rate) / eigenvalues)
        divided = np.where(near, tangent[:, None], (value[:, None] - value) / apart)
        driven = np.einsum("rq,qc,qi->ric", divided, modal[:, chosen], participation)
        weighed = modal[:, chosen] / norm[:, None] * factors.weight[columns[chosen]]
        result[..., chosen] = -np.einsum("nr,rc,ric->nic", shapes, weighed, driven).real
    return result
