"""Springs by their compliance: a rigid joint is a compliance of zero, an ordinary point with finite slopes.

A Kelvin-Voigt spring moves by z = d(s) times the force f that it carries, d = c / (1 + tau s), with compliance
c >= 0 and retardation time tau (damping over stiffness).  With Z the dynamic stiffness of all else,

    G = D (I + Z D)^-1,   H = s^p S G B,   dH/dd_j = s^p (S - S G Z)_j (B - Z G B)_j:

what a unit of the released motion does to the sensors times the force that the spring carries.  Nothing is
divided by c: rigid coordinates are left out of the solve, soft ones are scaled by the root of c,
(A s^2 + (C + diag tau) s + K + I) y, so that any mixture of soft and stiff keeps its digits.

What records that end after T seconds lack is a sum over the slow poles, whose residues and slopes (second order
poles of dG = L dD L') follow from the constant term G_0 of G at each pole, by a bordered solve (Nelson, AIAA J. 14
(1976) 1201-1205).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.model.compliances import Compliances
from identify.model.truncation import left_at_end


class Pole(NamedTuple):
    """A slow pole: eigenvalue, shape (a,), what it has in outputs (o,) and inputs (i,), its norm, and S G_0 (o, a),
    G_0 B (a, i).
    """

    eigenvalue: complex
    shape: Complex
    seen: Complex
    driven: Complex
    norm: complex
    out: Complex
    force: Complex


@dataclass(frozen=True)
class Response:
    """A model with such springs under unit forces.

    All in the basis (n, n) of springs (first r) and other coordinates; moved (lines, n, i), transfer (lines, o, n):
    G B and S G; force (lines, r, i), out (lines, o, r): what springs carry, and what their release does; poles that
    outlast the record.
    """

    basis: Array
    root: Array
    matrices: tuple[Array, Array, Array]
    s: Complex
    power: int
    record: float | None
    ends: tuple[Array, Array]
    moved: Complex
    transfer: Complex
    springs: Compliances
    compliance: Array
    retardation: Array
    poles: tuple[Pole, ...]

    @property
    def active(self) -> Index:
        """Numbers of what moves, in the basis."""
        return np.flatnonzero(self.root)

    @cached_property
    def late(self) -> Complex:
        """(lines, poles): lambda^p e^((lambda - s) T) / (s - lambda)."""
        values = np.array([pole.eigenvalue for pole in self.poles])
        away = self.s[:, None] - values
        return np.asarray(values**self.power * np.exp(-away * (self.record or 0.0)) / away)

    def motion(self, power: int) -> Complex:
        """(lines, n, inputs): s^power times the transform of the coordinates q, of the record as it ends."""
        return np.asarray(self.basis @ self._motion(power))

    def _motion(self, power: int) -> Complex:
        """The same in the basis."""
        moved = (self.s**power)[:, None, None] * self.moved
        if self.poles:
            values = np.array([pole.eigenvalue for pole in self.poles])
            late = self.late * values ** (power - self.power)
            residue = [np.outer(pole.shape, pole.driven) / pole.norm for pole in self.poles]
            active = self.active
            tail = np.tensordot(late, np.array(residue), axes=1) * self.root[active][:, None]
            moved[:, active] -= tail
        return np.asarray(moved)

    @property
    def to_out(self) -> Complex:
        """S G (lines, outputs, n) over the coordinates q."""
        return np.asarray(self.transfer @ self.basis.T)

    def h(self) -> Complex:
        """(lines, outputs, inputs)."""
        return np.asarray(self.ends[0] @ self._motion(self.power))


def respond(
    springs: Compliances,
    values: Array,
    matrices: tuple[Array, Array, Array],
    s: Complex,
    out: Array,
    force: Array,
    power: int,
    record: float | None,
) -> Response:
    """The response of matrices (M, C, K, without these springs) at values (parameters,) and s (lines,); out
    (outputs, n), force (n, inputs); record: its length after the impact, s, or None.
    """
    size, c_tau = len(matrices[0]), springs.at(values)
    compliance, tau = c_tau
    basis = np.concatenate([springs.columns, np.eye(size)[:, springs.others]], axis=1)
    mass, damping, stiffness = (basis.T @ matrix @ basis for matrix in matrices)
    count = len(compliance)
    root = np.concatenate([np.sqrt(compliance), np.ones(size - count)])
    active = np.flatnonzero(root)
    of_spring = (active < count).astype(float)
    scaled = [root[active, None] * matrix[np.ix_(active, active)] * root[active] for matrix in (mass, damping, stiffness)]
    scaled[1] = scaled[1] + np.diag(of_spring * np.append(tau, np.zeros(size - count))[active])
    scaled[2] = scaled[2] + np.diag(of_spring)
    ends = out @ basis, basis.T @ force
    load, seen = root[active, None] * ends[1][active], ends[0][:, active] * root[active]
    line = s[:, None, None]
    z = scaled[2] + line * scaled[1] + line**2 * scaled[0]
    both = np.concatenate([load, seen.T], axis=1).astype(complex)
    solved = root[active, None] * np.linalg.solve(z, np.broadcast_to(both, (len(s), *both.shape)))
    inputs = force.shape[1]
    moved = np.zeros((len(s), size, inputs), dtype=complex)
    transfer = np.zeros((len(s), len(out), size), dtype=complex)
    moved[:, active], transfer[:, :, active] = solved[..., :inputs], np.swapaxes(solved[..., inputs:], 1, 2)
    poles = () if record is None else _poles(scaled, s, seen, load, record)
    every = (mass, damping, stiffness)
    return Response(basis, root, every, s, power, record, ends, moved, transfer, springs, compliance, tau, poles)


def _poles(scaled: list[Array], s: Complex, seen: Array, load: Array, record: float) -> tuple[Pole, ...]:
    """Those that outlast the record as the window lets it see them: by the inverse of the eigenvalues, whose largest
    are theirs, so that a mass of nothing does no harm.
    """
    mass, damping, stiffness = scaled
    size = len(mass)
    lower = -np.linalg.solve(stiffness, np.concatenate([damping, mass], axis=1))
    inverse, states = np.linalg.eig(np.concatenate([lower, np.eye(size, 2 * size)]))
    some = np.abs(inverse) > 1e-8 * np.abs(inverse).max()
    eigenvalues, shapes = 1.0 / inverse[some], states[size:, some]
    left = left_at_end(eigenvalues, s, record)
    return tuple(
        _pole(eigenvalues[n], shapes[:, n], scaled, seen, load) for n in np.flatnonzero(np.abs(left) > 0)
    )


def _pole(eigenvalue: complex, shape: Complex, scaled: list[Array], seen: Array, load: Array) -> Pole:
    mass, damping, stiffness = scaled
    shape = shape / np.linalg.norm(shape)
    z = stiffness + eigenvalue * damping + eigenvalue**2 * mass
    slope, curve = damping + 2 * eigenvalue * mass, 2 * mass
    norm = shape @ slope @ shape
    border = np.conj(shape)
    bordered = np.block([[z, border[:, None]], [border[None], np.zeros((1, 1))]])
    both = np.concatenate([load, seen.T], axis=1).astype(complex)
    residue = np.outer(shape, shape @ both) / norm
    right = np.concatenate([both - slope @ residue, np.zeros((1, both.shape[1]))])
    found = np.linalg.solve(bordered, right)[:-1]
    found -= np.outer(shape, (shape @ slope @ found + 0.5 * (shape @ curve @ residue)) / norm)
    inputs = load.shape[1]
    return Pole(
        complex(eigenvalue), shape, seen @ shape, shape @ load, complex(norm), found[:, inputs:].T, found[:, :inputs]
    )


class Slopes(NamedTuple):
    """Change of G by some scalars: factor (lines, k) and, at each pole, its value and derivative (poles, k, 2); and
    what stands to its left (lines, o, k) and right (lines, k, i), with the same at each pole: residues (poles, o, k),
    (poles, k, i) and constant terms.
    """

    factor: Complex
    at_poles: Complex
    left: Complex
    right: Complex
    left_poles: tuple[Complex, Complex]
    right_poles: tuple[Complex, Complex]


def by_columns(model: Response, vectors: Array, power: Index, weight: Array | Complex) -> Slopes:
    """Of dZ = weight s^power a a' with vectors a (n, k) over the coordinates q."""
    own = model.basis.T @ vectors
    left, right = -(model.transfer @ own), own.T @ model.moved
    factor = weight * model.s[:, None] ** power
    values = np.array([pole.eigenvalue for pole in model.poles]).reshape(-1, 1)
    at_poles = np.stack([weight * values**power, weight * power * values ** np.maximum(power - 1, 0)], axis=-1)
    active = model.active
    scaled = own[active] * model.root[active, None]
    part = [scaled.T @ pole.shape / pole.norm for pole in model.poles]
    poles = list(zip(model.poles, part, strict=True))
    return Slopes(
        factor,
        at_poles,
        left,
        right,
        (_stack([-np.outer(p.seen, a) for p, a in poles]), _stack([-p.out @ scaled for p, _ in poles])),
        (_stack([np.outer(a, p.driven) for p, a in poles]), _stack([scaled.T @ p.force for p, _ in poles])),
    )


