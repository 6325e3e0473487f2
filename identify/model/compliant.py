"""Springs by their compliance: a rigid joint is a compliance of zero, an ordinary point with finite slopes.

A Kelvin-Voigt spring moves by z = d(s) times the force f that it carries, d = c / (1 + tau s), with
compliance c >= 0 and retardation time tau (damping over stiffness).  With Z the dynamic stiffness of all
else,

    G = D (I + Z D)^-1,   H = s^p S G B,   dH/dd_j = s^p (S - S G Z)_j (B - Z G B)_j:

what a unit of the released motion does to the sensors times the force that the spring carries.  Nothing is
divided by c: rigid coordinates are left out of the solve, soft ones are scaled by the root of c, (A s^2 +
(C + diag tau) s + K + I) y, so that any mixture of soft and stiff keeps its digits.

What records that end after T seconds lack is a sum over the slow poles, whose residues and slopes (second
order poles of dG = L dD L') follow from the constant term G_0 of G at each pole, by a bordered solve
(Nelson, AIAA J. 14 (1976) 1201-1205).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Complex, Index, Mask, product_by_real, real_product
from identify.model.compliances import Compliances
from identify.model.truncation import left_at_end


class Pole(NamedTuple):
    """A slow pole: eigenvalue, shape (a,), what it has in outputs (o,) and inputs (i,), its norm, and S
    G_0 (o, a), G_0 B (a, i).
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

    All in the basis (q, n) of springs (first r, which may lie between coordinates) and other coordinates;
    moved (lines, n, i), transfer (lines, o, n): G B and S G; force (lines, r, i), out (lines, o, r): what
    springs carry, and what their release does; poles that outlast the record.
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
    compliance: Array
    retardation: Array
    poles: tuple[Pole, ...]

    @property
    def active(self) -> Index:
        """Numbers of what moves, in the basis."""
        return np.flatnonzero(self.root)

    @cached_property
    def eigenvalues(self) -> Complex:
        """(poles,); of a conjugate pair the one above the real axis."""
        return np.array([pole.eigenvalue for pole in self.poles], dtype=complex)

    @cached_property
    def residues(self) -> Complex:
        """(poles, outputs, inputs)."""
        return _stack([np.outer(pole.seen, pole.driven) / pole.norm for pole in self.poles])

    def late(self, eigenvalues: Complex, power: int | None = None) -> Complex:
        """(lines, poles): lambda^p e^((lambda - s) T) / (s - lambda)."""
        away = self.s[:, None] - eigenvalues
        own = self.power if power is None else power
        return np.asarray(eigenvalues**own * np.exp(-away * (self.record or 0.0)) / away)

    def steep(self, eigenvalues: Complex) -> Complex:
        """(lines, poles): `late` over s - lambda."""
        return np.asarray(self.late(eigenvalues) / (self.s[:, None] - eigenvalues))

    def summed(self, *terms: tuple[Complex, Callable[[Complex], Complex]]) -> Complex:
        """Sum over poles, conjugate ones too, of parts (poles, ...) times what a function makes of
        eigenvalues, (lines, poles), for each pair of these: one real product, because a x + b conj(x) =
        (a + b) Re x + j (a - b) Im x.
        """
        upper = self.eigenvalues.imag > 0
        sides = [(of(self.eigenvalues), of(np.conj(self.eigenvalues)) * upper) for _, of in terms]
        factors = [side for a, b in sides for side in (a + b, 1j * (a - b))]
        flat = [part for parts, _ in terms for part in (parts.real, parts.imag)]
        rows = np.concatenate([one.reshape(len(one), -1) for one in flat])
        found = product_by_real(np.concatenate(factors, axis=1), rows)
        return np.asarray(found.reshape(len(self.s), *terms[0][0].shape[1:]))

    def motion(self, power: int) -> Complex:
        """(lines, n, inputs): s^power times the transform of the coordinates q, of the record as it ends."""
        return np.asarray(self.basis @ self._motion(power))

    def _motion(self, power: int) -> Complex:
        """The same in the basis."""
        moved = (self.s**power)[:, None, None] * self.moved
        if self.poles:
            residue = _stack([np.outer(pole.shape, pole.driven) / pole.norm for pole in self.poles])
            tail = self.summed((residue, lambda values: self.late(values, power)))
            moved[:, self.active] -= tail * self.root[self.active][:, None]
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
    compliance, tau = springs.at(values)
    basis = np.concatenate([springs.columns, np.eye(len(matrices[0]))[:, springs.others]], axis=1)
    mass, damping, stiffness = (basis.T @ matrix @ basis for matrix in matrices)
    count, size = len(compliance), basis.shape[1]
    root = np.concatenate([np.sqrt(compliance), np.ones(size - count)])
    active = np.flatnonzero(root)
    of_spring = (active < count).astype(float)
    scaled = [
        root[active, None] * matrix[np.ix_(active, active)] * root[active]
        for matrix in (mass, damping, stiffness)
    ]
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
    return Response(basis, root, every, s, power, record, ends, moved, transfer, compliance, tau, poles)


