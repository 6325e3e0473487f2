"""A test improved by what its noise has in common: the noise of the force, which all responses of an impact
share, so that more sensors do not average it, as more impacts do.

Given the sensors, J'J and the variance of the scores (`identify.planning.after_test`) add up over postures
and impacts; given these, the shared part of the scores adds up over sensors before it is squared.  The three
sets are exchanged in turn, one member at a time for the best of all.  Lines are some that stand for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.interruption import check
from identify.model.system import System
from identify.planning.candidates import Candidates
from identify.planning.design import Chosen, Criterion, exchanged
from identify.planning.information import FreeModel, TestNoise, s_of, slopes, standing_lines

_ROUNDS = 3


@dataclass(frozen=True)
class Refinement:
    """Candidates of a test of models (that of the fit, and a rival if there is one); weak (u, u): what bounds
    alone say.
    """

    models: Sequence[FreeModel]
    among: Candidates
    noise: TestNoise
    band: Array
    criterion: Criterion
    weak: Array

    def refined(self, chosen: Chosen) -> Chosen:
        """A test at least as good."""
        best = -np.inf
        for _ in range(_ROUNDS):
            postures, impacts, sensors = chosen
            every = self._by_pair(sensors)
            postures, _ = exchanged(every[:, impacts].sum(axis=1), postures, self._score)
            impacts, _ = exchanged(every[postures].sum(axis=0), impacts, self._score)
            sensors, score = self._sensors(postures, impacts, sensors)
            chosen = np.sort(postures), np.sort(impacts), np.sort(sensors)
            if score <= best + 1e-6 * abs(best):
                break
            best = score
        return chosen

    def after_each(self, sensors: Index) -> Array:
        """(postures, impacts, u, u): what is known of the unknowns after each pair alone."""
        return self._after(self._by_pair(sensors))

    def _after(self, pairs: Array) -> Array:
        """(..., u, u): what is known after J'J and a variance of the scores (..., 2, u, u)."""
        joint, of_data = pairs[..., 0, :, :] + self.weak, self.criterion.before - self.weak
        return np.asarray(joint @ np.linalg.solve(pairs[..., 1, :, :] + self.weak, joint) + of_data)

    def _score(self, pairs: Array) -> Array:
        return self.criterion.scores(self._after(pairs) - self.criterion.before)

    @cached_property
    def _systems(self) -> list[list[System]]:
        return [[one.model.system(posture) for one in self.models] for posture in self.among.postures]

    def _parts(self, posture: int, impacts: Sequence[int], sensors: Sequence[int]) -> tuple[Array, Complex]:
        """J'J and the variance of the scores by the noise of each response alone (2, sensors, impacts, u, u),
        and the part of the scores that goes with the force (sensors, impacts, lines, u).
        """
        line_hz, weight = standing_lines(self.band)
        nodes, hits = [self.among.sensors[k] for k in sensors], [self.among.impacts[k] for k in impacts]
        s = s_of(line_hz, self.noise)
        h, g = slopes(self.models, self._systems[posture], nodes, hits, s)
        g = self.noise.over(g, s)
        shape = len(h), len(nodes), 3, len(hits), g.shape[-1]
        j, alone, of_force = (
            np.moveaxis(part.reshape(shape), (1, 3), (0, 1))
            for part in self.noise.scaled(h, np.sqrt(weight) * g)
        )
        return np.array([_gram(_flat(j)), _gram(_flat(alone))]), np.asarray(of_force.sum(axis=3))

    def _by_pair(self, sensors: Index) -> Array:
        """(postures, impacts, 2, u, u), of given sensors."""
        found = []
        for posture in range(len(self.among.postures)):
            check()
            pair, shared = self._parts(posture, range(len(self.among.impacts)), sensors.tolist())
            product, alone = pair.sum(axis=1)
            found.append(np.stack([product, alone + _gram(shared.sum(axis=0))], axis=1))
        return np.array(found)

    def _sensors(self, postures: Index, impacts: Index, picked: Index) -> tuple[Index, float]:
        """The sensors after exchanges, and their score."""
        every = range(len(self.among.sensors))
        parts = [self._parts(int(posture), impacts.tolist(), every) for posture in postures]
        alone = np.swapaxes(np.sum([one.sum(axis=2) for one, _ in parts], axis=0), 0, 1)  # (s, 2, u, u)
        shared = np.concatenate([_flat(one) for _, one in parts], axis=1)  # (s, lines, u)
        picked = picked.copy()

        def pairs(rest: Index, more: slice | Index) -> Array:
            pair = alone[rest].sum(axis=0) + alone[more]
            together = _gram(shared[rest].sum(axis=0) + shared[more])
            return np.stack([pair[:, 0], pair[:, 1] + together], axis=1)

        for place in range(len(picked)):
            rest = np.delete(picked, place)
            scores = self._score(pairs(rest, slice(None)))
            scores[rest] = -np.inf
            picked[place] = int(np.argmax(scores))
        return picked, float(self._score(pairs(picked[1:], picked[:1]))[0])


def _flat(parts: Complex) -> Complex:
    """(sensors, impacts, lines, ..., u) with all between the first or the first two axes and the last as
    one: (sensors, impacts, rows, u) where there are axes of sensors, else (sensors, rows, u).
    """
    kept = parts.shape[:2] if parts.ndim == 5 else parts.shape[:1]
    return np.asarray(parts.reshape(*kept, -1, parts.shape[-1]))


def _gram(rows: Complex) -> Array:
    """(..., u, u) of (..., rows, u)."""
    return np.asarray((np.conj(np.swapaxes(rows, -1, -2)) @ rows).real)