def by_springs(model: Response) -> tuple[Slopes, Slopes]:
    """Of every column of the springs, by compliance and by retardation time."""
    count, active = len(model.compliance), model.active
    mass, damping, stiffness = (matrix[:count][:, active] for matrix in model.matrices)
    line = model.s[:, None, None]
    z = stiffness + line * damping + line**2 * mass
    right = model.ends[1][:count] - z @ model.moved[:, active]
    left = model.ends[0][:, :count] - model.transfer[:, :, active] @ np.swapaxes(z, 1, 2)
    scale = model.root[active]
    lefts, rights = ([], []), ([], [])
    for pole in model.poles:
        here, value = pole.eigenvalue, np.asarray
        own = (stiffness + here * damping + here**2 * mass) * scale
        turned = (damping + 2 * here * mass) * scale
        part, slope = own @ pole.shape / pole.norm, turned @ pole.shape / pole.norm
        lefts[0].append(-np.outer(pole.seen, part))
        lefts[1].append(value(model.ends[0][:, :count] - pole.out @ own.T - np.outer(pole.seen, slope)))
        rights[0].append(-np.outer(part, pole.driven))
        rights[1].append(value(model.ends[1][:count] - own @ pole.force - np.outer(slope, pole.driven)))
    values = np.array([pole.eigenvalue for pole in model.poles]).reshape(-1, 1)
    sides = (left, right, (_stack(lefts[0]), _stack(lefts[1])), (_stack(rights[0]), _stack(rights[1])))
    c, tau = model.compliance, model.retardation

    def of(s: Complex) -> tuple[Complex, Complex, Complex, Complex]:
        soft = 1 / (1 + tau * s)
        return soft, -tau * soft**2, -c * s * soft**2, -c * soft**2 + 2 * c * s * tau * soft**3

    lines, poles = of(model.s[:, None]), of(values)
    return (
        Slopes(lines[0], np.stack(poles[:2], axis=-1), *sides),
        Slopes(lines[2], np.stack(poles[2:], axis=-1), *sides),
    )


