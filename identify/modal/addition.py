"""Where FRFs still hold a mode that a fit does not have: what one more pole would explain, place by place.

Clusters over model orders miss modes that overlap, because low orders show one pole for both.  The fit knows
better: beside a mode that is missing, its residual is no noise.  At every place of a grid of poles the gain
is that of one more pole with all its residues free, the linear unknowns of the others fitted again (a score
test; Rao 1948), on the moments of `gram`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Index
from identify.modal.gram import Columns, Functions, gram, products, right
from identify.modal.lines import place as place_of
from identify.modal.refine import Fit
from identify.modal.weights import CHANCE

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
_AT_ONCE = 300_000
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
    for some in np.array_split(places, max(1, len(places) * len(s) // _AT_ONCE)):
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
