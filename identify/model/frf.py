"""FRFs of a linear system and their exact sensitivities, as functions on arrays.

    Z(s) = K + s C + s^2 M,   H(s) = s^p S Z(s)^-1 B,   dH/dp_j = -s^p (S Z^-1) dZ/dp_j (Z^-1 B)

p = 0, 1, 2 for receptance, mobility, accelerance.  `frf` goes through the Hessenberg form of the state
matrix, input by input, or for many inputs and for records that ended through its eigenvalues; the first is
some ten to fifteen times faster than a solve per line, the second six; few lines are solved for.  It measures
its own error, goes from the first to the second where it is too large, and from there, where the system is
(nearly) defective, to a solve per line.  `frf_and_gradient` solves, because it needs Z^-1 at all outputs and
inputs anyway.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, product_by_real, real_product
from identify.model.hessenberg import motion_under
from identify.model.superposition import TOLERANCE, is_symmetric, modal_form, probed
from identify.model.system import Factors
from identify.model.truncation import TruncationCorrection, end_of_record, rest_by_exponential

_FEW_INPUTS, _FEW_LINES = 3, 24
"""Inputs, and lines times inputs for each coordinate, up to which recurrences for more than one input take
less time than eigenvalues.
"""
_SOLVED = 16
"""Lines for each input up to which a solve per line takes less time than recurrences."""
_AT_ONCE = 2_000_000
"""Entries of all dynamic stiffnesses of a population that are solved for at once: 32 MB."""


def frf(
    mass: Array,
    damping: Array,
    stiffness: Array,
    s: Complex,
    out: Array,
    force: Array,
    power: int,
    record: float | Array | None = None,
) -> Complex:
    """H (..., lines, outputs, inputs) at s (..., lines), rad/s; mass, damping, stiffness (..., n, n); out
    (outputs, n), force (n, inputs).

    record: seconds (...) after which the records that it was estimated from ended
    (`identify.model.truncation`), or None.
    """
    size, inputs = force.shape
    if record is None and s.shape[-1] <= _SOLVED * min(inputs, _FEW_INPUTS):
        return _by_solves(mass, damping, stiffness, s, out, force, power)
    few = inputs <= _FEW_INPUTS and inputs * s.shape[-1] <= _FEW_LINES * size
    if record is None and (inputs == 1 or few):
        return _by_recurrence(mass, damping, stiffness, s, out, force, power)
    return _by_modes(mass, damping, stiffness, s, out, force, power, record)


def _by_solves(
    mass: Array, damping: Array, stiffness: Array, s: Complex, out: Array, force: Array, power: int
) -> Complex:
    """`frf_by_solve` of as many of a population at once as take little memory."""
    before, size = mass.shape[:-2], mass.shape[-1]
    m, c, k = (one.reshape(-1, size, size) for one in (mass, damping, stiffness))
    each = np.broadcast_to(s, (*before, s.shape[-1])).reshape(-1, s.shape[-1])
    step = max(1, _AT_ONCE // (s.shape[-1] * size**2))
    some = [slice(first, first + step) for first in range(0, len(each), step)]
    h = [frf_by_solve(m[one], c[one], k[one], each[one], out, force, power) for one in some]
    return np.concatenate(h).reshape(*before, *h[0].shape[1:])


def _by_recurrence(
    mass: Array, damping: Array, stiffness: Array, s: Complex, out: Array, force: Array, power: int
) -> Complex:
    """`frf` input by input; by modes for those of a population whose residual is too large."""
    before = mass.shape[:-2]
    m, c, k = (matrix.reshape(-1, *matrix.shape[-2:]) for matrix in (mass, damping, stiffness))
    each = np.broadcast_to(s, (*before, s.shape[-1])).reshape(-1, s.shape[-1])
    h = np.empty((*each.shape, len(out), force.shape[1]), dtype=complex)
    exact = np.ones(len(h), dtype=bool)
    probe = probed(s.shape[-1])
    with np.errstate(all="ignore"):  # what is not finite is no solution, which the residual notices
        z = dynamic_stiffness(m, c, k, each[:, probe])
        for number, load in enumerate(force.T):
            motion = motion_under(load, m, c, k, each)
            h[..., number] = motion.seen(out, each**power)
            residual = (z @ motion.at(probe)[..., None])[..., 0] - load
            exact &= np.abs(residual).max(axis=(1, 2)) <= TOLERANCE * np.abs(load).max(initial=0.0)
    for one in np.flatnonzero(~exact).tolist():
        h[one] = _by_modes(m[one], c[one], k[one], each[one], out, force, power, None)
    return h.reshape(*before, *h.shape[1:])


def _by_modes(
    mass: Array,
    damping: Array,
    stiffness: Array,
    s: Complex,
    out: Array,
    force: Array,
    power: int,
    record: float | Array | None,
) -> Complex:
    """`frf` through eigenvalues, or by solves."""
    modal = modal_form(mass, damping, stiffness, s, force)
    if modal is None:
        rest = (
            0.0
            if record is None
            else rest_by_exponential(mass, damping, stiffness, s, out, force, power, record)
        )
        return frf_by_solve(mass, damping, stiffness, s, out, force, power) - rest
    parts = [(s**power, np.ones_like(modal.eigenvalues))]
    left = None if record is None else modal.left(s, power, record)
    if record is not None and left is not None:
        parts.append((-_late(s, record), left))
    return modal.superposed(out, s, parts)


def end_added(
    matrices: tuple[Array, Array, Array], s: Complex, out: Array, force: Array, power: int, record: float
) -> Complex:
    """(lines, outputs, inputs): what the end of the record adds to H."""
    modal = modal_form(*matrices, s, force)
    if modal is None:
        return np.asarray(-rest_by_exponential(*matrices, s, out, force, power, record))
    left = modal.left(s, power, record)
    if left is None:
        return np.zeros((len(s), len(out), force.shape[1]), dtype=complex)
    return modal.superposed(out, s, [(-_late(s, record), left)])


def _late(s: Complex, record: float | Array) -> Complex:
    """e^(-sT) (..., lines)."""
    return np.asarray(np.exp(-s * np.asarray(record)[..., None]))


def dynamic_stiffness(mass: Array, damping: Array, stiffness: Array, s: Complex) -> Complex:
    """Z (..., lines, n, n) = K + s C + s^2 M."""
    powers = np.stack([np.ones_like(s), s, s * s], axis=-1)
    parts = np.stack(np.broadcast_arrays(stiffness, damping, mass), axis=-3)
    flat = parts.reshape(*parts.shape[:-2], -1)
    z = powers @ flat if np.iscomplexobj(flat) else product_by_real(powers, flat)
    return z.reshape(*z.shape[:-1], *parts.shape[-2:])


def frf_by_solve(
    mass: Array, damping: Array, stiffness: Array, s: Complex, out: Array, force: Array, power: int
) -> Complex:
    """The same as `frf` by a solve per line: the independent route, for checks and for defective systems."""
    z = dynamic_stiffness(mass, damping, stiffness, s)
    x = np.linalg.solve(z, np.broadcast_to(force.astype(complex), (*z.shape[:-1], force.shape[1])))
    return np.asarray((s**power)[..., None, None] * (out @ x))


def frf_and_gradient(
    matrices: tuple[Array, Array, Array],
    factors: Factors,
    s: Complex,
    out: Array,
    force: Array,
    power: int,
    parameters: NDArray[np.intp],
    record: float | None = None,
) -> tuple[Complex, Complex]:
    """H (lines, outputs, inputs) and dH/dp (lines, outputs, inputs, p) for the parameters whose numbers are
    given, p of them.

    One solve a line for [B, S'] serves all where Z is symmetric, as it is unless the robot moves.  record as
    for `frf`.
    """
    end = None if record is None else end_of_record(matrices, factors, s, force, record, parameters)
    return gradient_with(end, matrices, factors, s, out, force, power, parameters)


def gradient_with(
    end: TruncationCorrection | None,
    matrices: tuple[Array, Array, Array],
    factors: Factors,
    s: Complex,
    out: Array,
    force: Array,
    power: int,
    parameters: NDArray[np.intp],
) -> tuple[Complex, Complex]:
    """`frf_and_gradient` with what is missing from the transform of the motion already known.

    Of all coordinates first, and then of the outputs, where these are more.
    """
    size = out.shape[1]
    if len(out) > size:
        every = gradient_with(end, matrices, factors, s, np.eye(size), force, power, parameters)
        return _seen(out, every[0]), _seen(out, every[1])
    motion, to_out = motion_and_transfer(end, matrices, s, out, force)
    columns = factors.columns(parameters)
    vectors, powers = factors.vectors[:, columns], factors.power[columns]
    left = _weighed(-(s**power)[:, None, None] * to_out, vectors * factors.weight[columns])
    right = np.zeros((len(s), len(columns), force.shape[1]), dtype=complex)
    for k in range(3):
        right[:, powers == k] = real_product(vectors[:, powers == k].T, motion[k])
    gradient = _products(left, right, factors.owner[columns], parameters)
    if end is not None:
        gradient = gradient + end.gradient(matrices, s, to_out, power)
    return out @ motion[power], gradient


def _weighed(left: Complex, columns: Array | Complex) -> Complex:
    """left (lines, outputs, n) @ columns (n, c), complex only where something is damped by hysteresis."""
    if np.iscomplexobj(columns):
        return np.asarray(left @ columns)
    return product_by_real(left.reshape(-1, left.shape[-1]), columns.real).reshape(*left.shape[:-1], -1)


def _seen(out: Array, moved: Complex) -> Complex:
    """(lines, outputs, ...) from motions (lines, n, ...) of the coordinates."""
    seen = real_product(out, moved.reshape(*moved.shape[:2], -1))
    return seen.reshape(len(moved), len(out), *moved.shape[2:])


def motion_and_transfer(
    end: TruncationCorrection | None,
    matrices: tuple[Array, Array, Array],
    s: Complex,
    out: Array,
    force: Array,
) -> tuple[list[Complex], Complex]:
    """Displacement, velocity and acceleration (lines, n, inputs) for unit forces, and S Z^-1 (lines, outputs,
    n).
    """
    moved, to_out = _solve_both(matrices, s, out, force, end)
    motion = [(s**k)[:, None, None] * moved + (0.0 if end is None else end.motion(s, k)) for k in range(3)]
    return motion, to_out


def frf_slope(
    matrices: tuple[Array, Array, Array],
    s: Complex,
    out: Array,
    force: Array,
    power: int,
    record: float | None = None,
) -> Complex:
    """dH/ds (lines, outputs, inputs) at s (lines,): what another decay of the window would change."""
    mass, damping, _ = matrices
    nothing = Factors(np.zeros((len(mass), 0)), np.zeros(0, int), np.zeros(0), np.zeros(0, int))
    end = (
        None if record is None else end_of_record(matrices, nothing, s, force, record, np.zeros(0, dtype=int))
    )
    moved, to_out = _solve_both(matrices, s, out, force, end)
    line = s[:, None, None]
    change = -to_out @ (damping + 2 * line * mass) @ moved
    slope = line**power * change + power * line ** (power - 1) * (out @ moved)
    return np.asarray(slope if end is None else slope + end.slope(mass, damping, s, out, to_out, power))


def _solve_both(
    matrices: tuple[Array, Array, Array],
    s: Complex,
    out: Array,
    force: Array,
    end: TruncationCorrection | None,
) -> tuple[Complex, Complex]:
    """X (lines, n, inputs), the transform of the displacements, and S Z^-1 (lines, outputs, n), by one solve
    a line if Z is symmetric.
    """
    load = (
        np.broadcast_to(force, (len(s), *force.shape))
        if end is None
        else force - end.load(matrices[0], matrices[1], s)
    )
    if not is_symmetric(matrices[1]):
        z = dynamic_stiffness(*matrices, s)
        to_out = np.linalg.solve(
            np.swapaxes(z, 1, 2), np.broadcast_to(out.T.astype(complex), (len(s), *out.T.shape))
        )
        return np.asarray(np.linalg.solve(z, load.astype(complex))), np.swapaxes(to_out, 1, 2)
    both = np.concatenate([load, np.broadcast_to(out.T, (len(s), *out.T.shape))], axis=2)
    solved = np.asarray(np.linalg.solve(dynamic_stiffness(*matrices, s), both), dtype=complex)
    return solved[:, :, : force.shape[1]], np.swapaxes(solved[:, :, force.shape[1] :], 1, 2)


def _products(
    left: Complex, right: Complex, owner: NDArray[np.intp], parameters: NDArray[np.intp]
) -> Complex:
    """(lines, outputs, inputs, p): sum of left (lines, outputs, c) times right (lines, c, inputs) over the
    columns c of each parameter.
    """
    order = np.argsort(owner, kind="stable")
    first, last = (np.searchsorted(owner[order], parameters, side) for side in ("left", "right"))
    single = last - first == 1
    every = order[first[single]]
    # A product of matrices is slow for one column.
    found = left[:, :, every][:, :, None] * np.swapaxes(right[:, every], 1, 2)[:, None]
    if single.all():
        return np.asarray(found)
    result = np.empty((*left.shape[:2], right.shape[2], len(parameters)), dtype=complex)
    result[..., single] = found
    for number in np.flatnonzero(~single):
        own = order[first[number] : last[number]]
        result[..., number] = left[:, :, own] @ right[:, own]
    return result
