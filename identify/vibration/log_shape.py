"""What FRFs look like, whatever their level: logarithms of predicted over measured ones.

    r = w (ln(H / H_exp) + c),   w = 1 / hypot(0.1, sigma / |H_exp|)

c is a common factor of all FRFs, eliminated, so that a wrong unit hides no other mistake; it is read off
afterwards.  The valley of logarithms is wide, that of magnitudes alone wider still: no delay turns them.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from identify.core.arrays import Array, Complex, Index, logarithm
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.fitting.objective import ProductObjective
from identify.vibration.costs.base import in_chunks
from identify.vibration.costs.frf_least_squares import LOG_FLOOR
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem

_FARTHEST = 25.0
"""Logarithms beyond which nothing more is said: g mm2 for kg m2 are a factor of 1e9."""
_STILL = 1e-8
"""Times the largest FRF that a point has which does not move but for rounding."""


def frf_targets(problem: Problem) -> tuple[FrfTarget, ...]:
    """Of all measurements in their order, whether they are fitted or not."""
    return tuple(m.target for m in problem.measurements if isinstance(m.target, FrfTarget))


Slopes = tuple[Complex, Complex]
"""FRFs (lines, pairs) and their derivatives (lines, pairs, free)."""


class LogShape(ProductObjective):
    """RMS of weighted logarithms of predicted over measured FRFs, up to one common factor; phases: whether
    they count, or magnitudes alone.
    """

    def __init__(self, problem: Problem) -> None:
        self.targets = frf_targets(problem)
        self._free = Scale(problem.parameters).free
        self._seen = [_seen(target, problem.initial) for target in self.targets]
        self._phases = 1j
        self._weights = [
            _weights(target, seen) for target, seen in zip(self.targets, self._seen, strict=True)
        ]
        self._measured = [
            target.measured[:, seen] for target, seen in zip(self.targets, self._seen, strict=True)
        ]
        self._last: tuple[bytes, list[Slopes]] = (b"", [])
        self.moving = sum(map(len, self._seen))
        self.count, self._square = _sizes(self._weights)
        if not self._square:
            raise InputError("points", "no channel that the model moves", "points on links that move")

    def of_magnitudes(self) -> LogShape:
        """The same of magnitudes alone."""
        other = copy(self)
        other._phases = 0.0
        return other

    def of_first(self) -> LogShape:
        """The same of the first measurement alone that the model moves: of many candidates it tells which are
        of the right size.
        """
        first = next(number for number, seen in enumerate(self._seen) if len(seen))
        other, only = copy(self), slice(first, first + 1)
        other.targets, other._seen, other._last = self.targets[only], self._seen[only], (b"", [])
        other._weights, other._measured = self._weights[only], self._measured[only]
        other.count, other._square = _sizes(other._weights)
        return other

    def costs(self, candidates: Array) -> Array:
        """(m,) with the best factor for each."""
        squares, pull = np.full(len(candidates), np.inf), np.zeros(len(candidates))
        with np.errstate(all="ignore"):
            for part in in_chunks(self.targets, candidates):
                squares[part] = 0.0
                for number, (seen, weight) in enumerate(zip(self._seen, self._weights, strict=True)):
                    logs = self._logs(number, seen, self._predicted(number, candidates[part]))
                    squares[part] += np.sum(weight**2 * np.abs(logs) ** 2, axis=(1, 2))
                    pull[part] += np.sum(weight**2 * logs.real, axis=(1, 2))
        total = squares - pull**2 / self._square
        return np.sqrt(np.where(np.isfinite(total), np.maximum(total, 0.0), np.inf) / self.count)

    def product(self, values: Array, free: Index) -> Array:
        """[J r]'[J r] with the factor eliminated."""
        size = len(free) + 1
        total, along = np.zeros((size, size)), np.zeros(size)
        with np.errstate(all="ignore"):
            told = zip(self._slopes(values), self._seen, self._weights, strict=True)
            for number, ((h, gradient), seen, weight) in enumerate(told):
                logs = self._logs(number, seen, h)
                every = len(seen) == h.shape[1]  # of which a choice would be a copy
                slope = (weight / h[:, seen])[..., None] * (gradient if every else gradient[:, seen])
                left, near = weight * logs, np.abs(logs.real) < _FARTHEST
                if not near.all():
                    slope[~near] = 0.0
                rows = np.empty((2 if self._phases else 1, *left.shape, size))
                for row, part in zip(rows, (np.real, np.imag), strict=False):
                    row[..., :-1], row[..., -1] = part(slope), part(left)
                along += np.tensordot(weight, rows[0])
                rows = rows.reshape(-1, size)
                total += rows.T @ rows
        return np.asarray(total - np.outer(along, along) / self._square)

    def _predicted(self, number: int, candidates: Array) -> Complex:
        """(m, lines, pairs) of a set; a single candidate with its slopes, which its step will ask for."""
        if len(candidates) > 1:
            return self.targets[number].predict_pairs(candidates)
        return self._slopes(candidates[0])[number][0][None]

    def _slopes(self, values: Array) -> list[Slopes]:
        """Predictions and derivatives of all sets, kept for the next who asks."""
        if self._last[0] != values.tobytes():
            found = [target.gradient_pairs(values, self._free) for target in self.targets]
            self._last = values.tobytes(), found
        return self._last[1]

    def left(self, values: Array, level: float = 0.0) -> list[Complex]:
        """Weighted logarithms (lines, pairs) of each set, less what a common factor exp(level) explains; zero
        for FRFs that the model does not move.
        """
        found = []
        for number, (seen, weight) in enumerate(zip(self._seen, self._weights, strict=True)):
            logs = self._logs(number, seen, self._slopes(values)[number][0]) + level
            own = np.zeros((len(logs), len(self.targets[number].pairs[0])), dtype=complex)
            own[:, seen] = weight * logs
            found.append(own)
        return found

    def level(self, values: Array) -> float:
        """ln of the factor that the measured FRFs have beyond the model, at values (parameters,)."""
        pull = 0.0
        for number, (seen, weight) in enumerate(zip(self._seen, self._weights, strict=True)):
            logs = self._logs(number, seen, self._slopes(values)[number][0])
            pull += float(np.sum(weight**2 * logs.real))
        return -pull / self._square

    def _logs(self, number: int, seen: Index, h: Complex) -> Complex:
        """Of predicted over measured."""
        logs = logarithm(h[..., seen] / self._measured[number])
        return np.asarray(np.clip(logs.real, -_FARTHEST, _FARTHEST) + self._phases * logs.imag, dtype=complex)


def _sizes(weights: Sequence[Array]) -> tuple[int, float]:
    """How many real residuals have these weights, and the sum of their squares."""
    return sum(2 * one.size for one in weights), sum(float(np.sum(one**2)) for one in weights)


def _seen(target: FrfTarget, values: Array) -> Index:
    """Numbers of the FRFs that the model moves by more than rounding, at values (parameters,)."""
    h, _ = target.gradient(values, np.zeros(0, dtype=int))
    size = np.abs(target.paired(h)).max(axis=0)
    return np.flatnonzero(size > _STILL * size.max(initial=0.0))


def _weights(target: FrfTarget, seen: Index) -> Array:
    return np.asarray(1.0 / np.hypot(LOG_FLOOR, target.sigma[:, seen] / np.abs(target.measured[:, seen])))
