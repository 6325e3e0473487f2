"""What effects would gain to first order: of each kind the places whose amplitudes least squares has above
zero, where they can only be that, beside all that is searched already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.motion.missing.catalogue import OFF, Kind, log_prior
from identify.motion.missing.springs import SpringKind
from identify.motion.study import MotionCandidate

_WIDEST = 10.0
"""How far from where it is an amplitude starts, over its size."""
_ALIKE = 1e-6
"""Least eigenvalue of the correlations of columns from which they can be distinguished."""
_LEADS = 0.5
"""Share of what the best place gains alone from which another one begins a set of its own."""


@dataclass(frozen=True)
class Place:
    """A kind at one of its places (a joint, a coordinate, a link): the change (count, k) of all residuals
    with each of its amplitudes; its number in the kind.
    """

    kind: Kind | SpringKind
    number: int
    columns: Array

    @property
    def positive(self) -> bool:
        """Whether amplitudes can only be above zero."""
        return isinstance(self.kind, SpringKind) or not (self.kind.least < 0 or self.kind.relative)

    def unknowns(self, amplitudes: Array) -> int:
        """How many its amplitudes (k,) bring: a spring that gives way has a damper."""
        return 2 * int(np.sum(amplitudes > 0)) if isinstance(self.kind, SpringKind) else len(amplitudes)


@dataclass(frozen=True)
class Solution:
    """Places of a kind with the amplitudes (columns of all,) that least squares has for them, how many
    unknowns these are, and what they gain to first order, natural logarithm of the odds.
    """

    places: Sequence[Place]
    amplitudes: Array
    unknowns: int
    log_odds: float

    @property
    def change(self) -> Array:
        """(count,): of all residuals."""
        return np.concatenate([place.columns for place in self.places], axis=1) @ self.amplitudes

    def log_prior(self, share: float = 1.0) -> float:
        """Of a share of the amplitudes."""
        return log_prior(self.places[0].kind, [place.number for place in self.places], self.starts(share))

    def starts(self, share: float = 1.0) -> dict[str, float]:
        """Where the parameters start, by name, with a share of the amplitudes."""
        found = dict[str, float]()
        for place, own in zip(self.places, _by_place(self.places, share * self.amplitudes), strict=True):
            kind, n = place.kind, place.number
            if isinstance(kind, SpringKind):
                found |= kind.starts(dict(zip(kind.places[n], own.tolist(), strict=True)))
            else:
                found |= _starts(kind, n, own)
        return found


@dataclass(frozen=True)
class Sight:
    """Residuals over noise (count,), and what of them nothing searched explains; an orthonormal basis (count,
    r) of what is searched; how many residuals are independent, and how many places are looked at.
    """

    whole: Array
    residual: Array
    basis: Array
    independent: float
    tried: int

    def beyond(self, columns: Array) -> Array:
        """What is left of columns (count, n) beside what is searched, and of all zeros where that is nothing
        but rounding.
        """
        left = columns - self.basis @ (self.basis.T @ columns)
        told = np.linalg.norm(left, axis=0) > 1e-6 * np.linalg.norm(columns, axis=0)
        return np.asarray(left * told)

    def log_odds(self, squares: float, unknowns: int, places: int) -> float:
        """For a model that leaves this sum of squares, with so many more unknowns in so many places: half n
        ln of the ratio, less the price of unknowns (Schwarz 1978) and of having looked at all places.
        """
        ratio = float(self.residual @ self.residual) / max(squares, 1e-300)
        price = unknowns * 0.5 * np.log(max(self.independent, 2.0)) + places * np.log(self.tried)
        return float(0.5 * self.independent * np.log(ratio) - price)


def solutions(places: Sequence[Place], sight: Sight) -> list[Solution]:
    """Of each kind the sets of places that promise something: those that lead, alone and grown."""
    kinds = {id(place.kind): place.kind for place in places}.values()
    return [one for kind in kinds for one in _of_kind([p for p in places if p.kind is kind], sight)]


def _of_kind(places: Sequence[Place], sight: Sight) -> list[Solution]:
    """The sets of a kind's places, each one that leads alone, and grown by what gains most beside those in
    it; each set once.
    """
    left = [sight.beyond(place.columns) for place in places]
    frame, small = np.linalg.qr(np.concatenate(left, axis=1))
    target = frame.T @ sight.residual
    outside = float(sight.residual @ sight.residual - target @ target)
    reduced = _Reduced(places, _by_place(places, small.T), target, outside, sight)
    alone = {n: reduced.solved([n]) for n in range(len(places))}
    gains = {n: one[0].log_odds for n, one in alone.items() if one is not None}
    most = max(gains.values(), default=0.0)
    leads = sorted((n for n in gains if gains[n] > 0 and gains[n] >= _LEADS * most), key=lambda n: -gains[n])
    found = dict[tuple[int, ...], Solution]()
    for lead in leads:
        for one in reduced.grown(lead):
            found.setdefault(tuple(sorted(place.number for place in one.places)), one)
    return list(found.values())


@dataclass(frozen=True)
class _Reduced:
    """Places of a kind in the space of all of their columns: rows (k, n) of each, the residual (n,) there,
    and the squares of what is outside.
    """

    places: Sequence[Place]
    rows: Sequence[Array]
    target: Array
    outside: float
    sight: Sight

    def grown(self, lead: int) -> list[Solution]:
        """A place that leads, and the set that takes in others beside it as long as that gains."""
        first = self.solved([lead])
        assert first is not None
        best, picked = first
        while True:
            rest = [n for n in range(len(self.places)) if n not in picked]
            trials = [(n, self.solved([*picked, n])) for n in rest]
            able = [one for n, one in trials if one is not None and n in one[1]]
            top = max(able, key=lambda one: one[0].log_odds, default=None)
            if top is None or top[0].log_odds <= best.log_odds:
                return [first[0], best]
            best, picked = top

    def solved(self, numbers: Sequence[int]) -> tuple[Solution, list[int]] | None:
        """Places beside each other, and those of them whose amplitudes are possible; None where none is, or
        they cannot be distinguished.
        """
        columns = np.concatenate([self.rows[n] for n in numbers]).T
        found = _solved(columns, self.target, positive=self.places[0].positive)
        if found is None:
            return None
        parts = _by_place([self.places[n] for n in numbers], found[0])
        able = {n: part for n, part in zip(numbers, parts, strict=True) if self._possible(n, part)}
        if not able:
            return None
        unknowns = sum(self.places[n].unknowns(part) for n, part in able.items())
        odds = self.sight.log_odds(self.outside + found[1], unknowns, len(able))
        own = [self.places[n] for n in able]
        solution = Solution(own, np.concatenate(list(able.values())), unknowns, odds)
        return replace(solution, log_odds=odds + solution.log_prior()), list(able)

    def _possible(self, number: int, amplitudes: Array) -> bool:
        return not self.places[number].positive or bool(amplitudes.max() > 0)


def _solved(columns: Array, residual: Array, *, positive: bool) -> tuple[Array, float] | None:
    """Amplitudes that least squares has for columns (n, k), none below zero where they must be positive, and
    the sum of squares left; None where columns cannot be distinguished, or are nothing.
    """
    size = np.linalg.norm(columns, axis=0)
    seen = size > 0
    unit = columns[:, seen] / size[seen]
    along = np.zeros(len(size))
    if not seen.any():
        return None
    if positive:
        along[seen] = scipy.optimize.nnls(unit, -residual)[0]
    elif not seen.all() or np.linalg.eigvalsh(unit.T @ unit)[0] < _ALIKE:
        return None
    else:
        along = np.linalg.solve(unit.T @ unit, -unit.T @ residual)
    left = residual + unit @ along[seen]
    return along / np.where(seen, size, 1.0), float(left @ left)


def _by_place(places: Sequence[Place], amplitudes: Array) -> list[Array]:
    """Amplitudes of places, each's own."""
    return np.split(amplitudes, np.cumsum([place.columns.shape[1] for place in places])[:-1])


def effect_of(kind: Kind | SpringKind, places: Sequence[int]) -> MotionCandidate:
    """A kind at some of its places, as a study names it."""
    return kind.candidate([n + 1 for n in places] if isinstance(kind, Kind) else places)


def _starts(kind: Kind, joint: int, amplitudes: Array) -> dict[str, float]:
    """Where the numbers of a joint (from 0) start, by name."""
    found = {}
    for key, present, amplitude in zip(kind.where, kind.present[:, joint], amplitudes, strict=True):
        most = _WIDEST * kind.size[joint]
        found[f"joint{joint + 1}.{key}"] = (
            float(np.clip(_times(amplitude), 1 / OFF, OFF) * present)
            if kind.relative
            else float(np.clip(amplitude, max(-most, 0.9 * kind.least), most))
        )
    return found


def _times(away: float) -> float:
    """What a number is multiplied by whose logarithm is to move by so much to first order: more of it acts in
    proportion to it, less of it to one over it.
    """
    return 1 + away if away > 0 else 1 / (1 - away)
