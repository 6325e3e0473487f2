"""Modes that no cluster showed, added to a fit while its residual needs them, and doubts about
them.

Clusters over model orders miss modes that overlap, because low orders show one pole for both.  The fit knows
better: beside a mode that is missing, its residual is no noise.  At every place of a grid of poles the gain
is that of one more pole with all its residues free, the linear unknowns of the others fitted again (a score
test; Rao 1948), on the moments of `gram`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Index, Mask
from identify.core.coded import Coded
from identify.modal.gram import Columns, Functions, gram, products, right
from identify.modal.layout import Layout
from identify.modal.lines import place as place_of
from identify.modal.lines import spacing
from identify.modal.mac import mpc
from identify.modal.reasons import Why, because
from identify.modal.refine import QUICK, Fit, fit, minimise, squared
from identify.modal.selection import IDLE_SHARE, Candidate
from identify.modal.state import REACH, State, dropped, narrow, pruned, refined
from identify.modal.weights import CHANCE, excess, leftover

_STEP, _RATIO = 1.2, 2.7
"""Of a half-bandwidth, between poles of a row of the grid; of the half-bandwidths of its rows. A pole between
those of the grid still has nine tenths of its gain there."""
_WIDEST = 2.0
"""The largest half-bandwidth of the grid over that of the fit's poles around."""
_APART, _AROUND, _LOBE = 3.0, 12.0, 0.2
"""Poles that are added at once are this far apart, in half-bandwidths of both; around one, what has less than
this part of its gain may be a side lobe."""
_CLEAR = 0.03
"""Of the gain of the best place: what has less may be there because of what is missing elsewhere."""
_REACH, _EXCESS = 4.0, 0.2
"""Half-bandwidths around a place in which the residual must hold this part of what noise may explain."""
_MOST = 2e7
"""Places times lines that are looked at in a round."""
_COLUMNS_AT_ONCE = 300_000
"""Places times lines that are worked on at once: new pages for large arrays cost more than arithmetic."""
_ALONE = 1e-9
"""Part of a column that those of the fit leave, below which it is theirs."""


class Addition(NamedTuple):
    """Poles (k,) that a fit lacks, with their participation (k, references)."""

    poles: Complex
    participation: Complex


def missing(found: Fit, barred: Complex, most: int, widest: float = np.inf) -> Addition:
    """The poles that lower the cost of a fit by more than noise could, the most needed first, apart from each
    other and from those barred, with less half-bandwidth than the widest.
    """
    places = _grid(found)
    places = places[-places.real < widest]
    for pole in barred:
        places = places[np.abs(places - pole) > -pole.real - places.real]
    chance = _by_chance(found, places)
    loudest = _loudest(_excess(found, places) / chance, len(found.noise))
    places, chance = places[loudest], chance[loudest]
    refs = found.participation.shape[1]
    residues, over = np.zeros((0, refs, 0), dtype=complex), np.zeros(0)
    if len(places):
        gain, residues = _gains(found, places)
        over = gain / chance
    taken: list[int] = []
    for place in np.argsort(-over, kind="stable"):
        if over[place] < max(1, _CLEAR * np.max(over)) or len(taken) == most:
            break
        if all(_apart(places, over, int(place), other) for other in taken):
            taken.append(int(place))
    left = [np.linalg.svd(residues[place])[0][:, 0] for place in taken]
    return Addition(places[taken], np.array(left, dtype=complex).reshape(-1, refs))


def _apart(places: Complex, over: Array, a: int, b: int) -> bool:
    """Whether one place says something that a better one does not say already."""
    reach = abs(places[a] - places[b]) / -(places[a].real + places[b].real)
    return bool(reach > _AROUND or (reach > _APART and over[a] > _LOBE * over[b]))


def _grid(found: Fit) -> Complex:
    """Poles in and around the band, from the narrowest to the widest that may be missing."""
    s = found.equations.s
    low, high, decay = s[0].imag, s[-1].imag, s[0].real
    least = float(np.min(np.diff(s.imag)))
    inside = -found.poles.real[(found.poles.imag > low) & (found.poles.imag < high)]
    widest = _WIDEST * np.max(inside, initial=4 * least)
    narrowest = max(0.5 * least, 0.5 * np.min(inside, initial=widest))
    rows = max(1, int(np.ceil(np.log(widest / narrowest) / np.log(_RATIO))) + 1)
    places = []
    for half in np.geomspace(narrowest, widest, rows):
        count = int(np.ceil((high - low) / (_STEP * (half + decay)))) + 1
        places.append(-half + 1j * np.linspace(low, high, count))
    return np.concatenate(places)


