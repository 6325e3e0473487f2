"""Motion under one force at many frequencies without eigenvalues, by a Hessenberg form.

The state matrix A of a model, shifted by a rate r and inverted, is G.  Then (s - A) x = b is

    (mu - G) x = -mu G b,   mu = 1 / (s - r)

with small G and all that matters in band at its large end, however stiff the rest; orthogonal Q with its
first column along G b turn it into (mu - H) y = -mu |G b| e_1, H upper Hessenberg (Laub, IEEE Transactions on
Automatic Control 26, 1981).  All rows but the first then are a recurrence from the last entry of y upwards,

    h_(k,k-1) y_(k-1) = mu y_k - sum over j >= k of h_kj y_j,

and the first row says what y has to be multiplied by: Hyman's method (Wilkinson, The Algebraic Eigenvalue
Problem, 1965, chapter 7).  Each row is met to rounding, so it is as accurate as a solve, for defective
systems too.  With y_k in units of the product of the first k - 1 entries h_(k,k-1) these are one; the sums of
a block of rows over all entries below it are one product of matrices for all lines.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import get_lapack_funcs

from identify.core.arrays import Array, Complex, real_product

_BLOCK = 12
"""Rows whose sums over the entries below them are taken at once."""


class Motion(NamedTuple):
    """Displacements for one force: shapes (m, n, 2n) times steps (m, 2n, lines) times size (m, lines)."""

    shapes: Array
    steps: Complex
    size: Complex

    def seen(self, out: Array, factor: Complex) -> Complex:
        """(m, lines, outputs) through out (outputs, n), times a factor (m, lines)."""
        seen = _product(out @ self.shapes, self.steps)
        return np.asarray(np.swapaxes(seen, 1, 2) * (factor * self.size)[..., None])

    def at(self, lines: list[int]) -> Complex:
        """(m, lines, n) of all coordinates at some lines."""
        moved = _product(self.shapes, self.steps[..., lines])
        return np.asarray(np.swapaxes(moved * self.size[:, None, lines], 1, 2))


def motion_under(force: Array, mass: Array, damping: Array, stiffness: Array, s: Complex) -> Motion:
    """Displacements of models (m, n, n) for a force (n,) at s (m, lines), rad/s; not finite where a model has
    none.

    Coordinates are in units of 1 / sqrt(their stiffness at the rate r of the shift), time in units of 1 / r.
    """
    count, size, _ = mass.shape
    rate = _rate(s)
    damping, mass = rate[..., None] * damping, rate[..., None] ** 2 * mass
    shifted = stiffness + damping + mass
    unit = 1.0 / np.sqrt(np.abs(np.diagonal(shifted, axis1=1, axis2=2)))
    scale = unit[:, :, None] * unit[:, None, :]
    sides = [(damping + mass) * scale, mass * scale, (unit * force)[..., None]]
    solved = -np.linalg.solve(shifted * scale, np.concatenate(sides, axis=-1))
    # One row and column more: the reduction takes the load to the first axis before anything else.
    state = np.zeros((count, 2 * size + 1, 2 * size + 1), dtype=solved.dtype).swapaxes(1, 2)
    for half in (slice(1, size + 1), slice(size + 1, None)):
        state[:, half, 1:], state[:, half, 0] = solved[..., :-1], solved[..., -1]
    state[:, size + 1 :, 1 : size + 1] += np.eye(size)
    form, turned = _reduced(state)
    rows, unit_of_step = _unit_steps(form[:, 1:, 1:])
    at = rate / (s - rate)
    steps, first = _recurrence(rows, at)
    shapes = unit[..., None] * turned * unit_of_step[:, None]
    return Motion(shapes, steps, -at * form[:, 1, :1] / first)


def _rate(s: Complex) -> Array:
    """(m, 1): rad/s, in the middle of the lines (m, lines) on a logarithmic scale, but for those at zero."""
    size = np.abs(s)
    least = np.min(size, axis=1, keepdims=True, initial=np.inf, where=size > 0)
    return np.asarray(np.sqrt(least * size.max(axis=1, keepdims=True)))


def _reduced(state: Array) -> tuple[Array, Array]:
    """Hessenberg forms (m, 1 + 2n, 1 + 2n), in the place of matrices in the order of LAPACK, and the first n
    rows (m, n, 2n) of Q.
    """
    size = state.shape[-1] // 2
    reduce, room, orthogonal = get_lapack_funcs(("gehrd", "gehrd_lwork", "orghr"), dtype=state.dtype)
    work = int(room(2 * size + 1)[0].real)
    turned = np.empty((len(state), size, 2 * size), dtype=state.dtype)
    for number, matrix in enumerate(state):
        state[number], reflectors, _ = reduce(matrix, lwork=work, overwrite_a=1)
        turned[number] = orthogonal(matrix, reflectors, lwork=work)[0][1 : size + 1, 1:]
    return state, turned


def _unit_steps(form: Array) -> tuple[Array, Array]:
    """-H (m, r, r) for entries in units (m, r) that make those below its diagonal one, which stand there
    with their own sign.

    One that is zero, where the force does not reach all, is replaced by as little as rounding is.
    """
    size = form.shape[-1]
    below = np.diagonal(form, -1, axis1=1, axis2=2)
    least = np.finfo(float).eps * np.abs(form).max(axis=(1, 2), initial=0.0)[:, None]
    below = np.where(below == 0, least, below)
    unit = np.cumprod(np.concatenate([np.ones_like(form[:, 0, :1]), below], axis=1), axis=1)
    scaled = np.triu(form) * (unit[:, None, :] / unit[:, :, None])
    return np.subtract(np.eye(size, k=-1), scaled, order="C"), unit


def _recurrence(rows: Array, at: Complex) -> tuple[Complex, Complex]:
    """Entries (m, r, lines) from the last one, 1, upwards at mu (m, lines), and what the first row makes of
    them, (m, lines).
    """
    count, size, _ = rows.shape
    y = np.ones((count, size, at.shape[-1]), dtype=complex)
    flat = y if np.iscomplexobj(rows) else y.view(float)
    for last in range(size, 1, -_BLOCK):
        first = max(last - _BLOCK, 1)
        np.matmul(rows[:, first:last, last:], flat[:, last:], out=flat[:, first - 1 : last - 1])
        for k in range(last - 1, first - 1, -1):
            known = rows[:, k, None, k - 1 : last] @ flat[:, k - 1 : last]
            np.add(at * y[:, k], known[:, 0].view(complex), out=y[:, k - 1])
    return y, at * y[:, 0] + _product(rows[:, :1], y)[:, 0]


def _product(factor: Array, values: Complex) -> Complex:
    """factor (m, a, b) @ values (m, b, lines), also where the factor is real."""
    return factor @ values if np.iscomplexobj(factor) else real_product(factor, values)
