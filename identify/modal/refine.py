"""Refinement of poles and participation factors by nonlinear least squares on the FRFs.

pLSCF minimises a linearised error, which biases weak and strongly damped modes.  Here the error of the modal
model itself is minimised: shapes and residuals are eliminated (variable projection, Golub and Pereyra 1973,
with Kaufman's Jacobian) on normal equations that `gram` builds.  With equations weighted by their noise the
optimum is the maximum-likelihood estimate, and the Gauss-Newton matrix there its information (Pintelon,
Guillaume and Schoukens, MSSP 21 (2007) 2359-2373).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Mask
from identify.modal.descent import descent, factored, solved
from identify.modal.gram import Columns, Functions, Moments, products, rebuilt, right
from identify.modal.layout import Layout
from identify.modal.lsfd import power_of, stack, unit_participation

QUICK, FULL = (4, 1e-3), (25, 1e-7)
"""Largest number of steps, and the relative fall of the cost that ends them."""
_RIDGE = 1e-13
_STRETCH = 64
"""Rows of FRFs that are worked on at once."""
_UNKNOWN = 1e-8
"""Part of a parameter's effect that the linear unknowns leave, below which it is rounding: a resonance far
beyond the band that residual terms replace."""
_STRIDE = 1.0
"""The farthest that a pole moves in a step, in half-bandwidths: what asks for more is not linear."""


@dataclass(frozen=True)
class Equations:
    """Complete responses and their weights: an FRF of response o and reference j is multiplied by line[l]
    reference[j] response[o], about the inverse of its noise.

    s (L,); frf (2 L, references x responses), real rows above imaginary ones; kinds: residual terms, see
    `lsfd.power_of`.
    """

    s: Complex
    power: int
    frf: Array
    kinds: tuple[str, ...]
    line: Array
    reference: Array
    response: Array

    @classmethod
    def of(cls, layout: Layout, kinds: tuple[str, ...]) -> Equations:
        """Every FRF with the same weight."""
        frf = layout.frf[:, layout.complete].transpose(0, 2, 1)
        ones = np.ones(len(frf)), np.ones(frf.shape[1]), np.ones(frf.shape[2])
        return cls(layout.s, layout.power, stack(frf.reshape(len(frf), -1)), kinds, *ones)

    @property
    def count(self) -> int:
        """How many values were measured."""
        return self.frf.size // 2

    @property
    def each(self) -> Array:
        """The weights of FRFs, (references x responses,)."""
        return np.outer(self.reference, self.response).ravel()

    @cached_property
    def each_line(self) -> Array:
        """Energy of the FRFs at every line, (L,), with the weights of references and responses alone."""
        return np.asarray(squared(self.frf) @ self.each**2)

    @property
    def energy(self) -> float:
        """Of the weighted FRFs."""
        return float(self.line**2 @ self.each_line)

    @cached_property
    def scale(self) -> Complex:
        """What every scalar function is multiplied by, (L, 1)."""
        return np.asarray((self.line * self.s**self.power)[:, None])

    @cached_property
    def terms(self) -> Complex:
        """Half of every residual term, which is its own mirror, (L, kinds)."""
        middle = np.exp(np.mean(np.log(np.abs(self.s))))
        powers = np.array([power_of(kind) for kind in self.kinds])
        return np.asarray(self.scale * (self.s[:, None] / middle) ** powers / 2)

    def functions(self, poles: Complex, doubled: Complex) -> Functions:
        """Weighted scalar functions: of every pole, of every residual term, and the squares of some poles."""

        def of(single: Complex, double: Complex) -> Complex:
            s = self.s[:, None]
            return np.hstack([self.scale / (s - single), self.terms, self.scale / (s - double) ** 2])

        return Functions.of(of(poles, doubled), of(poles.conj(), doubled.conj()))

    def moments(self, functions: Functions, known: Moments | None = None) -> Moments:
        """Inner products of functions with each other and with the weighted FRFs; known: those of the first
        functions, whose products with FRFs are not formed again.
        """
        same, across = products(functions, functions)
        shape = -1, len(self.reference), len(self.response)
        new = functions if known is None else functions[len(known.data) :]
        twice = Functions(new.columns * np.tile(self.line, 2)[:, None])
        data = (right(twice, self.frf) * self.each).reshape(shape)
        if known is None:
            return Moments(same, across, data, self.energy)
        return Moments(same, across, np.concatenate([known.data, data]), known.energy)

    def basis(self, participation: Complex) -> Columns:
        """Columns of the real and the imaginary part of every shape, then of the residual terms of every
        reference.
        """
        m, refs = participation.shape
        scaled = participation * self.reference
        modal = np.stack([scaled, 1j * scaled], axis=1).reshape(2 * m, refs)
        terms = np.tile(np.diag(self.reference), (len(self.kinds), 1))
        function = np.concatenate(
            [np.repeat(np.arange(m), 2), m + np.repeat(np.arange(len(self.kinds)), refs)]
        )
        return Columns(function, np.concatenate([modal, terms.astype(complex)]))

    def derivatives(self, participation: Complex, free: Mask) -> Columns:
        """Derivatives of the modal columns of the free modes: for each Re, Im of the pole, then of each
        participation but the largest; each with the real and the imaginary part of the shape.
        """
        rows, refs = participation[free], participation.shape[1]
        number = np.arange(len(rows))
        function = np.repeat(np.flatnonzero(free)[:, None], refs, axis=1)
        function[:, 0] = len(participation) + len(self.kinds) + number
        unit = np.broadcast_to(np.diag(self.reference), (len(rows), refs, refs))[_others(rows)]
        first = (rows * self.reference)[:, None]
        vectors = np.concatenate([first, unit.reshape(len(rows), refs - 1, refs)], axis=1)
        turned = vectors[:, :, None] * np.array([1, 1j, 1j, -1])[:, None]
        return Columns(np.repeat(function.ravel(), 4), turned.reshape(-1, refs))


@dataclass(frozen=True)
class Fit:
    """Poles (m,), participation (m, references) and the linear unknowns that fit them best.

    solution (columns, responses), of columns scaled to unit length by size (columns,); inverse (columns,
    columns) of their normal matrix; cost: squared error of the weighted equations.
    """

    equations: Equations
    poles: Complex
    participation: Complex
    free: Mask
    moments: Moments
    size: Array
    inverse: Array
    solution: Array
    cost: float

    @property
    def unknowns(self) -> int:
        """Real numbers that were fitted."""
        return int(self.solution.size + 2 * self.free.sum() * self.participation.shape[1])

    @property
    def variance(self) -> float:
        """Mean squared error of a real weighted equation."""
        return self.cost / max(2 * self.equations.count - self.unknowns, 1)

    @cached_property
    def with_squares(self) -> Moments:
        """Inner products also with the squares of functions of free poles, which derivatives are made of."""
        functions = self.equations.functions(self.poles, self.poles[self.free])
        return self.equations.moments(functions, self.moments)

    @cached_property
    def model(self) -> Array:
        """Weighted FRFs of the model, (2 L, references x responses), real rows above imaginary ones."""
        functions = self.equations.functions(self.poles, self.poles[:0])
        columns = self.equations.basis(self.participation)
        return rebuilt(functions, columns, self.solution / self.size[:, None])

    @cached_property
    def residual(self) -> Array:
        """Weighted FRFs minus the model's, as `model`."""
        equations, model = self.equations, self.model
        line, each = np.tile(equations.line, 2)[:, None], equations.each
        found = np.empty_like(equations.frf)
        for some in _stretches(len(found)):
            np.multiply(equations.frf[some], each, out=found[some])
            found[some] *= line[some]
            found[some] -= model[some]
        return found

    @cached_property
    def left(self) -> Array:
        """Energy of the residual at every line, (L,)."""
        half = len(self.residual) // 2
        return np.asarray(np.einsum("plk,plk->l", *[self.residual.reshape(2, half, -1)] * 2))

    @cached_property
    def noise(self) -> Array:
        """Variance of noise in the residual that is independent from line to line, (L,): from second
        differences, so that slow errors do not count.
        """
        lines = len(self.residual) // 2
        error = self.residual.reshape(2, lines, -1)
        parts = []
        for some in _stretches(lines - 2):
            bend = np.diff(error[:, some.start : some.stop + 2], n=2, axis=1)
            parts.append(np.einsum("plk,plk->l", bend, bend))
        bend = np.concatenate(parts) / (6 * error.shape[2])
        reach = min(max(31, lines // 10), lines)
        smooth = scipy.ndimage.median_filter(np.pad(bend, 1, mode="edge"), reach, mode="nearest")
        return np.asarray(smooth + np.finfo(float).tiny)

    def shapes(self) -> Complex:
        """Shapes of the complete responses, (m, responses), up to a factor of each mode."""
        real = (self.solution / self.size[:, None])[: 2 * len(self.poles)]
        return np.asarray((real[0::2] + 1j * real[1::2]) / self.equations.response)

    def rises(self) -> Array:
        """How much the cost rises at least when a mode is left out and the linear unknowns are fitted again,
        (m,).
        """
        found = np.zeros(len(self.poles))
        for r in range(len(self.poles)):
            block = slice(2 * r, 2 * r + 2)
            part = self.solution[block]
            found[r] = np.sum(part * np.linalg.solve(self.inverse[block, block], part))
        return found


def squared(stacked: Array) -> Array:
    """Squared magnitude, (L, n), of values (2 L, n), real rows above imaginary ones."""
    real, imaginary = stacked.reshape(2, len(stacked) // 2, -1)
    found = np.empty_like(real)
    for some in _stretches(len(found)):
        np.multiply(real[some], real[some], out=found[some])
        found[some] += imaginary[some] ** 2
    return found


def _stretches(rows: int) -> Iterator[slice]:
    """Rows in stretches that stay in the processor's memory: new pages for large arrays cost more than
    arithmetic.
    """
    for start in range(0, rows, _STRETCH):
        yield slice(start, min(start + _STRETCH, rows))


def fit(equations: Equations, poles: Complex, participation: Complex, free: Mask) -> Fit:
    """The shapes and residual terms that fit best with these poles (m,) and participation (m, references)."""
    participation = unit_participation(participation)
    moments = equations.moments(equations.functions(poles, poles[:0]))
    return _solved(equations, poles, participation, free, moments)


def _solved(
    equations: Equations, poles: Complex, participation: Complex, free: Mask, moments: Moments
) -> Fit:
    columns = equations.basis(participation)
    normal, right = moments.gram(columns, columns), moments.right(columns)
    size = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    factor = factored(normal / np.outer(size, size), _RIDGE)
    right = right / size[:, None]
    solution = solved(factor, right)
    inverse = solved(factor, np.eye(len(size)))
    cost = max(moments.energy - float(np.sum(right * solution)), 0.0)
    return Fit(equations, poles, participation, free, moments, size, inverse, solution, cost)


def without(found: Fit, gone: int) -> Fit:
    """The fit of all modes but one, on the same moments."""
    left = np.arange(len(found.poles)) != gone
    rows = np.append(left, np.ones(len(found.equations.kinds), dtype=bool))
    moments = replace(
        found.moments,
        same=found.moments.same[np.ix_(rows, rows)],
        across=found.moments.across[np.ix_(rows, rows)],
        data=found.moments.data[rows],
    )
    return _solved(found.equations, found.poles[left], found.participation[left], found.free[left], moments)


def minimise(start: Fit, steps: int, tolerance: float) -> Fit:
    """The fit after damped steps until the cost stands still."""
    return descent(start, slope, _trial, steps, tolerance) if start.free.any() else start


def _trial(state: Fit, step: Array) -> Fit | None:
    """The fit after a step, unless a pole strides too far or starts to grow."""
    poles, participation = _moved(state, step)
    stride = np.abs(poles - state.poles) > _STRIDE * -state.poles.real
    if stride.any() or np.any(poles.real >= 0):
        return None
    return fit(state.equations, poles, participation, state.free)


def slope(state: Fit) -> tuple[Array, Array]:
    """Right side and Gauss-Newton matrix over the free modes, each with 2 x references real parameters; one
    that the data do not tell apart from the linear unknowns has no gradient.
    """
    columns = state.equations.derivatives(state.participation, state.free)
    basis = state.equations.basis(state.participation)
    moments = state.with_squares
    overlap = moments.gram(columns, basis) / state.size
    own = moments.gram(columns, columns)
    projected = own - overlap @ state.inverse @ overlap.T
    right = moments.right(columns) - overlap @ state.solution
    shapes = weighted_shapes(state)
    normal, whole = over_responses(projected, shapes), np.diag(over_responses(own, shapes))
    blocks = right.reshape(len(shapes), -1, 2, right.shape[1])
    gradient = np.einsum("rpao,rao->rp", blocks, shapes).ravel()
    blind = np.diag(normal) <= _UNKNOWN * whole
    gradient[blind], normal[blind], normal[:, blind] = 0.0, 0.0, 0.0
    normal[blind, blind] = _UNKNOWN * whole[blind]
    return gradient, normal


def over_responses(products: Array, shapes: Array) -> Array:
    """Inner products of the derivatives, (parameters, parameters), from those of their columns and the
    weighted shapes (free, 2, responses).
    """
    m = len(shapes)
    blocks = products.reshape(m, -1, 2, m, len(products) // (2 * m), 2)
    across = np.einsum("rao,sbo->rasb", shapes, shapes)
    normal = np.einsum("rpasqb,rasb->rpsq", blocks, across, optimize=True)
    return np.asarray(normal.reshape(len(products) // 2, -1))


def weighted_shapes(state: Fit) -> Array:
    """Real and imaginary part of the weighted shapes of the free modes, (free, 2, responses)."""
    m = len(state.poles)
    real = (state.solution / state.size[:, None])[: 2 * m]
    return np.asarray(real.reshape(m, 2, -1)[state.free])


def _others(rows: Complex) -> Mask:
    """Components of each row but its largest, as rows (m, references)."""
    return np.asarray(np.arange(rows.shape[1]) != np.argmax(np.abs(rows), axis=1)[:, None])


def _moved(state: Fit, step: Array) -> tuple[Complex, Complex]:
    poles, participation = state.poles.copy(), state.participation.copy()
    parts = step.reshape(int(state.free.sum()), -1, 2)
    moves = parts[..., 0] + 1j * parts[..., 1]
    poles[state.free] += moves[:, 0]
    participation[_others(participation) & state.free[:, None]] += moves[:, 1:].ravel()
    return poles, unit_participation(participation)
