"""Refinement of poles and participation factors by nonlinear least squares on the FRFs.

pLSCF minimises a linearised error, which biases weak and strongly damped modes.  Here the error of the modal model itself
is minimised: shapes and residuals are eliminated (variable projection, Golub and Pereyra 1973, with Kaufman's
Jacobian), and lines are weighted by the residual found around them, so that a small mode is not ruled by what the
model misses at a large one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.ndimage import uniform_filter1d

from identify.modal.layout import Layout
from identify.modal.lsfd import regressors, stack, targets, unit_participation

Complex = NDArray[np.complex128]
Float = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ROUNDS, _STEPS, _TOLERANCE = 3, 15, 1e-8


@dataclass(frozen=True)
class Refined:
    """poles (m,), rad/s; participation (m, references); covariance (m, 2, 2) of the real and imaginary part of each pole,
    from the Jacobian and the residual (rad/s)^2; weight (L, references) of the lines.
    """

    poles: Complex
    participation: Complex
    covariance: Float
    weight: Float


@dataclass(frozen=True)
class _State:
    poles: Complex
    participation: Complex
    basis: Float
    solution: Float
    error: Float

    @property
    def cost(self) -> float:
        return float(np.sum(self.error**2))


def refine(layout: Layout, poles: Complex, participation: Complex, residuals: tuple[str, ...], free: Flags) -> Refined:
    """Poles (m,) and participation (m, references) that minimise the weighted error on the complete responses.

    Only modes with free (m,) move.  Weights are found in three rounds, each from the residual of the last.
    """
    y = targets(layout.frf[:, layout.complete])
    weight = np.ones((len(layout.frequency_hz), len(layout.references)))
    state = _eliminate(layout, poles, unit_participation(participation), residuals, y, weight)
    for _ in range(_ROUNDS):
        weight = _weights(state.error / np.tile(weight.ravel(), 2)[:, None], layout)
        state = _eliminate(layout, state.poles, state.participation, residuals, y, weight)
        state = _minimise(layout, state, residuals, y, weight, free)
    _, normal = _gradient(layout, state, weight, free)
    covariance = np.linalg.pinv(normal, hermitian=True) * state.cost / max(y.size - len(normal), 1)
    q = 2 * len(layout.references)
    found = np.zeros((len(poles), 2, 2))
    found[free] = [covariance[r * q : r * q + 2, r * q : r * q + 2] for r in range(int(free.sum()))]
    return Refined(state.poles, state.participation, found, weight)


def _weights(error: Float, layout: Layout) -> Float:
    """1 / RMS residual around each line for each reference, (L, references), smoothed over a tenth of the band."""
    lines, refs = len(layout.frequency_hz), len(layout.references)
    square = np.sum(error**2, axis=1).reshape(2, lines, refs).sum(axis=0)
    square = uniform_filter1d(square, max(9, lines // 10), axis=0, mode="nearest")
    # Without noise the residual is rounding only, and its ratios mean nothing.
    return np.asarray(1 / np.sqrt(np.maximum(square, 1e-6 * np.max(square)) + np.finfo(float).tiny))


def _eliminate(layout: Layout, poles: Complex, participation: Complex, residuals: tuple[str, ...], y: Float, weight: Float) -> _State:
    rows = np.tile(weight.ravel(), 2)[:, None]
    matrix = regressors(layout, poles, participation, residuals) * rows
    size = np.linalg.norm(matrix, axis=0)
    basis, triangle = np.linalg.qr(matrix / size)
    projected = basis.T @ (y * rows)
    solution = np.linalg.lstsq(triangle, projected, rcond=None)[0] / size[:, None]
    return _State(poles, participation, basis, solution, y * rows - basis @ projected)


def _minimise(layout: Layout, state: _State, residuals: tuple[str, ...], y: Float, weight: Float, free: Flags) -> _State:
    """Levenberg-Marquardt steps until the cost stands still."""
    damping = 1e-3
    for _ in range(_STEPS):
        gradient, normal = _gradient(layout, state, weight, free)
        better = None
        while better is None and damping < 1e8:
            step = _step(normal, gradient, damping)
            trial = _eliminate(layout, *_moved(state, step, free), residuals, y, weight)
            if trial.cost <= state.cost:
                better = trial
            else:
                damping *= 10
        if better is None:
            return state
        done = state.cost - better.cost <= _TOLERANCE * state.cost
        state, damping = better, max(damping / 10, 1e-12)
        if done:
            break
    return state


def _step(normal: Float, gradient: Float, damping: float) -> Float:
    scale = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    factor = cho_factor(normal / np.outer(scale, scale) + damping * np.eye(len(scale)))
    return np.asarray(cho_solve(factor, gradient / scale) / scale)


def _gradient(layout: Layout, state: _State, weight: Float, free: Flags) -> tuple[Float, Float]:
    """Right side and Gauss-Newton matrix over the free modes, each with 2 x references real parameters."""
    m, q = int(free.sum()), 2 * len(layout.references)
    columns = _derivatives(layout, state.poles[free], state.participation[free]) * np.tile(weight.ravel(), 2)[:, None]
    columns = columns - state.basis @ (state.basis.T @ columns)
    shapes = state.solution[: 2 * len(state.poles)].reshape(len(state.poles), 2, -1)[free]
    gram = (columns.T @ columns).reshape(m, q, 2, m, q, 2)
    overlap = np.einsum("rao,sbo->rasb", shapes, shapes)
    normal = np.einsum("rpasqb,rasb->rpsq", gram, overlap, optimize=True).reshape(m * q, m * q)
    gradient = np.einsum("rpao,rao->rp", (columns.T @ state.error).reshape(m, q, 2, -1), shapes).ravel()
    return gradient, normal


def _derivatives(layout: Layout, poles: Complex, participation: Complex) -> Float:
    """Derivatives of the regressors, (2 L references, m x parameters x 2), real parameters ordered: Re, Im of the pole, then of
    each participation but the largest; last axis: with the real and the imaginary part of the shape.
    """
    s, refs = layout.s, len(layout.references)
    scale = s**layout.power
    unit = np.eye(refs)
    found = []
    for pole, row in zip(poles, participation, strict=True):
        direct, mirror = scale / (s - pole), scale / (s - pole.conj())
        pairs = [(np.outer(direct / (s - pole), row), np.outer(mirror / (s - pole.conj()), row.conj()))]
        pairs += [(np.outer(direct, unit[j]), np.outer(mirror, unit[j])) for j in _others(row)]
        for x, y in pairs:
            for turn in (1, 1j):
                forward, backward = turn * x, np.conj(turn) * y
                found += [(forward + backward).ravel(), (1j * (forward - backward)).ravel()]
    return stack(np.stack(found, axis=1))


def _others(row: Complex) -> list[int]:
    largest = int(np.argmax(np.abs(row)))
    return [j for j in range(len(row)) if j != largest]


def _moved(state: _State, step: Float, free: Flags) -> tuple[Complex, Complex]:
    poles, participation = state.poles.copy(), state.participation.copy()
    parts = step.reshape(int(free.sum()), -1, 2)
    moves = parts[..., 0] + 1j * parts[..., 1]
    for r, move in zip(np.flatnonzero(free), moves, strict=True):
        poles[r] += move[0]
        participation[r, _others(participation[r])] += move[1:]
    return poles, unit_participation(participation)