def _poles(scaled: list[Array], s: Complex, seen: Array, load: Array, record: float) -> tuple[Pole, ...]:
    """Those that outlast the record as the window lets it see them: by the inverse of the eigenvalues,
    whose largest are theirs, so that a mass of nothing does no harm.
    """
    mass, damping, stiffness = scaled
    size = len(mass)
    lower = -np.linalg.solve(stiffness, np.concatenate([damping, mass], axis=1))
    inverse, states = np.linalg.eig(np.concatenate([lower, np.eye(size, 2 * size)]))
    some = np.abs(inverse) > 1e-8 * np.abs(inverse).max()
    eigenvalues, shapes = 1.0 / inverse[some], states[size:, some]
    left = left_at_end(eigenvalues, s, record)
    return tuple(
        _pole(eigenvalues[n], shapes[:, n], scaled, seen, load)
        for n in np.flatnonzero((np.abs(left) > 0) & (eigenvalues.imag >= 0))
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
        complex(eigenvalue),
        shape,
        seen @ shape,
        shape @ load,
        complex(norm),
        found[:, inputs:].T,
        found[:, :inputs],
    )


class Slopes(NamedTuple):
    """Change of G by some scalars: factor (lines, k) and, at each pole, its value and derivative (poles,
    k, 2); and what stands to its left (lines, o, k) and right (lines, k, i), with the same at each pole:
    residues (poles, o, k), (poles, k, i) and constant terms.
    """

    factor: Complex
    at_poles: Complex
    left: Complex
    right: Complex
    left_poles: tuple[Complex, Complex]
    right_poles: tuple[Complex, Complex]

    def of(self, kept: Mask) -> Slopes:
        """Those of some columns (k,)."""
        lefts, rights = self.left_poles, self.right_poles
        return Slopes(
            self.factor[:, kept],
            self.at_poles[:, kept],
            self.left[..., kept],
            self.right[:, kept],
            (lefts[0][..., kept], lefts[1][..., kept]) if len(lefts[0]) else lefts,
            (rights[0][:, kept], rights[1][:, kept]) if len(rights[0]) else rights,
        )


def by_columns(model: Response, vectors: Array, power: Index, weight: Array | Complex) -> Slopes:
    """Of dZ = weight s^power a a' with vectors a (n, k) over the coordinates q."""
    own = model.basis.T @ vectors
    left, right = -(model.transfer @ own), own.T @ model.moved
    factor = weight * model.s[:, None] ** power
    values = model.eigenvalues.reshape(-1, 1)
    at_poles = np.stack(
        [weight * values**power, weight * power * values ** np.maximum(power - 1, 0)], axis=-1
    )
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
    moved, seen = model.moved[:, active], np.swapaxes(model.transfer[:, :, active], 1, 2)
    line, both = model.s[:, None, None], np.concatenate([moved, seen], axis=2)
    held = stiffness @ both + line * real_product(damping, both)  # hysteresis makes it complex
    held += line**2 * real_product(mass, both)
    right = model.ends[1][:count] - held[..., : moved.shape[2]]
    left = model.ends[0][:, :count] - np.swapaxes(held[..., moved.shape[2] :], 1, 2)
    scale = model.root[active]
    lefts: tuple[list[Complex], list[Complex]] = ([], [])
    rights: tuple[list[Complex], list[Complex]] = ([], [])
    for pole in model.poles:
        here, value = pole.eigenvalue, np.asarray
        own = (stiffness + here * damping + here**2 * mass) * scale
        turned = (damping + 2 * here * mass) * scale
        part, slope = own @ pole.shape / pole.norm, turned @ pole.shape / pole.norm
        lefts[0].append(-np.outer(pole.seen, part))
        lefts[1].append(value(model.ends[0][:, :count] - pole.out @ own.T - np.outer(pole.seen, slope)))
        rights[0].append(-np.outer(part, pole.driven))
        rights[1].append(value(model.ends[1][:count] - own @ pole.force - np.outer(slope, pole.driven)))
    values = model.eigenvalues.reshape(-1, 1)
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


def add_gradient(into: Complex, model: Response, slopes: Slopes, owner: Index) -> None:
    """Adds dH of columns (k,) to that of their owners in `into` (lines, outputs, inputs, owners); one whose
    owner is negative is left out.
    """
    kept = owner >= 0
    own, owner = slopes.of(kept), owner[kept]
    left = (model.s**model.power)[:, None, None] * own.left * own.factor[:, None]
    found = left[:, :, None, :] * np.swapaxes(own.right, 1, 2)[:, None]
    if model.poles:
        found -= _tail(model, own)
    first = np.unique(owner, return_index=True)[1]
    into[..., owner[first]] += found[..., first]
    for column in np.setdiff1d(np.arange(len(owner)), first):
        into[..., owner[column]] += found[..., column]


