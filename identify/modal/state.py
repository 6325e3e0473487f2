"""A modal model on its way: a fit and the candidate behind each of its poles, refined and pruned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Complex, Mask
from identify.core.coded import Coded
from identify.modal.layout import Layout
from identify.modal.lines import spacing
from identify.modal.reasons import Why, because
from identify.modal.refine import Fit, fit, minimise, without
from identify.modal.selection import Candidate
from identify.modal.weights import required, reweighted

_BACKGROUND = 0.7
"""Damping ratio beyond which a pole does not even serve as background."""
_FAR = 4.0
"""How far (as a factor) beyond the band a resonance may be that the FRFs in it need."""
_NARROW = 0.8
"""Half-power bandwidth, in lines, of a peak that leaks."""
REACH = 3.0
"""Modes this near to one that is left out, in half-bandwidths of both, may take its place."""


@dataclass(frozen=True)
class State:
    """A fit, the candidate behind each of its poles, and those that went."""

    fit: Fit
    modes: list[Candidate]
    gone: list[Candidate]


def narrow(found: Fit) -> Mask:
    """Poles whose half-power bandwidth is less than a line, (m,)."""
    s = found.equations.s
    apart = spacing(s.imag, found.poles.imag)
    inside = (found.poles.imag > s[0].imag) & (found.poles.imag < s[-1].imag)
    return np.asarray(inside & (2 * (s[0].real - found.poles.real) < _NARROW * apart))


def weighted(found: Fit) -> Fit:
    return fit(reweighted(found), found.poles, found.participation, found.free)


def refined(state: State, steps: int, tolerance: float) -> State:
    return replace(state, fit=minimise(weighted(state.fit), steps, tolerance))


def pruned(state: State, layout: Layout) -> State:
    """Without poles that left and, one by one, the one that explains least of what it must."""
    found, modes, gone = state.fit, list(state.modes), list(state.gone)
    for r in np.flatnonzero(_left(found.poles, layout))[::-1]:
        pole = found.poles[r]
        reason = because(Why.LEFT, abs(pole) / (2 * np.pi), -pole.real / abs(pole))
        gone.append(replace(modes.pop(r), reason=reason))
        found = without(found, int(r))
    needed = np.where([mode.by_hand for mode in modes], 0.0, required(found))
    while len(found.poles):
        over = np.divide(found.rises(), needed, out=np.full(len(needed), np.inf), where=needed > 0)
        least = int(np.argmin(over))
        if over[least] >= 1:
            break
        gone.append(replace(modes.pop(least), reason=because(Why.IDLE_BY_NOISE, over[least])))
        found, needed = without(found, least), np.delete(needed, least)
    return replace(state, fit=found, modes=modes, gone=gone)


def _left(poles: Complex, layout: Layout) -> Mask:
    """Poles too far beyond the band, or with too much damping, to serve even as background."""
    size = np.maximum(np.abs(poles), 1e-300) / (2 * np.pi)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    far = (size < low / _FAR) | (size > high * _FAR)
    return np.asarray(far | (-poles.real > _BACKGROUND * np.abs(poles)) | (poles.imag <= 0))


def dropped(state: State, reasons: dict[int, Coded]) -> State:
    found, modes, gone = state.fit, list(state.modes), list(state.gone)
    for r in sorted(reasons, reverse=True):
        gone.append(replace(modes.pop(r), reason=reasons[r]))
        found = without(found, r)
    return replace(state, fit=found, modes=modes, gone=gone)
