"""The modes that the data need: clusters are fitted to the FRFs, and what noise could do is taken out.

How sure refined poles are, from the noise that the fit leaves in the FRFs.

At the maximum-likelihood optimum the covariance is the inverse of the Gauss-Newton matrix times the noise's
variance (Pintelon, Guillaume and Schoukens, MSSP 21 (2007) 2359-2373).  The noise is that of the FRFs and
lines that tell a mode, and of what is left there the unknowns took a part (leverages; Hoaglin and Welsch, The
American Statistician 32 (1978) 17-22).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.coded import Coded
from identify.modal.gram import written_out
from identify.modal.growth import grown
from identify.modal.imperfect import imperfect
from identify.modal.layout import Layout
from identify.modal.lsfd import MORE_RESIDUALS, ModalModel, lsfd
from identify.modal.mac import mpc, mpd
from identify.modal.reasons import RESIDUAL, Why, because
from identify.modal.refine import (
    FULL,
    QUICK,
    Equations,
    Fit,
    fit,
    minimise,
    over_responses,
    slope,
    squared,
    weighted_shapes,
    without,
)
from identify.modal.selection import Candidate
from identify.modal.settings import ModalSettings
from identify.modal.state import REACH, State, dropped, narrow, pruned, refined, weighted
from identify.modal.verified import Verified, parted, pole_arrays, stays
from identify.modal.weights import leftover, local_variance, over_noise, required

_COLLINEAR = 1e6
"""How much more than alone a linear unknown may scatter beside the others for products of columns to do."""
_MOST = 0.95
"""Part of a value that the unknowns may take at most."""


def covariance(found: Fit) -> Array:
    """Covariance (m, 2, 2) of the real and the imaginary part of each pole, (rad/s)^2; zero for a pole that
    is held.
    """
    result = np.zeros((len(found.poles), 2, 2))
    if not found.free.any():
        return result
    normal = information(found)
    diagonal = np.diag(normal)
    scale = np.sqrt(np.maximum(diagonal, 1e-30 * np.max(diagonal)) + np.finfo(float).tiny)
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    # What rounding leaves of a direction that the data do not tell is little known, not well known.
    values = np.maximum(values, np.finfo(float).eps * len(values) * values[-1])
    inverse = (vectors / values) @ vectors.T / np.outer(scale, scale)
    factor = local_variance(found)[1]
    variance = noise_variance(found)
    q = 2 * found.participation.shape[1]
    for k, r in enumerate(np.flatnonzero(found.free)):
        block = slice(k * q, k * q + 2)
        result[r] = inverse[block, block] * variance[k] * factor[r]
    return result


def information(found: Fit) -> Array:
    """Gauss-Newton matrix over the free modes, as of `slope`, without the rounding of products of columns."""
    if np.max(np.diag(found.inverse), initial=0.0) < _COLLINEAR:
        return slope(found)[1]
    equations = found.equations
    functions = equations.functions(found.poles, found.poles[found.free])
    basis = written_out(functions, equations.basis(found.participation))
    columns = written_out(functions, equations.derivatives(found.participation, found.free))
    basis, columns = (c.reshape(-1, c.shape[2]) for c in (basis, columns))
    known = np.linalg.qr(basis / found.size)[0]
    for _ in range(2):  # twice is enough
        columns -= known @ (known.T @ columns)
    return over_responses(columns.T @ columns, weighted_shapes(found))


def noise_variance(found: Fit) -> Array:
    """Variance of a real weighted equation of the FRFs and lines where each free mode is large, (free,)."""
    equations, free = found.equations, found.free
    lines, refs = len(equations.s), len(equations.reference)
    near = (equations.line * np.abs(equations.s) ** equations.power)[:, None]
    line = (near / np.abs(equations.s[:, None] - found.poles[free])) ** 2
    reference = np.abs(found.participation[free] * equations.reference).T ** 2
    response = np.sum(weighted_shapes(found) ** 2, axis=1).T
    left = squared(found.residual).reshape(lines * refs, -1) @ response
    known = 2 - np.minimum(leverage(found), 2 * _MOST)
    energy = np.einsum("ljm,lm,jm->m", left.reshape(lines, refs, -1), line, reference)
    count = np.einsum("lj,lm,jm->m", known, line, reference) * response.sum(axis=0)
    return np.asarray(energy / np.maximum(count, np.finfo(float).tiny))


def leverage(found: Fit) -> Array:
    """What the unknowns take of the two real equations of an FRF at a line, (L, references): 0 to 2, the
    same for every response.
    """
    equations = found.equations
    functions = equations.functions(found.poles, found.poles[:0])
    columns = written_out(functions, equations.basis(found.participation)) / found.size
    taken = np.sum((columns @ found.inverse) * columns, axis=2)
    taken = taken.reshape(2, len(equations.s), -1).sum(axis=0)
    # Poles and participation stand at the same lines as the shapes.
    return np.asarray(taken * found.unknowns / found.solution.size)


_NOT_NOISE = 3.0
"""What is left over independent noise, beyond which the model is wrong rather than small."""
_COMPLETE = 1.5
"""The same where modes were added: they are believed where they leave noise and nothing else."""
_UNSURE = 0.05
"""Poles whose standard deviation, in half-bandwidths, is larger may be the second of a pair for one mode."""


def verify(
    modes: list[Candidate], layout: Layout, settings: ModalSettings, others: list[Candidate]
) -> Verified:
    """Modes that explain more than noise could, refined together; modes chosen by hand all stay.

    Beside them the FRFs may need modes that no cluster showed (`addition`), none that was dropped by hand.

    Where the FRFs are off in ways that no mode explains (they change from run to run, leak, are not quite
    linear), noise is no measure of what a mode must explain: there `imperfect` has its rules.
    """
    equations = Equations.of(layout, settings.residuals)
    if settings.modes_hz is not None:
        return _split(_held(_begun(equations, modes, layout), layout), layout, settings)
    begun = _enriched(_settled(_begun(equations, modes, layout), layout))
    state = grown(begun, layout, others)
    if not _is_explained(state.fit, _COMPLETE):
        state = begun
    if not _is_explained(state.fit, _NOT_NOISE):
        return imperfect(modes, layout, settings)
    if settings.min_contribution is not None:
        state = _contributing(state, layout, settings.min_contribution)
    for _ in range(4):
        count = len(state.fit.poles)
        state = _merged(pruned(refined(refined(state, *QUICK), *FULL), layout))
        if len(state.fit.poles) == count:
            break
    return _split(state, layout, settings)


def _begun(equations: Equations, modes: list[Candidate], layout: Layout) -> State:
    poles, participation = pole_arrays(modes, layout)
    start = fit(equations, poles, participation, np.ones(len(poles), dtype=bool))
    return State(weighted(weighted(start)), list(modes), [])


def _settled(state: State, layout: Layout) -> State:
    """Clusters that are more than noise, refined."""
    state = pruned(state, layout)
    for _ in range(2):
        state = pruned(refined(state, *QUICK), layout)
    return state


def _is_explained(found: Fit, most: float) -> bool:
    """Whether what is left is noise, up to this factor, and no peak leaks."""
    return over_noise(found) <= most and not np.any(narrow(found))


def _held(state: State, layout: Layout) -> State:
    """Modes chosen by hand, refined; one that wanders is held at its cluster."""
    chosen, best = state.fit, state
    for _ in range(len(state.modes) + 1):
        best = refined(refined(replace(state, fit=chosen), *QUICK), *FULL)
        wandered = np.array(
            [not stays(m, p, layout) for m, p in zip(state.modes, best.fit.poles, strict=True)],
            dtype=bool,
        )
        if not np.any(wandered & chosen.free):
            break
        chosen = fit(chosen.equations, chosen.poles, chosen.participation, chosen.free & ~wandered)
    return best


def _merged(state: State) -> State:
    """Without poles that others replace when these may move: two that stand for one, first the least sure."""
    kept: set[int] = set()
    while True:
        doubt = _doubt(state.fit)
        doubt[[k for k, mode in enumerate(state.modes) if mode.by_hand or id(mode) in kept]] = 0
        if not len(doubt) or np.max(doubt) < _UNSURE:
            return state
        r = int(np.argmax(doubt))
        over, fewer = _replaced(state.fit, r)
        if over >= 1:
            kept.add(id(state.modes[r]))
            continue
        modes = list(state.modes)
        reason = because(Why.IDLE_BY_NOISE, over, more=", once its neighbours may move")
        gone = replace(modes.pop(r), reason=reason)
        state = replace(state, fit=fewer, modes=modes, gone=[*state.gone, gone])


def _doubt(found: Fit) -> Array:
    """Standard deviation of every pole in half-bandwidths, (m,)."""
    spread = np.sqrt(np.abs(np.trace(covariance(found), axis1=1, axis2=2)) / 2)
    return np.asarray(spread / -found.poles.real)


def _replaced(found: Fit, r: int) -> tuple[float, Fit]:
    """What a mode explains over what it must when neighbours may move in its place; the fit without it."""
    pole = found.poles[r]
    others = np.delete(found.poles, r)
    near = np.abs(others - pole) < REACH * (-others.real - pole.real)
    fewer = without(found, r)
    moved = minimise(fit(fewer.equations, fewer.poles, fewer.participation, near), 8, 1e-4)
    over = (moved.cost - found.cost) / required(found)[r]
    return over, fit(moved.equations, moved.poles, moved.participation, np.ones(len(near), dtype=bool))


def _enriched(state: State) -> State:
    """With further residual terms where these lower the cost by more than noise would (Bayes' criterion)."""
    for kinds in MORE_RESIDUALS:
        if not state.fit.equations.kinds:
            return state
        found = state.fit
        more = replace(found.equations, kinds=found.equations.kinds + kinds)
        richer = minimise(fit(more, found.poles, found.participation, found.free), *QUICK)
        price = (richer.unknowns - found.unknowns) * np.log(2 * found.equations.count)
        if found.cost - richer.cost <= price * richer.variance:
            return state
        state = replace(state, fit=richer)
    return state


def _contributing(state: State, layout: Layout, least: float) -> State:
    """Without modes that explain less than this share of the response around them."""
    while len(state.modes):
        share = np.where([mode.by_hand for mode in state.modes], np.inf, leftover(state.fit)[1])
        r = int(np.argmin(share))
        if share[r] >= least:
            break
        state = dropped(state, {r: because(Why.IDLE, share[r])})
    return pruned(refined(state, *QUICK), layout)


def _split(state: State, layout: Layout, settings: ModalSettings) -> Verified:
    """Modes of the table by frequency, and what else was fitted."""
    found = state.fit
    equations = found.equations
    weight = np.outer(equations.line, equations.reference)
    model = lsfd(layout, found.poles, found.participation, equations.kinds, weight)
    every = settings.modes_hz is not None  # all were chosen
    faults = [
        None if every or mode.by_hand else fault
        for mode, fault in zip(state.modes, _faults(state, model, layout, settings), strict=True)
    ]
    modes = [
        replace(mode, pole=complex(pole)) if fault else mode
        for mode, pole, fault in zip(state.modes, model.poles, faults, strict=True)
    ]
    by_noise = np.maximum(leftover(found)[0], over_noise(found)) <= _COMPLETE
    return parted(modes, model, faults, covariance(found), by_noise, state.gone)


def _faults(state: State, model: ModalModel, layout: Layout, settings: ModalSettings) -> list[Coded | None]:
    """Why a fitted pole is no mode of the band, or nothing."""
    collinear, deviation = mpc(model.shapes), np.degrees(mpd(model.shapes))
    left, _ = leftover(state.fit)
    half, size = -model.poles.real, np.abs(model.poles)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    faults: list[Coded | None] = []
    for r in range(len(model)):
        frequency, damping = size[r] / (2 * np.pi), half[r] / size[r]
        # Modes that overlap share their shapes, and these turn complex with any coupling by damping.
        apart = np.abs(model.poles - model.poles[r]) > 2 * (half + half[r])
        alone = bool(np.sum(~apart) == 1 or left[r] > _NOT_NOISE)
        complex_shape = collinear[r] < settings.min_mpc or deviation[r] > settings.max_mpd_deg
        if frequency * (1 + damping) < low or frequency * (1 - damping) > high:
            faults.append(because(Why.BEYOND, frequency, more=RESIDUAL))
        elif state.modes[r].presence < settings.min_presence and (
            frequency * (1 - damping) < low or frequency * (1 + damping) > high
        ):
            faults.append(because(Why.FLANK, frequency, more=RESIDUAL))
        elif damping > settings.max_damping_ratio:
            faults.append(because(Why.DAMPED, damping, more=RESIDUAL))
        elif alone and complex_shape:
            faults.append(because(Why.COMPLEX_REFINED, collinear[r], deviation[r], more=RESIDUAL))
        else:
            faults.append(None)
    return faults
