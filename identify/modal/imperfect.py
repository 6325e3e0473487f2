"""Modes of FRFs that are off in ways that no mode explains: noise is no measure of a mode there.

What tells instead: a mode that wanders off when refined, explains less than its share of the response around
it, or has no shape, is none.

They are refined by least squares on the FRFs, lines weighted by what is left.  Shapes and residuals are
eliminated (`identify.core.separable`, with Kaufman's Jacobian); every line of every reference has its own
weight, so that a small mode is not ruled by what the model misses at a large one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Mask
from identify.core.coded import Coded
from identify.core.separable import eliminate
from identify.modal.descent import descent
from identify.modal.layout import Layout
from identify.modal.lsfd import (
    ModalModel,
    contributions,
    lsfd,
    regressors,
    stack,
    targets,
    unit_participation,
)
from identify.modal.mac import mpc, mpd
from identify.modal.reasons import RESIDUAL, Why, because
from identify.modal.selection import Candidate, arrays, least_share, without_idle
from identify.modal.settings import ModalSettings
from identify.modal.verified import BEYOND, Verified, parted, stays, unrefined

_FIRM = 0.8
"""Part of the orders in which a cluster appears, beyond which a mode that wanders off is held where it was
found: what pushes it is what no mode explains."""
_QUICK, _FULL = (3, 1e-3), (15, 1e-6)
"""Largest number of steps, and the relative fall of the cost that ends them."""


def imperfect(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """Refine; drop modes that fail, wanderers first because they may have pushed others; refine again until
    all stand.
    """
    kept, gone = without_idle(modes, layout, settings)
    held: set[int] = set()
    quick = True
    while kept:
        poles, participation = arrays(kept)
        free = np.array([id(mode) not in held for mode in kept])
        refined = refine(layout, poles, participation, settings.residuals, free, quick=quick)
        model = lsfd(layout, refined.poles, refined.participation, settings.residuals, refined.weight)
        outside = [
            _is_outside(mode, pole, layout, settings) for mode, pole in zip(kept, refined.poles, strict=True)
        ]
        faults = _wandered(kept, refined, layout, outside)
        firm = {id(mode) for mode in kept if id(mode) in faults and (mode.by_hand or mode.presence >= _FIRM)}
        if firm:
            held |= firm
            continue
        faults = _least_first(kept, faults or _failed(kept, model, layout, settings, outside))
        gone += [replace(mode, reason=faults[id(mode)]) for mode in kept if id(mode) in faults]
        kept = [mode for mode in kept if id(mode) not in faults]
        if not faults and not quick:
            beyond = [
                because(Why.BEYOND, abs(pole) / (2 * np.pi), more=RESIDUAL) if out else None
                for pole, out in zip(model.poles, outside, strict=True)
            ]
            none = np.zeros(len(kept), dtype=bool)
            return parted(kept, model, beyond, refined.covariance, none, gone)
        quick = bool(faults)
    empty = unrefined([], layout, settings)
    return replace(empty, rejected=gone)


def _is_outside(mode: Candidate, pole: complex, layout: Layout, settings: ModalSettings) -> bool:
    """Whether a pole that did not stay is a resonance beyond the band, but not far."""
    frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    beyond = low / BEYOND < frequency < low or high < frequency < high * BEYOND
    return bool(beyond and 0 < damping <= settings.max_damping_ratio and not stays(mode, pole, layout))


def _wandered(
    modes: list[Candidate], refined: Refined, layout: Layout, outside: list[bool]
) -> dict[int, Coded]:
    """Modes that did not stay and are no resonance beyond the band either."""
    faults = {}
    for mode, pole, is_outside in zip(modes, refined.poles, outside, strict=True):
        if not is_outside and not stays(mode, pole, layout):
            frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
            faults[id(mode)] = because(Why.MOVED, frequency, damping)
    return faults


def _least_first(modes: list[Candidate], faults: dict[int, Coded]) -> dict[int, Coded]:
    """Of close faulty modes only the one that contributes least: it may be what spoils the other."""
    chosen: list[Candidate] = []
    for mode in sorted((mode for mode in modes if id(mode) in faults), key=lambda mode: mode.contribution):
        if all(
            abs(mode.pole - other.pole) > 1.5 * max(mode.half_bandwidth, other.half_bandwidth)
            for other in chosen
        ):
            chosen.append(mode)
    return {id(mode): faults[id(mode)] for mode in chosen}


def _failed(
    modes: list[Candidate],
    model: ModalModel,
    layout: Layout,
    settings: ModalSettings,
    outside: list[bool],
) -> dict[int, Coded]:
    """Modes whose contribution or, in the band, refined shape fails the criteria."""
    share = contributions(layout, model.poles, model.participation, settings.residuals)
    collinear, deviation = mpc(model.shapes), np.degrees(mpd(model.shapes))
    faults = {}
    for r, mode in enumerate(modes):
        if mode.by_hand:
            continue
        if share[r] < least_share(settings):
            faults[id(mode)] = because(Why.IDLE, share[r], more=" after refinement")
        elif not outside[r] and (collinear[r] < settings.min_mpc or deviation[r] > settings.max_mpd_deg):
            faults[id(mode)] = because(Why.COMPLEX_REFINED, collinear[r], deviation[r])
    return faults


@dataclass(frozen=True)
class Refined:
    """poles (m,), rad/s; participation (m, references); covariance (m, 2, 2) of the real and imaginary part
    of each pole, from the Jacobian and the residual (rad/s)^2; weight (L, references) of the lines.
    """

    poles: Complex
    participation: Complex
    covariance: Array
    weight: Array


@dataclass(frozen=True)
class _Problem:
    """What is fitted and how: y (2 L references, responses), weight (L, references), free (m,)."""

    layout: Layout
    residuals: tuple[str, ...]
    y: Array
    weight: Array
    free: Mask

    @property
    def rows(self) -> Array:
        """The weight of every equation, (2 L references, 1)."""
        return np.tile(self.weight.ravel(), 2)[:, None]


@dataclass(frozen=True)
class _State:
    poles: Complex
    participation: Complex
    basis: Array
    solution: Array
    error: Array

    @property
    def cost(self) -> float:
        return float(np.sum(self.error**2))


def refine(
    layout: Layout,
    poles: Complex,
    participation: Complex,
    residuals: tuple[str, ...],
    free: Mask,
    *,
    quick: bool = False,
) -> Refined:
    """Poles (m,) and participation (m, references) that minimise the weighted error on the complete
    responses.

    Only modes with free (m,) move.  Weights are found in three rounds, each from the residual of the last;
    quick: one short round, enough to see which modes do not stay.
    """
    weight = np.ones((len(layout.frequency_hz), len(layout.references)))
    problem = _Problem(layout, residuals, targets(layout.frf[:, layout.complete]), weight, free)
    state = _eliminate(problem, poles, unit_participation(participation))
    for effort in (_QUICK,) if quick else (_QUICK, _QUICK, _FULL):
        problem = replace(problem, weight=_weights(state.error / problem.rows, layout))
        state = _eliminate(problem, state.poles, state.participation)
        if free.any():
            state = descent(state, partial(_gradient, problem), partial(_trial, problem), *effort)
    if not free.any():
        return Refined(state.poles, state.participation, np.zeros((len(poles), 2, 2)), problem.weight)
    _, normal = _gradient(problem, state)
    covariance = np.linalg.pinv(normal, hermitian=True) * state.cost / max(problem.y.size - len(normal), 1)
    q = 2 * len(layout.references)
    found = np.zeros((len(poles), 2, 2))
    found[free] = [covariance[r * q : r * q + 2, r * q : r * q + 2] for r in range(int(free.sum()))]
    return Refined(state.poles, state.participation, found, problem.weight)


def _weights(error: Array, layout: Layout) -> Array:
    """1 / RMS residual around each line for each reference, (L, references), smoothed over a tenth of the
    band.
    """
    lines, refs = len(layout.frequency_hz), len(layout.references)
    square = np.sum(error**2, axis=1).reshape(2, lines, refs).sum(axis=0)
    square = scipy.ndimage.uniform_filter1d(square, max(9, lines // 10), axis=0, mode="nearest")
    # Without noise the residual is rounding only, and its ratios mean nothing.
    return np.asarray(1 / np.sqrt(np.maximum(square, 1e-6 * np.max(square)) + np.finfo(float).tiny))


def _eliminate(problem: _Problem, poles: Complex, participation: Complex) -> _State:
    """The shapes and residuals that fit best, and what is left."""
    matrix = regressors(problem.layout, poles, participation, problem.residuals) * problem.rows
    rounding = np.finfo(float).eps * matrix.shape[1]
    best = eliminate(matrix, problem.y * problem.rows, rounding)
    return _State(poles, participation, best.basis, best.coefficients, best.residual)


def _trial(problem: _Problem, state: _State, step: Array) -> _State:
    return _eliminate(problem, *_moved(state, step, problem.free))


def _gradient(problem: _Problem, state: _State) -> tuple[Array, Array]:
    """Right side and Gauss-Newton matrix over the free modes, each with 2 x references real parameters."""
    free = problem.free
    m, q = int(free.sum()), 2 * len(problem.layout.references)
    columns = _derivatives(problem.layout, state.poles[free], state.participation[free]) * problem.rows
    columns = columns - state.basis @ (state.basis.T @ columns)
    shapes = state.solution[: 2 * len(state.poles)].reshape(len(state.poles), 2, -1)[free]
    gram = (columns.T @ columns).reshape(m, q, 2, m, q, 2)
    overlap = np.einsum("rao,sbo->rasb", shapes, shapes)
    normal = np.einsum("rpasqb,rasb->rpsq", gram, overlap, optimize=True).reshape(m * q, m * q)
    gradient = np.einsum("rpao,rao->rp", (columns.T @ state.error).reshape(m, q, 2, -1), shapes).ravel()
    return gradient, normal


def _derivatives(layout: Layout, poles: Complex, participation: Complex) -> Array:
    """Derivatives of the regressors, (2 L references, m x parameters x 2), real parameters ordered: Re, Im of
    the pole, then of each participation but the largest; last axis: with the real and the imaginary part of
    the shape.
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


def _moved(state: _State, step: Array, free: Mask) -> tuple[Complex, Complex]:
    poles, participation = state.poles.copy(), state.participation.copy()
    parts = step.reshape(int(free.sum()), -1, 2)
    moves = parts[..., 0] + 1j * parts[..., 1]
    for r, move in zip(np.flatnonzero(free), moves, strict=True):
        poles[r] += move[0]
        participation[r, _others(participation[r])] += move[1:]
    return poles, unit_participation(participation)