def _loudest(excess: Array, lines: int) -> Index:
    """Numbers of the places around which the residual has clearly more power than noise, the clearest of them
    where they are too many for so many lines.
    """
    order = np.argsort(-excess, kind="stable")[: max(1, int(_MOST / lines))]
    return np.sort(order[excess[order] > _EXCESS])


def _excess(found: Fit, places: Complex) -> Array:
    """Power of the residual around places beyond independent noise, (places,)."""
    s = found.equations.s
    total = np.append(0.0, np.cumsum(found.left - found.residual.shape[1] * found.noise))
    reach = _REACH * (s[0].real - places.real)
    first, last = (
        np.clip(np.round(place_of(s.imag, places.imag + side * reach)).astype(int), 0, len(s))
        for side in (-1, 1)
    )
    return np.asarray(total[last] - total[first])


def _gains(found: Fit, places: Complex) -> tuple[Array, Complex]:
    """By how much a pole at every place lowers the cost, (places,), and its residues there, (places,
    references, responses).
    """
    equations, refs = found.equations, found.participation.shape[1]
    scale, s = (equations.line * equations.s**equations.power)[:, None], equations.s[:, None]
    basis, unit = equations.basis(found.participation), np.diag(equations.reference).astype(complex)
    functions = equations.functions(found.poles, found.poles[:0])
    gains, residues = [], []
    for some in np.array_split(places, max(1, len(places) * len(s) // _COLUMNS_AT_ONCE)):
        own = Functions.of(scale / (s - some), scale / (s - some.conj()))
        columns = _columns(len(some), unit)
        overlap = gram(*products(own, functions), columns, basis) / found.size
        itself = _own(own, equations.reference)
        taken = (overlap @ found.inverse).reshape(len(some), 2 * refs, -1)
        overlap = overlap.reshape(taken.shape)
        alone = itself - np.matmul(taken, overlap.transpose(0, 2, 1))
        data = right(own, found.residual).reshape(len(some), refs, -1) * equations.reference[:, None]
        parts = np.stack([data.real, data.imag], axis=2).reshape(len(some), 2 * refs, -1)
        solved = _solved(alone, itself, parts)
        gains.append(np.sum(solved * parts, axis=(1, 2)))
        solved = solved.reshape(len(some), refs, 2, -1)
        residues.append(solved[:, :, 0] + 1j * solved[:, :, 1])
    return np.concatenate(gains), np.concatenate(residues)


def _columns(places: int, unit: Complex) -> Columns:
    """For every place and reference the real and the imaginary part of the residue."""
    both = np.stack([unit, 1j * unit], axis=1).reshape(-1, len(unit))
    function: Index = np.repeat(np.arange(places), len(both))
    return Columns(function, np.tile(both, (places, 1)))


def _own(functions: Functions, reference: Array) -> Array:
    """Gram matrices of the columns of each place, (places, 2 references, 2 references)."""
    a, b = np.hsplit(functions.columns, 2)
    across = np.einsum("lg,lg->g", a, b)
    turned = np.array([[np.einsum("lg,lg->g", a, a), across], [across, np.einsum("lg,lg->g", b, b)]])
    blocks = np.einsum("abg,jk->gjakb", turned, np.diag(reference**2))
    return np.asarray(blocks.reshape(len(functions), 2 * len(reference), 2 * len(reference)))


def _solved(alone: Array, own: Array, parts: Array) -> Array:
    """The residues that fit best; none where the fit's own columns leave nothing of a pole's."""
    size = np.sqrt(np.einsum("gaa->ga", own))
    values, vectors = np.linalg.eigh(alone / (size[:, :, None] * size[:, None, :]))
    factor = np.where(values > _ALONE, 1 / np.maximum(values, _ALONE), 0.0)
    turned = np.einsum("gab,gao->gbo", vectors, parts / size[:, :, None])
    return np.asarray(np.einsum("gab,gbo->gao", vectors, turned * factor[:, :, None]) / size[:, :, None])


def _by_chance(found: Fit, places: Complex) -> Array:
    """What noise alone, independent from line to line, makes a pole explain at most, (places,)."""
    s = found.equations.s
    line = np.clip(np.round(place_of(s.imag, places.imag)).astype(int), 0, len(s) - 1)
    freedom = 2 * found.residual.shape[1]
    floor = 1e-24 * found.moments.energy + np.finfo(float).tiny
    return np.asarray(found.noise[line] / 2 * scipy.special.chdtri(freedom, CHANCE) + floor)


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