def by_matrices(model: Response, changes: dict[int, Array]) -> Complex:
    """dH (lines, outputs, inputs, k) of dZ = sum over powers of s^power times matrices (k, n, n) over the
    coordinates q: for what has many columns, such as the moments of a body.
    """
    own = {
        power: model.basis.T @ matrices @ model.basis for power, matrices in changes.items() if matrices.any()
    }
    count = len(next(iter(changes.values())))
    lines, size, inputs = model.moved.shape
    load = np.zeros((lines, count * size, inputs), dtype=complex)
    for power, matrices in own.items():
        load += (model.s**power)[:, None, None] * real_product(matrices.reshape(-1, size), model.moved)
    load = load.reshape(lines, count, size, inputs).transpose(0, 2, 3, 1).reshape(lines, size, -1)
    found = -(model.s**model.power)[:, None, None] * (model.transfer @ load)
    found = found.reshape(lines, -1, inputs, count)
    return found - _tail_of_matrices(model, own, count) if model.poles else found


def _tail_of_matrices(model: Response, changes: dict[int, Array], count: int) -> Complex:
    """(lines, outputs, inputs, k)."""
    size, active, single, double = len(model.basis.T), model.active, [], []
    for pole in model.poles:
        shape = np.zeros(size, dtype=complex)
        shape[active] = model.root[active] * pole.shape
        pushed, slope = np.zeros((count, size), dtype=complex), np.zeros((count, size), dtype=complex)
        for power, matrices in changes.items():
            moved = matrices @ shape
            pushed += pole.eigenvalue**power * moved
            slope += power * pole.eigenvalue ** max(power - 1, 0) * moved
        both = np.outer(pole.seen, pole.driven)[..., None] / pole.norm**2
        out = (pole.out * model.root[active]) @ pushed[:, active].T
        force = pushed[:, active] @ (model.root[active, None] * pole.force)
        double.append(-both * (pushed @ shape))
        single.append(
            -both * (slope @ shape)
            - (pole.seen[:, None, None] * force.T + out[:, None] * pole.driven[:, None]) / pole.norm
        )
    values, steep = model.eigenvalues, _stack(double)
    outlast = (model.power / values + (model.record or 0.0))[:, None, None, None]
    return model.summed((outlast * steep + _stack(single), model.late), (steep, model.steep))


def _tail(model: Response, slopes: Slopes) -> Complex:
    """(lines, outputs, inputs, k): what the part beyond the end of the record changes by."""
    values = model.eigenvalues
    lefts, rights = slopes.left_poles, [np.swapaxes(one, 1, 2)[:, None] for one in slopes.right_poles]
    double = lefts[0][:, :, None] * rights[0]
    single = lefts[0][:, :, None] * rights[1] + lefts[1][:, :, None] * rights[0]
    value, change = (slopes.at_poles[..., n][:, None, None] for n in (0, 1))
    outlast = (model.power / values + (model.record or 0.0))[:, None, None, None]
    steep = value * double
    return model.summed(
        (outlast * steep + change * double + value * single, model.late), (steep, model.steep)
    )


def shortened(model: Response) -> Complex:
    """(lines, outputs, inputs): derivative of H by how much earlier the record ends."""
    if not model.poles:
        return np.zeros((len(model.s), len(model.ends[0]), model.ends[1].shape[1]), dtype=complex)
    return -model.summed((model.residues, lambda some: model.late(some) * (model.s[:, None] - some)))


def along_s(model: Response) -> Complex:
    """(lines, outputs, inputs): dH/ds, what another decay of the window would change; G' = -G (Z + 1/D)' G,
    where 1/D = (1 + tau s) / c, in coordinates scaled by the root of c.
    """
    active, power, line = model.active, model.power, model.s[:, None, None]
    root, size = model.root[active], len(model.compliance)
    loss = np.append(model.retardation, np.zeros(len(model.root) - size))[active]
    mass, damping = (root[:, None] * one[np.ix_(active, active)] * root for one in model.matrices[:2])
    moved, transfer = model.moved[:, active] / root[:, None], model.transfer[..., active] / root
    turned = real_product(damping + np.diag(loss), moved) + 2 * line * real_product(mass, moved)
    slope = -(line**power) * (transfer @ turned)
    slope += power * line ** (power - 1) * (model.ends[0] @ model.moved)
    if not model.poles:
        return np.asarray(slope)
    ended = model.record or 0.0
    return slope + model.summed((ended * model.residues, model.late), (model.residues, model.steep))
