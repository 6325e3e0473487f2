"""The modes that the data need: clusters are fitted to the FRFs, and what noise could do is taken out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.modal.imperfect import imperfect
from identify.modal.layout import Layout
from identify.modal.lsfd import MORE_RESIDUALS, ModalModel, lsfd
from identify.modal.mac import mpc, mpd
from identify.modal.refine import FULL, QUICK, Equations, Fit, fit, minimise, without
from identify.modal.selection import Candidate, idle_reason
from identify.modal.settings import ModalSettings
from identify.modal.uncertainty import covariance
from identify.modal.verified import BEYOND, Verified, pole_arrays, rows, stays
from identify.modal.weights import leftover, over_noise, required, reweighted

_BACKGROUND = 0.7
"""Damping ratio beyond which a pole does not even serve as background."""
_NOT_NOISE = 3.0
"""What is left over independent noise, beyond which the model is wrong rather than small."""
_NARROW = 0.8
"""Half-power bandwidth, in lines, of a peak that leaks."""
_REACH = 3.0
"""Modes this near to one that is left out, in half-bandwidths of both, may take its place."""
_UNSURE = 0.05
"""Poles whose standard deviation, in half-bandwidths, is larger may be the second of a pair for one mode."""


@dataclass(frozen=True)
class _State:
    """A fit, the candidate behind each of its poles, and those that went."""

    fit: Fit
    modes: list[Candidate]
    gone: list[Candidate]


def verify(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """Modes that explain more than noise could, refined together; modes chosen by hand all stay.

    Where the FRFs are off in ways that no mode explains (they change from run to run, leak, are not quite
    linear), noise is no measure of what a mode must explain: there `imperfect` has its rules.
    """
    equations = Equations.of(layout, settings.residuals)
    if settings.modes_hz is not None:
        return _split(_held(_begun(equations, modes, layout), layout), layout, settings)
    state = _enriched(_settled(_begun(equations, modes, layout), layout))
    if over_noise(state.fit) > _NOT_NOISE or np.any(_narrow(state.fit)):
        return imperfect(modes, layout, settings)
    if settings.min_contribution is not None:
        state = _contributing(state, layout, settings.min_contribution)
    for _ in range(4):
        count = len(state.fit.poles)
        state = _merged(_pruned(_refined(_refined(state, *QUICK), *FULL), layout))
        if len(state.fit.poles) == count:
            break
    return _split(state, layout, settings)


def _begun(equations: Equations, modes: list[Candidate], layout: Layout) -> _State:
    poles, participation = pole_arrays(modes, layout)
    start = fit(equations, poles, participation, np.ones(len(poles), dtype=bool))
    return _State(_weighted(_weighted(start)), list(modes), [])


def _settled(state: _State, layout: Layout) -> _State:
    """Clusters that are more than noise, refined."""
    state = _pruned(state, layout)
    for _ in range(2):
        state = _pruned(_refined(state, *QUICK), layout)
    return state


def _narrow(found: Fit) -> Mask:
    """Poles whose half-power bandwidth is less than a line, (m,)."""
    s = found.equations.s
    spacing = (s[-1].imag - s[0].imag) / (len(s) - 1)
    inside = (found.poles.imag > s[0].imag) & (found.poles.imag < s[-1].imag)
    return np.asarray(inside & (2 * (s[0].real - found.poles.real) < _NARROW * spacing))


def _weighted(found: Fit) -> Fit:
    return fit(reweighted(found), found.poles, found.participation, found.free)


def _refined(state: _State, steps: int, tolerance: float) -> _State:
    return replace(state, fit=minimise(_weighted(state.fit), steps, tolerance))


def _held(state: _State, layout: Layout) -> _State:
    """Modes chosen by hand, refined; one that wanders is held at its cluster."""
    chosen, refined = state.fit, state
    for _ in range(len(state.modes) + 1):
        refined = _refined(_refined(replace(state, fit=chosen), *QUICK), *FULL)
        wandered = np.array(
            [not stays(m, p, layout) for m, p in zip(state.modes, refined.fit.poles, strict=True)],
            dtype=bool,
        )
        if not np.any(wandered & chosen.free):
            break
        chosen = fit(chosen.equations, chosen.poles, chosen.participation, chosen.free & ~wandered)
    return refined


def _pruned(state: _State, layout: Layout) -> _State:
    """Without poles that left and, one by one, the one that explains least of what it must."""
    found, modes, gone = state.fit, list(state.modes), list(state.gone)
    for r in np.flatnonzero(_left(found.poles, layout))[::-1]:
        gone.append(replace(modes.pop(r), reason=f"not a resonance: it went to {_said(found.poles[r])}"))
        found = without(found, int(r))
    needed = np.where([mode.by_hand for mode in modes], 0.0, required(found))
    while len(found.poles):
        over = np.divide(found.rises(), needed, out=np.full(len(needed), np.inf), where=needed > 0)
        least = int(np.argmin(over))
        if over[least] >= 1:
            break
        gone.append(replace(modes.pop(least), reason=_chance(over[least])))
        found, needed = without(found, least), np.delete(needed, least)
    return replace(state, fit=found, modes=modes, gone=gone)


def _merged(state: _State) -> _State:
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
        gone = replace(modes.pop(r), reason=_chance(over) + ", once its neighbours may move")
        state = replace(state, fit=fewer, modes=modes, gone=[*state.gone, gone])


def _doubt(found: Fit) -> Array:
    """Standard deviation of every pole in half-bandwidths, (m,)."""
    spread = np.sqrt(np.abs(np.trace(covariance(found), axis1=1, axis2=2)) / 2)
    return np.asarray(spread / -found.poles.real)


def _replaced(found: Fit, r: int) -> tuple[float, Fit]:
    """What a mode explains over what it must when neighbours may move in its place; the fit without it."""
    pole = found.poles[r]
    others = np.delete(found.poles, r)
    near = np.abs(others - pole) < _REACH * (-others.real - pole.real)
    fewer = without(found, r)
    moved = minimise(fit(fewer.equations, fewer.poles, fewer.participation, near), 8, 1e-4)
    over = (moved.cost - found.cost) / required(found)[r]
    return over, fit(moved.equations, moved.poles, moved.participation, np.ones(len(near), dtype=bool))


def _chance(over: float) -> str:
    return f"explains only {over:.0%} of what a mode must explain beyond noise"


def _said(pole: complex) -> str:
    return f"{abs(pole) / (2 * np.pi):.4g} Hz with {-pole.real / abs(pole):.1%} damping"


def _left(poles: Complex, layout: Layout) -> Mask:
    """Poles too far beyond the band, or with too much damping, to serve even as background."""
    size = np.maximum(np.abs(poles), 1e-300) / (2 * np.pi)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    far = (size < low / BEYOND) | (size > high * BEYOND)
    return np.asarray(far | (-poles.real > _BACKGROUND * np.abs(poles)) | (poles.imag <= 0))


def _enriched(state: _State) -> _State:
    """With further residual terms where these lower the cost by more than noise would (Bayes' criterion)."""
    for kinds in MORE_RESIDUALS:
        if not state.fit.equations.kinds:
            return state
        found = state.fit
        more = replace(found.equations, kinds=found.equations.kinds + kinds)
        richer = minimise(fit(more, found.poles, found.participation, found.free), *QUICK)
        price = (richer.unknowns - found.unknowns) * np.log(2 * found.equations.frf.size)
        if found.cost - richer.cost <= price * richer.variance:
            return state
        state = replace(state, fit=richer)
    return state


def _dropped(state: _State, reasons: dict[int, str]) -> _State:
    found, modes, gone = state.fit, list(state.modes), list(state.gone)
    for r in sorted(reasons, reverse=True):
        gone.append(replace(modes.pop(r), reason=reasons[r]))
        found = without(found, r)
    return replace(state, fit=found, modes=modes, gone=gone)


def _contributing(state: _State, layout: Layout, least: float) -> _State:
    """Without modes that explain less than this share of the response around them."""
    while len(state.modes):
        share = np.where([mode.by_hand for mode in state.modes], np.inf, leftover(state.fit)[1])
        r = int(np.argmin(share))
        if share[r] >= least:
            break
        state = _dropped(state, {r: idle_reason(share[r])})
    return _pruned(_refined(state, *QUICK), layout)


def _split(state: _State, layout: Layout, settings: ModalSettings) -> Verified:
    """Modes of the table by frequency, and what else was fitted."""
    found = state.fit
    equations = found.equations
    weight = np.outer(equations.line, equations.reference)
    model = lsfd(layout, found.poles, found.participation, equations.kinds, weight)
    faults = (
        [""] * len(found.poles) if settings.modes_hz is not None else _faults(found, model, layout, settings)
    )
    faults = ["" if mode.by_hand else fault for mode, fault in zip(state.modes, faults, strict=True)]
    order = np.argsort(np.abs(model.poles), kind="stable")
    inner = np.array([r for r in order if not faults[r]], dtype=int)
    outer = np.array([r for r in order if faults[r]], dtype=int)
    gone = state.gone + [
        replace(state.modes[r], pole=complex(model.poles[r]), reason=faults[r]) for r in outer
    ]
    modes = [state.modes[r] for r in inner]
    inside = rows(model, inner, model.residuals)
    outside, by_noise = rows(model, outer, {}), over_noise(found) <= _NOT_NOISE
    return Verified(modes, inside, outside, covariance(found)[inner], gone, by_noise=by_noise)


def _faults(found: Fit, model: ModalModel, layout: Layout, settings: ModalSettings) -> list[str]:
    """Why a fitted pole is no mode of the band, or nothing."""
    collinear, deviation = mpc(model.shapes), np.degrees(mpd(model.shapes))
    left, _ = leftover(found)
    half, size = -model.poles.real, np.abs(model.poles)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    faults = []
    for r in range(len(model)):
        frequency, damping = size[r] / (2 * np.pi), half[r] / size[r]
        # Modes that overlap share their shapes, and these turn complex with any coupling by damping.
        apart = np.abs(model.poles - model.poles[r]) > 2 * (half + half[r])
        alone = bool(np.sum(~apart) == 1 or left[r] > _NOT_NOISE)
        complex_shape = collinear[r] < settings.min_mpc or deviation[r] > settings.max_mpd_deg
        if frequency * (1 + damping) < low or frequency * (1 - damping) > high:
            faults.append(f"a resonance beyond the band, at {frequency:.4g} Hz; kept as a residual")
        elif damping > settings.max_damping_ratio:
            faults.append(f"damping ratio {damping:.1%} is not structural; kept as a residual")
        elif alone and complex_shape:
            shape = f"MPC {collinear[r]:.2f}, MPD {deviation[r]:.0f} deg"
            faults.append(f"refined shape is complex: {shape}; kept as a residual")
        else:
            faults.append("")
    return faults
