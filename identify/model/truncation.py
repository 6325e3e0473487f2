"""What FRFs look like whose records ended before the response had died out, and the exact sensitivities of
that.

A record of length T, begun by the impact, sees the impulse response only up to T.  What it ends with, the
displacement x(T) and velocity v(T), is missing from the transform:

    Z(s) X = F - e^(-sT) ((s M + C) x(T) + M v(T)),   H_k = s^k X + e^(-sT) (s^(k-1) x(T) + s^(k-2) v(T))

with k = 0, 1, 2 for displacement, velocity and acceleration; terms with negative powers of s do not exist.
An exponential window makes the difference small: e^-5 of H at a resonance of 10 Hz with 2 % damping after 1.6
s with a window of 2 / s.  A motion that grows faster than the window decays, such as that of a negative mass,
has no transform at s, and is left out: where a little mass was moved about on a link that bends until some
section has less than none, the FRFs in the band do not know it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Mask, real_product
from identify.model.modes import state_eigen
from identify.model.system import Factors

NEGLIGIBLE = 1e-4
"""Size of what is missing relative to H, at a resonance, below which it is not computed."""


class TruncationCorrection(Protocol):
    """What a model's force lacks of a unit force and its motion has besides, line by line, and what both do
    to derivatives.
    """

    def load(self, mass: Array, damping: Array, s: Complex) -> Complex:
        """(lines, n, inputs): what is taken off the force."""

    def motion(self, s: Complex, power: int) -> Complex | float:
        """(lines, n, inputs): what is added to s^power X."""

    def gradient(
        self, matrices: tuple[Array, Array, Array], s: Complex, to_out: Complex, power: int
    ) -> Complex:
        """(lines, outputs, inputs, p): what H changes by as load and motion do; to_out (lines, outputs, n) is
        S Z^-1.
        """


@dataclass(frozen=True)
class EndOfRecord:
    """Where a unit impact at each input has led after `record` seconds: x, v (n, inputs); slopes (2, n,
    inputs, p) of both by parameters; modes: by which it went there, unless it was simulated.
    """

    record: float
    x: Array
    v: Array
    slopes: Array
    modes: SlowModes | None = None

    def under(self, force: Array) -> EndOfRecord:
        """The same of other forces (n, inputs), without slopes."""
        assert self.modes is not None
        _, x, v = self.modes.led(force)
        return EndOfRecord(self.record, x, v, np.zeros((2, *x.shape, 0)), self.modes)

    def load(self, mass: Array, damping: Array, s: Complex) -> Complex:
        """(lines, n, inputs): what is taken off the force."""
        line = s[:, None, None]
        return np.asarray(np.exp(-line * self.record) * ((line * mass + damping) @ self.x + mass @ self.v))

    def motion(self, s: Complex, power: int) -> Complex | float:
        """(lines, n, inputs): what is added to s^power X."""
        line = s[:, None, None]
        if power == 0:
            return 0.0
        return np.asarray(np.exp(-line * self.record) * (self.x if power == 1 else line * self.x + self.v))

    def shortened(self, matrices: tuple[Array, Array, Array], s: Complex, out: Array, power: int) -> Complex:
        """(lines, outputs, inputs): derivative of H by how much earlier the record ends."""
        mass, damping, stiffness = matrices
        last = (
            -np.linalg.solve(mass, damping @ self.v + stiffness @ self.x)
            if power == 2
            else (self.x, self.v)[power]
        )
        return np.asarray(-np.exp(-s * self.record)[:, None, None] * (out @ last))

    def slope(
        self, mass: Array, damping: Array, s: Complex, out: Array, to_out: Complex, power: int
    ) -> Complex:
        """(lines, outputs, inputs): derivative with respect to s of what the ending does to H."""
        line = s[:, None, None]
        change = line**power * (
            to_out @ (self.record * ((line * mass + damping) @ self.x + mass @ self.v) - mass @ self.x)
        )
        if power == 1:
            change = change - self.record * (out @ self.x)
        if power == 2:
            change = change + out @ (self.x - self.record * (line * self.x + self.v))
        return np.asarray(np.exp(-line * self.record) * change)

    def gradient(
        self, matrices: tuple[Array, Array, Array], s: Complex, to_out: Complex, power: int
    ) -> Complex:
        """(lines, outputs, inputs, p): what H changes by as x(T) and v(T) do; to_out (lines, outputs, n) is S
        Z^-1.
        """
        moved = to_out @ self.driving(matrices, s, power)
        return np.asarray(moved.reshape(*to_out.shape[:2], *self.slopes.shape[2:]))

    def driving(self, matrices: tuple[Array, Array, Array], s: Complex, power: int) -> Complex:
        """(lines, n, inputs * p): forces that move as much as changes of x(T) and v(T) change H.

        Those that s^(k-1) x(T) + s^(k-2) v(T) would take, less s^k times what is missing from the load.
        """
        mass, damping, stiffness = matrices
        x, v = self.slopes.reshape(2, len(mass), -1)
        line = s[:, None, None]
        if power == 0:
            load = -line * (mass @ x) - (damping @ x + mass @ v)
        elif power == 1:
            load = stiffness @ x - line * (mass @ v)
        else:
            load = stiffness @ v + line * (stiffness @ x + damping @ v)
        return np.asarray(np.exp(-line * self.record) * load)


def _outlasts(eigenvalues: Complex, s: Complex, record: float | Array) -> tuple[Array, Mask, Mask]:
    """How fast motions with eigenvalues (..., r) grow as seen through the window that s (..., lines) implies,
    (..., r), 1/s; whether they last beyond records (...), (..., 1); and which of them grow, (..., r), and do
    not count.
    """
    growth = eigenvalues.real - s.real.min(axis=-1)[..., None]
    grows = growth >= 0
    slowest = np.max(growth, axis=-1, where=~grows, initial=-np.inf)[..., None]
    lasts = slowest * np.asarray(record).real[..., None] > np.log(NEGLIGIBLE)
    return growth, np.asarray(lasts), np.asarray(grows)


def left_at_end(eigenvalues: Complex, s: Complex, record: float | Array) -> Complex:
    """e^(lambda T) of motions with eigenvalues (..., r), (..., r), at the ends of records (...); zero where
    the model does not outlast the record, where they grow, and where what is left is less than rounding.
    """
    growth, lasts, grows = _outlasts(eigenvalues, s, record)
    record = np.asarray(record)[..., None]
    kept = lasts & ~grows & (growth * record > np.log(np.finfo(float).eps))
    return np.asarray(kept * np.exp(np.where(kept, eigenvalues, 0.0) * record))


def end_of_record(
    matrices: tuple[Array, Array, Array],
    factors: Factors,
    s: Complex,
    force: Array,
    record: float,
    parameters: NDArray[np.intp],
) -> EndOfRecord | None:
    """The ending with its slopes for the parameters whose numbers are given; None where the response has died
    out.
    """
    modes = _slow_modes(matrices, s, record)
    if modes is None:
        return None
    participation, x, v = modes.led(force)
    columns = factors.columns(parameters)
    owned = (factors.owner[columns, None] == parameters).astype(float)
    slopes = [_slopes(modes, participation, record, factors, columns, rate) for rate in (0, 1)]
    by_owner = [(modes.shapes @ slope).real.reshape(*x.shape, -1) @ owned for slope in slopes]
    return EndOfRecord(record, x, v, np.array(by_owner), modes)


@dataclass(frozen=True)
class SlowModes:
    """The modes of a model whose response outlasts the record: eigenvalues (r,), what is left of them (r,),
    shapes (n, r) and their norms (r,).
    """

    eigenvalues: Complex
    left: Complex
    shapes: Complex
    norm: Complex

    def led(self, force: Array) -> tuple[Complex, Array, Array]:
        """Participation (r, inputs) of unit impacts by force (n, inputs), and where they have led, x, v (n,
        inputs).
        """
        participation = self.shapes.T @ force / self.norm[:, None]
        decayed = self.left[:, None] * participation
        moved = self.shapes @ np.concatenate([decayed, self.eigenvalues[:, None] * decayed], axis=1)
        x, v = np.split(moved.real, 2, axis=1)
        return participation, x, v


def _slow_modes(matrices: tuple[Array, Array, Array], s: Complex, record: float) -> SlowModes | None:
    """None where the response has died out."""
    mass, damping, _ = matrices
    eigenvalues, shapes = state_eigen(*matrices)
    left = left_at_end(eigenvalues, s, record)
    if not left.any():
        return None
    norm = np.sum(shapes * (2 * eigenvalues * (mass @ shapes) + damping @ shapes), axis=0)
    return SlowModes(eigenvalues, left, shapes, norm)


def _slopes(
    modes: SlowModes,
    participation: Complex,
    record: float,
    factors: Factors,
    columns: NDArray[np.intp],
    rate: int,
) -> Complex:
    """Derivatives (modes, inputs * columns) of the modal parts of x(T), or of v(T) with rate 1, for unit
    changes of Z by each column.

    x(T) is the integral of e^(zT) Z(z)^-1 F / 2 pi j around all eigenvalues; so its change is minus the sum
    over pairs of modes of residues times the divided difference of z^(k + rate) e^(zT), with k the power of s
    of the column.
    """
    eigenvalues, shapes, norm = modes.eigenvalues, modes.shapes, modes.norm
    result = np.zeros((len(eigenvalues), participation.shape[1], len(columns)), dtype=complex)
    for k in np.unique(factors.power[columns]):
        chosen = columns[factors.power[columns] == k]
        divided = _divided(eigenvalues, modes.left, record, k + rate)
        modal = shapes.T @ factors.vectors[:, chosen]
        driven = divided @ (participation[:, :, None] * modal[:, None, :]).reshape(len(eigenvalues), -1)
        driven = driven.reshape(-1, participation.shape[1], len(chosen))
        result[..., factors.power[columns] == k] = (
            -driven * (modal / norm[:, None] * factors.weight[chosen])[:, None, :]
        )
    return result.reshape(len(eigenvalues), -1)


def end_by_matrices(
    matrices: tuple[Array, Array, Array],
    s: Complex,
    force: Array,
    record: float,
    mass_changes: Array,
    stiffness_changes: Array,
) -> EndOfRecord | None:
    """`end_of_record` with slopes for changes (q, n, n) of M and, the same ones, of K."""
    modes = _slow_modes(matrices, s, record)
    if modes is None:
        return None
    participation, x, v = modes.led(force)
    eigenvalues, left, shapes, norm = modes.eigenvalues, modes.left, modes.shapes, modes.norm
    # Of a conjugate pair, which only a real system has, one says what both do.
    upper = np.flatnonzero(eigenvalues.imag >= 0)
    twice = np.where(eigenvalues.imag > 0, 2.0, 1.0)[upper]
    sides = np.ascontiguousarray(shapes[:, upper].T / norm[upper, None])
    slopes = np.zeros((2, len(mass_changes), len(upper), force.shape[1]), dtype=complex)
    for power, changes in ((0, stiffness_changes), (2, mass_changes)):
        change = sides @ real_product(changes.reshape(-1, len(shapes)), shapes).reshape(
            changes.shape[:2] + eigenvalues.shape
        )
        for rate in (0, 1):
            slopes[rate] -= (
                _divided(eigenvalues, left, record, power + rate)[upper] * change
            ) @ participation
    return EndOfRecord(record, x, v, np.moveaxis((shapes[:, upper] * twice @ slopes).real, 1, -1), modes)


def _divided(eigenvalues: Complex, left: Complex, record: float, order: int) -> Complex:
    """(r, r): divided differences of z^order e^(zT), of which so much is left, over pairs of eigenvalues."""
    apart = eigenvalues[:, None] - eigenvalues
    near = np.abs(apart) <= 1e-7 * np.maximum(np.abs(eigenvalues), 1.0 / record)
    value = eigenvalues**order * left
    tangent = record * value + order * eigenvalues ** max(order - 1, 0) * left
    return np.asarray(np.where(near, tangent[:, None], (value[:, None] - value) / np.where(near, 1.0, apart)))


def rest_by_exponential(
    mass: Array,
    damping: Array,
    stiffness: Array,
    s: Complex,
    out: Array,
    force: Array,
    power: int,
    record: float | Array,
) -> Complex:
    """What is missing from H (..., lines, outputs, inputs), for a population (..., n, n) and its records
    (...), by matrix exponentials: defective systems too.
    """
    size, record = mass.shape[-1], np.asarray(record)
    lower = -np.linalg.solve(mass, np.concatenate([stiffness, damping], axis=-1))
    upper = np.broadcast_to(np.eye(size, 2 * size, size), lower.shape)
    state = np.concatenate([upper, lower], axis=-2)
    _, lasts, grows = _outlasts(np.linalg.eigvals(state), s, record)
    lasts, some = lasts[..., None], np.asarray(grows.any(axis=-1))
    propagator = scipy.linalg.expm(record[..., None, None] * (lasts & ~some[..., None, None]) * state)
    bound, each = np.broadcast_to(s.real.min(axis=-1), some.shape), np.broadcast_to(record, some.shape)
    for one in map(tuple, np.argwhere(some)):
        propagator[one] = _of_decaying(state[one], bound[one], each[one])
    moved = lasts * propagator[..., size:] @ np.linalg.solve(mass, force)
    x, v = moved[..., :size, :], moved[..., size:, :]
    line = s[..., None, None]
    m, c, k, x, v = (matrix[..., None, :, :] for matrix in (mass, damping, stiffness, x, v))
    free = line**power * np.linalg.solve(k + line * c + line**2 * m, (line * m + c) @ x + m @ v)
    missing = free - (0.0, x, line * x + v)[power]
    return np.asarray(np.exp(-line * record[..., None, None, None]) * (out @ missing))


def _of_decaying(state: Array, bound: float, record: float) -> Array:
    """e^(AT) (2n, 2n) of a state matrix A without the motions whose eigenvalues lie at the bound or beyond:
    the Schur form splits what decays from what grows (Bavely and Stewart, SIAM J. Numer. Anal. 16 (1979)
    359-367).
    """
    form, basis, count = scipy.linalg.schur(state, "complex", sort=lambda value: value.real < bound)
    decays, grows, between = form[:count, :count], form[count:, count:], form[:count, count:]
    apart = scipy.linalg.solve_sylvester(decays, -grows, -between)
    left, right = basis[:, :count], basis[:, :count].conj().T - apart @ basis[:, count:].conj().T
    with np.errstate(over="ignore", invalid="ignore"):  # beyond all numbers: no candidate for any fit
        return np.asarray((left @ scipy.linalg.expm(record * decays) @ right).real)
