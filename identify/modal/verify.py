"""The modes that the data need: clusters are fitted to the FRFs, what noise could do is taken out, what is
missing is sought in the rest, until nothing is left but noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.modal.layout import Layout
from identify.modal.lsfd import MORE_RESIDUALS, ModalModel, lsfd
from identify.modal.mac import mpc, mpd
from identify.modal.refine import FULL, QUICK, Equations, Fit, fit, minimise, without
from identify.modal.search import places, proposal
from identify.modal.selection import Candidate, arrays
from identify.modal.settings import ModalSettings
from identify.modal.stabilisation import Diagram, presence
from identify.modal.uncertainty import covariance
from identify.modal.weights import leftover, over_noise, required, reweighted

_ROUNDS, _AT_ONCE = 6, 8
_BEYOND = 1.5
"""How far (as a factor) beyond the band a resonance may be and still be told from residuals."""
_BACKGROUND = 0.7
"""Damping ratio beyond which a pole does not even serve as background."""
_SHARE = 0.75
"""Least part that a new mode explains of itself and what is left beyond noise around it."""
_NARROW, _LEAKS = 0.8, 10
"""Half-power bandwidth, in lines, of a peak that leaks, and how many lines far."""
_FEW = 3
"""Modes that are too few to tell by how many got a neighbour."""
_NOT_NOISE = 3.0
"""What is left over independent noise, beyond which the model is wrong rather than small."""
_REACH = 3.0
"""Modes this near to a new one, in half-bandwidths of both, are refined with it."""


_UNSURE = 0.05
"""Poles whose standard deviation, in half-bandwidths, is larger may be the second of a pair for one mode."""


@dataclass(frozen=True)
class Verified:
    """Modes that the data need, their model (rows in the same order), pole covariance (m, 2, 2) and those
    that are none.

    outside: what was fitted with the rest and is no mode of the table: resonances beyond the band, poles with
    too much damping or a complex shape; they act as residuals.
    """

    modes: list[Candidate]
    model: ModalModel
    outside: ModalModel
    covariance: np.ndarray
    rejected: list[Candidate]


@dataclass(frozen=True)
class _State:
    """A fit, the candidate behind each of its poles, those that went and places that were tried in vain."""

    fit: Fit
    modes: list[Candidate]
    gone: list[Candidate]
    vain: list[complex]


def unrefined(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """The modes as their clusters give them."""
    poles, participation = _arrays(modes, layout)
    model = lsfd(layout, poles, participation, settings.residuals)
    return Verified(modes, model, _rows(model, np.zeros(0, dtype=int), {}), np.zeros((len(modes), 2, 2)), [])


def verify(modes: list[Candidate], layout: Layout, settings: ModalSettings, diagram: Diagram) -> Verified:
    """Modes that explain more than noise could, refined together; modes chosen by hand all stay."""
    poles, participation = _arrays(modes, layout)
    equations = Equations.of(layout, settings.residuals)
    start = _begun(equations, modes, poles, participation)
    if settings.modes_hz is not None:
        return _split(_held(start, layout), layout, settings)
    state = _complete(start, layout)
    if state is None:
        plain = _begun(replace(equations, growing=False), modes, poles, participation)
        state = _imperfect(_settled(plain, layout), layout, settings)
    else:
        state = _believed(state, layout, settings, diagram)
    for _ in range(4):
        count = len(state.fit.poles)
        state = _merged(_pruned(_refined(_refined(state, *QUICK), *FULL), layout))
        if len(state.fit.poles) == count:
            break
    return _split(state, layout, settings)


def _begun(equations: Equations, modes: list[Candidate], poles: Complex, participation: Complex) -> _State:
    start = fit(equations, poles, participation, np.ones(len(poles), dtype=bool))
    return _State(_weighted(_weighted(start)), list(modes), [], [])


def _settled(state: _State, layout: Layout) -> _State:
    """Clusters that are more than noise, refined."""
    state = _pruned(state, layout)
    for _ in range(2):
        state = _pruned(_refined(state, *QUICK), layout)
    return state


def _complete(state: _State, layout: Layout) -> _State | None:
    """With all that what is left of the FRFs shows; None where it stays far from noise: then the FRFs are off
    in ways that no mode explains (they change from run to run, leak, are not quite linear), and further poles
    would always find something.
    """
    state = _enriched(_settled(state, layout))
    before = over_noise(state.fit)
    for k in range(_ROUNDS):
        count = len(state.fit.poles)
        state = _searched(state, layout)
        after = over_noise(state.fit)
        stuck = len(state.fit.poles) == count
        if after > _NOT_NOISE and (stuck or (k > 0 and after > before / 1.2)):
            return None
        if _doubled(state):
            return None
        if stuck:
            break
        before = after
    leaks = np.any(_narrow(state.fit))
    return state if over_noise(state.fit) < _NOT_NOISE and not leaks else None


def _doubled(state: _State) -> bool:
    """Whether every second cluster got a further pole within its half-power bandwidth: then the structure
    changed from run to run, and did not have twice the modes.
    """
    poles, clustered = state.fit.poles, np.array([mode.presence > 0 for mode in state.modes], dtype=bool)
    old, new = poles[clustered], poles[~clustered]
    if len(old) < _FEW or not len(new):
        return False
    near = np.abs(old[:, None] - new) < -2 * old.real[:, None]
    return bool(np.mean(near.any(axis=1)) >= 1 / 2)


def _narrow(found: Fit) -> Mask:
    """Poles whose half-power bandwidth is less than a line, (m,)."""
    s = found.equations.s
    spacing = (s[-1].imag - s[0].imag) / (len(s) - 1)
    inside = (found.poles.imag > s[0].imag) & (found.poles.imag < s[-1].imag)
    return np.asarray(inside & (2 * (s[0].real - found.poles.real) < _NARROW * spacing))


def _arrays(modes: list[Candidate], layout: Layout) -> tuple[Complex, Complex]:
    if modes:
        return arrays(modes)
    return np.zeros(0, dtype=complex), np.zeros((0, len(layout.references)), dtype=complex)


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
            [not _stays(m, p, layout) for m, p in zip(state.modes, refined.fit.poles, strict=True)],
            dtype=bool,
        )
        if not np.any(wandered & chosen.free):
            break
        chosen = fit(chosen.equations, chosen.poles, chosen.participation, chosen.free & ~wandered)
    return refined


def _stays(mode: Candidate, pole: complex, layout: Layout) -> bool:
    reach = max(mode.half_bandwidth, np.pi * layout.spacing_hz)
    return bool(pole.real < 0 and abs(pole - mode.pole) <= reach)


def _pruned(state: _State, layout: Layout) -> _State:
    """Without poles that left and, one by one, the one that explains least of what it must."""
    found, modes, gone = state.fit, list(state.modes), list(state.gone)
    for r in np.flatnonzero(_left(found.poles, layout))[::-1]:
        gone.append(replace(modes.pop(r), reason=f"not a resonance: it went to {_said(found.poles[r])}"))
        found = without(found, int(r))
    needed = required(found)
    while len(found.poles):
        over = found.rises() / needed
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
        doubt[[k for k, mode in enumerate(state.modes) if id(mode) in kept]] = 0
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
    near = _around(np.append(np.delete(found.poles, r), pole), len(found.poles) - 1)[:-1]
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
    far = (size < low / _BEYOND) | (size > high * _BEYOND)
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


def _searched(state: _State, layout: Layout) -> _State:
    """With the modes that what is left of the FRFs shows, refined where they are; those that fail go."""
    found = _weighted(state.fit)
    new: list[tuple[complex, Complex]] = []
    for place in places(found, 3 * _AT_ONCE):
        pole, row = proposal(found, place)
        if any(abs(pole - other) < -0.5 * (pole.real + other.real) / 2 for other in state.vain):
            continue
        new.append((pole, row))
        if len(new) == _AT_ONCE:
            break
    if not new:
        return state
    before = len(found.poles)
    poles = np.append(found.poles, [pole for pole, _ in new])
    participation = np.concatenate([found.participation, np.array([row for _, row in new])])
    grown = fit(found.equations, poles, participation, _around(poles, before))
    grown = minimise(grown, 8, 1e-4)
    grown = replace(grown, free=np.ones(len(poles), dtype=bool))
    grown = fit(grown.equations, grown.poles, grown.participation, grown.free)
    names = state.modes + [_named(pole, row) for pole, row in new]
    kept = _explaining(_pruned(_State(_weighted(grown), names, [], []), layout), before=state.modes)
    vain = [m.pole for m in kept.gone]
    return _State(
        kept.fit, kept.modes, state.gone + [m for m in kept.gone if m.presence > 0], state.vain + vain
    )


def _explaining(state: _State, before: list[Candidate]) -> _State:
    """Without new poles that leave most of what they were put there for."""
    _, share, _ = leftover(state.fit)
    known = {id(mode) for mode in before}
    new = [r for r, mode in enumerate(state.modes) if id(mode) not in known]
    reasons = {r: f"explains {share[r]:.0%} of what is left there" for r in new if share[r] < _SHARE}
    leaked = _leaked(state.fit)
    reasons |= {r: "beside a peak narrower than a line, which leaks" for r in new if leaked[r]}
    return _dropped(state, reasons)


def _leaked(found: Fit) -> Mask:
    """Poles near another one, (m,), where either is narrower than a line: lines do not tell them apart."""
    s = found.equations.s
    spacing = (s[-1].imag - s[0].imag) / (len(s) - 1)
    narrow = _narrow(found)
    near = np.abs(found.poles[:, None].imag - found.poles.imag) < _LEAKS * spacing
    np.fill_diagonal(near, val=False)
    return np.asarray(np.any(near & (narrow[:, None] | narrow), axis=1))


def _dropped(state: _State, reasons: dict[int, str]) -> _State:
    found, modes, gone = state.fit, list(state.modes), list(state.gone)
    for r in sorted(reasons, reverse=True):
        gone.append(replace(modes.pop(r), reason=reasons[r]))
        found = without(found, r)
    return replace(state, fit=found, modes=modes, gone=gone)


def _believed(state: _State, layout: Layout, settings: ModalSettings, diagram: Diagram) -> _State:
    """Without poles that no cluster stands for, where what is left around them is no noise."""
    left, _, _ = leftover(state.fit)
    present = [presence(diagram, pole) for pole in state.fit.poles]
    missing = "appears in {:.0%} of the orders, and what is left there is no noise"
    reasons = {
        r: missing.format(present[r])
        for r, mode in enumerate(state.modes)
        if mode.presence == 0 and left[r] > _NOT_NOISE and present[r] < settings.min_presence / 2
    }
    if reasons:
        state = _pruned(_refined(_dropped(state, reasons), *QUICK), layout)
    return state


def _imperfect(state: _State, layout: Layout, settings: ModalSettings) -> _State:
    """Where what is left is no noise: without modes that explain less than their share, or double another."""
    while len(state.modes):
        _, _, share = leftover(state.fit)
        r = int(np.argmin(share))
        if share[r] >= settings.min_contribution:
            break
        state = _dropped(state, {r: f"explains only {share[r]:.1%} of the response around it"})
    state = _pruned(_refined(state, *QUICK), layout)
    return _dropped(state, _doubles(state.fit, settings))


def _doubles(found: Fit, settings: ModalSettings) -> dict[int, str]:
    """Modes that have the shape of a neighbour which explains more."""
    _, _, share = leftover(found)
    shapes = found.shapes()
    shapes = shapes / np.maximum(np.linalg.norm(shapes, axis=1, keepdims=True), np.finfo(float).tiny)
    alike = np.abs(shapes.conj() @ shapes.T) ** 2
    half = -found.poles.real
    reasons: dict[int, str] = {}
    for r in map(int, np.argsort(share)):
        near = np.abs(found.poles - found.poles[r]) < 1.5 * np.maximum(half, half[r])
        near &= (alike[r] > settings.duplicate_mac) & (share > share[r])
        near[list(reasons)] = False
        if near.any():
            other = int(np.flatnonzero(near)[0])
            hz = abs(found.poles[other]) / (2 * np.pi)
            reasons[r] = f"duplicate of {hz:.4g} Hz (MAC {alike[r, other]:.2f}) when refined"
    return reasons


def _around(poles: Complex, before: int) -> Mask:
    """New poles and those near to one."""
    half = -poles.real
    near = np.abs(poles[:, None] - poles[before:]) < _REACH * (half[:, None] + half[before:])
    return np.asarray(near.any(axis=1))


def _named(pole: complex, row: Complex) -> Candidate:
    """A candidate that no cluster stands for."""
    return Candidate(pole, row, np.zeros(0, dtype=complex), 0.0, 0.0, 0.0, np.nan, np.nan)


def _split(state: _State, layout: Layout, settings: ModalSettings) -> Verified:
    """Modes of the table by frequency, and what else was fitted."""
    found = state.fit
    equations = found.equations
    weight = np.outer(equations.line, equations.reference)
    model = lsfd(layout, found.poles, found.participation, equations.kinds, weight)
    faults = (
        [""] * len(found.poles) if settings.modes_hz is not None else _faults(found, model, layout, settings)
    )
    order = np.argsort(np.abs(model.poles), kind="stable")
    inner = np.array([r for r in order if not faults[r]], dtype=int)
    outer = np.array([r for r in order if faults[r]], dtype=int)
    gone = state.gone + [
        replace(state.modes[r], pole=complex(model.poles[r]), reason=faults[r]) for r in outer
    ]
    modes = [state.modes[r] for r in inner]
    inside = _rows(model, inner, model.residuals)
    return Verified(modes, inside, _rows(model, outer, {}), covariance(found)[inner], gone)


def _faults(found: Fit, model: ModalModel, layout: Layout, settings: ModalSettings) -> list[str]:
    """Why a fitted pole is no mode of the band, or nothing."""
    collinear, deviation = mpc(model.shapes), np.degrees(mpd(model.shapes))
    left, _, _ = leftover(found)
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


def _rows(model: ModalModel, rows: np.ndarray, residuals: dict[str, np.ndarray]) -> ModalModel:
    return ModalModel(model.poles[rows], model.participation[rows], model.shapes[rows], residuals)