def _stack(parts: list[Complex]) -> Complex:
    return np.array(parts, dtype=complex)


def gradient(model: Response, slopes: Slopes, owner: Index, count: int) -> Complex:
    """dH (lines, outputs, inputs, count) of columns (k,) summed by owner; one whose owner is negative is left out."""
    lines, outputs, inputs = len(model.s), len(model.ends[0]), model.ends[1].shape[1]
    result = np.zeros((lines, outputs, inputs, count), dtype=complex)
    left = (model.s**model.power)[:, None, None] * slopes.left * slopes.factor[:, None]
    for column in np.flatnonzero(owner >= 0):
        result[..., owner[column]] += left[:, :, column, None] * slopes.right[:, column, None]
    if not model.poles:
        return result
    late, values = model.late, np.array([pole.eigenvalue for pole in model.poles])
    double = np.einsum("rok,rki->roik", slopes.left_poles[0], slopes.right_poles[0])
    single = np.einsum("rok,rki->roik", slopes.left_poles[0], slopes.right_poles[1])
    single += np.einsum("rok,rki->roik", slopes.left_poles[1], slopes.right_poles[0])
    value, change = (slopes.at_poles[..., n][:, None, None] for n in (0, 1))
    outlast = (model.power / values + (model.record or 0.0))[:, None, None, None]
    steady, steep = (outlast * value + change) * double + value * single, value * double
    each = np.concatenate([late, late / (model.s[:, None] - values)], axis=1)
    tail = np.tensordot(each, np.concatenate([steady, steep]), axes=1)
    for column in np.flatnonzero(owner >= 0):
        result[..., owner[column]] -= tail[..., column]
    return result


def shortened(model: Response) -> Complex:
    """(lines, outputs, inputs): derivative of H by how much earlier the record ends."""
    if not model.poles:
        return np.zeros((len(model.s), len(model.ends[0]), model.ends[1].shape[1]), dtype=complex)
    values = np.array([pole.eigenvalue for pole in model.poles])
    residue = _stack([np.outer(pole.seen, pole.driven) / pole.norm for pole in model.poles])
    return np.asarray(-np.tensordot(model.late * (model.s[:, None] - values), residue, axes=1))
