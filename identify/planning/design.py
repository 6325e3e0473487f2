"""The choice of a test: greedy, then by exchange.

D-optimal: the determinant of the information is largest, so that the volume of the parameters' confidence
region is least.  I-optimal: the mean variance of stated targets is least (Fedorov 1972; Atkinson, Donev and
Tobias 2007, chapters 10 to 12).  A test is every chosen impact in every chosen posture with all chosen
sensors, so that one of the three sets is exchanged while the other two stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.interruption import check

_STARTS, _ROUNDS = 6, 30
Chosen: TypeAlias = tuple[Index, Index, Index]
"""Numbers of the postures, impacts and sensors of a test."""


@dataclass(frozen=True)
class Criterion:
    """What a test is judged by: targets (t, p), derivatives of what is to be known by the parameters, or None
    for the determinant; before (p, p): the information that is there already.
    """

    before: Array
    targets: Array | None = None

    def scores(self, information: Array) -> Array:
        """(...,), higher is better, of information (..., p, p) to come."""
        whole = information + self.before
        if self.targets is None:
            return np.asarray(np.linalg.slogdet(whole)[1])
        spread = np.linalg.solve(
            whole, np.broadcast_to(self.targets.T, (*whole.shape[:-1], len(self.targets)))
        )
        return np.asarray(-np.log(np.mean(np.sum(self.targets.T * spread, axis=-2), axis=-1)))


@dataclass(frozen=True)
class Design:
    """Numbers of the chosen postures, impacts and sensors, and their score."""

    chosen: Chosen
    score: float


def total(information: Array, chosen: Chosen) -> Array:
    """(p, p): the information of a test."""
    return np.asarray(information[np.ix_(*chosen)].sum(axis=(0, 1, 2)))


def best_design(
    information: Array, sizes: tuple[int, int, int], criterion: Criterion, rng: np.random.Generator
) -> Design:
    """The best of several starts, each improved until no exchange helps; information (q, i, s, p, p)."""
    found = [
        _improved(information, random_choice(information, sizes, rng), criterion) for _ in range(_STARTS)
    ]
    return max(found, key=lambda one: one.score)


def random_choice(information: Array, sizes: tuple[int, int, int], rng: np.random.Generator) -> Chosen:
    """A test of that size at random."""
    q, i, s = (
        rng.choice(count, size, replace=False) for count, size in zip(information.shape, sizes, strict=False)
    )
    return q, i, s


def _improved(information: Array, chosen: Chosen, criterion: Criterion) -> Design:
    score = float(criterion.scores(total(information, chosen)))
    for _ in range(_ROUNDS):
        check()
        before = score
        for axis in range(3):
            others = list(chosen)
            others[axis] = np.arange(information.shape[axis])
            along = tuple(k for k in range(3) if k != axis)
            parts = information[np.ix_(*others)].sum(axis=along)
            picked, score = exchanged(parts, chosen[axis], criterion.scores)
            others[axis] = picked
            chosen = others[0], others[1], others[2]
        if score <= before + 1e-9 * abs(before):
            break
    return Design((np.sort(chosen[0]), np.sort(chosen[1]), np.sort(chosen[2])), score)


def exchanged(parts: Array, picked: Index, score: Callable[[Array], Array]) -> tuple[Index, float]:
    """The members of one set after exchanges, one at a time for the best of all; parts (count, ...) add up to
    what is scored.
    """
    picked = picked.copy()
    for place in range(len(picked)):
        rest = parts[np.delete(picked, place)].sum(axis=0)
        scores = score(rest + parts)
        scores[np.delete(picked, place)] = -np.inf
        picked[place] = int(np.argmax(scores))
    return picked, float(score(parts[picked].sum(axis=0)))
