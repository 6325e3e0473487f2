"""Modes that no cluster showed, added to a fit while its residual needs them (`addition`), and doubts about
them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Complex, Mask
from identify.core.coded import Coded
from identify.modal.addition import Addition, missing
from identify.modal.layout import Layout
from identify.modal.lines import spacing
from identify.modal.mac import mpc
from identify.modal.reasons import Why, because
from identify.modal.refine import QUICK, fit, minimise, squared
from identify.modal.selection import IDLE_SHARE, Candidate
from identify.modal.state import REACH, State, dropped, narrow, pruned, refined
from identify.modal.weights import excess, leftover

_PATTERN, _REAL, _DOUBTS = 2, 0.8, 2
"""How many added modes with next to no response, or with shapes of less MPC, say that what is left has a
pattern of its own: in errors of a measurement every response has its own phase. So many rounds in a row that
look like it end the search; a mode may look like it while others are missing."""
_GROWING = (12, 1e-4)
"""Steps and fall of the cost between rounds: what is not yet fitted looks like a mode that is missing."""
_AT_ONCE, _SPARE = 4, 8
"""How many modes are added in a round; how many more than there were, in all."""
_RISES = 1.1
"""What is left over noise may come out so much larger with another mode, for noise is estimated again."""
_ROUNDS = 20
_NEAR = 0.6
"""Error over RMS of the FRFs beyond which no residual says what is missing."""
_HOPELESS = ((5.0, 2, 0.5), (0.1, 3, 0.75))
"""What is left beyond noise, over noise, must where it is more than this fall in so many rounds to a part."""
_FALLS, _NARROWER = 0.9, 0.6
"""A round that adds no mode counts where what is left beyond noise falls to this part; if not, poles of less
than this part of its widest half-bandwidth are sought."""


def grown(begun: State, layout: Layout, others: list[Candidate]) -> State:
    """With the modes that the residual still holds, round by round, until it holds no more.

    Where the FRFs are off in ways that no mode explains there is always one more: it ends where modes do not
    pay, or are twice as many as were; and none is believed where most have no shape, or next to no response.
    """
    state = begun
    if not _may_grow(begun):
        return begun
    barred = np.array([c.pole for c in others if c.why is Why.DROPPED], dtype=complex)
    left, widest, doubts = [excess(state.fit)], np.inf, 0
    while doubts < _DOUBTS and len(state.modes) < 2 * len(begun.modes) + _SPARE and not _is_hopeless(left):
        more = missing(state.fit, barred, _AT_ONCE, widest)
        if not len(more.poles):
            break
        grown, slim = _round(state, more, barred, layout, others)
        barred = np.append(barred, slim)
        if _is_better(grown, state):
            state, widest = grown, np.inf
            left.append(excess(state.fit))
            doubts = doubts + 1 if _has_pattern(state, begun, layout) else 0
        else:
            # What explains most may be no mode, such as what lies far beyond the band; then what is narrower.
            widest = _NARROWER * np.max(-more.poles.real)
    if doubts:
        return begun
    share = leftover(state.fit)[1]
    idle = np.flatnonzero(_added(state, begun, layout) & _is_idle(state))
    return dropped(state, {int(r): because(Why.IDLE, share[r]) for r in idle})


def _is_better(grown: State, state: State) -> bool:
    """Whether a round added a mode, and lost none that was needed, or put better ones in place of others."""
    before, after = excess(state.fit), excess(grown.fit)
    more = len(grown.modes) > len(state.modes) and 1 + after < _RISES * (1 + before)
    return more or after < _FALLS * before


def _may_grow(begun: State) -> bool:
    """Whether the fit is near enough to the FRFs for what is left to say what is missing."""
    equations = begun.fit.equations
    error = np.sum(equations.line**-2.0 * (squared(begun.fit.residual) @ equations.each**-2.0))
    near = error < _NEAR**2 * np.sum(equations.frf**2)
    return bool(begun.modes and near and not np.any(narrow(begun.fit)))


def _is_hopeless(left: list[float]) -> bool:
    """Whether rounds do not pay, from what each left beyond noise."""
    stuck = [
        len(left) > rounds and left[-1] > max(least, part * left[-1 - rounds])
        for least, rounds, part in _HOPELESS
    ]
    return any(stuck) or len(left) > _ROUNDS


def _round(
    state: State, more: Addition, barred: Complex, layout: Layout, others: list[Candidate]
) -> tuple[State, Complex]:
    """With those of some poles that last, and where a pole became narrower than a line."""
    if not len(more.poles):
        return state, more.poles
    grown = pruned(refined(_with(state, more, layout, others), *_GROWING), layout)
    grown = dropped(grown, _entered(state, grown, barred))
    slim = np.flatnonzero(narrow(grown.fit))
    slow = grown.fit.poles[slim].imag
    apart = spacing(2 * np.pi * layout.frequency_hz, slow)
    places = np.asarray(slow * 1j - apart / 2, dtype=np.complex128)
    return dropped(grown, dict.fromkeys(map(int, slim), because(Why.SLIM))), places


def _has_pattern(state: State, begun: State, layout: Layout) -> bool:
    """Whether most of the modes that were added are what errors of the measurement look like."""
    new = _added(state, begun, layout)
    doubtful = np.sum(new & ((mpc(state.fit.shapes()) < _REAL) | _is_idle(state)))
    return bool(doubtful > _PATTERN and 2 * doubtful > np.sum(new))


def _added(state: State, begun: State, layout: Layout) -> Mask:
    """Modes of the band that were not there at first, (m,)."""
    size, half = np.abs(state.fit.poles), -state.fit.poles.real
    low, high = 2 * np.pi * layout.frequency_hz[0], 2 * np.pi * layout.frequency_hz[-1]
    old = {id(mode) for mode in begun.modes}
    new = np.array([id(mode) not in old for mode in state.modes], dtype=bool)
    return np.asarray(new & (size > low + half) & (size < high - half))


def _is_idle(state: State) -> Mask:
    """Modes that stand alone, that no cluster showed and that explain next to nothing, (m,)."""
    poles, share = state.fit.poles, leftover(state.fit)[1]
    half = -poles.real
    apart = np.abs(poles[:, None] - poles) / (half[:, None] + half) + np.diag(np.full(len(poles), np.inf))
    alone = np.min(apart, axis=1, initial=np.inf) > REACH
    blank = np.array([mode.presence == 0 for mode in state.modes], dtype=bool)
    return np.asarray(alone & blank & (share < IDLE_SHARE))


def _entered(before: State, after: State, barred: Complex) -> dict[int, Coded]:
    """New poles that moved to where none may be, and why they go."""
    old = {id(mode) for mode in before.modes}
    apart = np.abs(after.fit.poles[:, None] - barred) / -(after.fit.poles.real[:, None] + barred.real)
    near = np.flatnonzero(np.min(apart, axis=1, initial=np.inf) < 1)
    return {int(r): because(Why.BARRED) for r in near if id(after.modes[r]) not in old}


def _with(state: State, more: Addition, layout: Layout, others: list[Candidate]) -> State:
    """With further poles, these and the ones around them fitted, the others where they are."""
    found = state.fit
    poles = np.concatenate([found.poles, more.poles])
    participation = np.concatenate([found.participation, more.participation])
    apart = np.abs(poles[:, None] - more.poles) / -(poles.real[:, None] + more.poles.real)
    near = np.min(apart, axis=1) < REACH
    moved = minimise(fit(found.equations, poles, participation, near), *QUICK)
    free = fit(found.equations, moved.poles, moved.participation, np.ones(len(poles), dtype=bool))
    new = [_candidate(complex(p), row, layout, others) for p, row in zip(*more, strict=True)]
    return replace(state, fit=free, modes=[*state.modes, *new])


def _candidate(pole: complex, row: Complex, layout: Layout, others: list[Candidate]) -> Candidate:
    """What stands behind an added pole: the cluster there that few orders showed, or none."""
    near = [c for c in others if c.is_rare and abs(c.pole - pole) <= -pole.real]
    nearest = min(near, key=lambda c: abs(c.pole - pole), default=None)
    if nearest is not None:
        return replace(nearest, reason=None)
    blank = np.zeros(len(layout.responses), dtype=complex)
    return Candidate(pole, row, blank, 0.0, 0.0, 0.0, 1.0, 0.0)
