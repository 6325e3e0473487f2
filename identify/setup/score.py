"""How well a variant of a study can explain the data, quickly: a few steps on logarithmic residuals.

    r = w (ln(H / H_exp) + c),   w = 1 / hypot(0.1, sigma / |H_exp|)

c is a common factor of all FRFs, eliminated, so that a wrong unit hides no other mistake; it is read off
afterwards.  The valley of logarithms is wide, and the first steps begin at the best of several scales of all
stiffnesses, over what drives of robots have.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from identify.core.arrays import Array, Complex, Index, logarithm
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.fitting.objective import ProductObjective
from identify.fitting.optimizers.base import Search, minimized
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.vibration.costs.base import in_chunks
from identify.vibration.costs.frf_least_squares import LOG_FLOOR
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem
from identify.vibration.scales import scaled_drives

_FARTHEST = 25.0
"""Logarithms beyond which nothing more is said: g mm2 for kg m2 are a factor of 1e9."""
_STILL = 1e-8
"""Times the largest FRF that a point has which does not move but for rounding."""
ROUGH = 1.0
"""RMS of logarithms, in tenths, up to which a set-up is right."""
SLIGHT = np.log(1.25)
"""Logarithm of a common factor that calibrations may have."""
_QUICK = GaussNewton(evaluations=14, tolerance=2e-3)
_TOWARDS = 6
"""Evaluations on magnitudes alone, whose valley is wider still."""


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
        self.count = sum(2 * weight.size for weight in self._weights)
        self._square = sum(float(np.sum(weight**2)) for weight in self._weights)
        if not self._square:
            raise InputError("points", "no channel that the model moves", "points on links that move")

    def of_magnitudes(self) -> LogShape:
        """The same of magnitudes alone."""
        other = copy(self)
        other._phases = 0.0
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
                slope = gradient[:, seen] / h[:, seen, None]
                logs = self._logs(number, seen, h)[..., None]
                slope = np.where(np.abs(logs.real) < _FARTHEST, slope, 0.0)
                rows = (np.concatenate([slope, logs], axis=-1) * weight[..., None]).reshape(-1, size)
                total += rows.real.T @ rows.real
                if self._phases:
                    total += rows.imag.T @ rows.imag
                along += weight.ravel() @ rows.real
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


def _seen(target: FrfTarget, values: Array) -> Index:
    """Numbers of the FRFs that the model moves by more than rounding, at values (parameters,)."""
    h, _ = target.gradient(values, np.zeros(0, dtype=int))
    size = np.abs(target.paired(h)).max(axis=0)
    return np.flatnonzero(size > _STILL * size.max(initial=0.0))


def _weights(target: FrfTarget, seen: Index) -> Array:
    return np.asarray(1.0 / np.hypot(LOG_FLOOR, target.sigma[:, seen] / np.abs(target.measured[:, seen])))


Found = TypeVar("Found")


@dataclass(frozen=True, eq=False)
class Score:
    """A variant that was fitted quickly: values (parameters,), RMS of logarithms in tenths, and the logarithm
    of the factor that the measured FRFs have; asked: what was found of it.
    """

    problem: Problem
    values: Array
    cost: float
    level: float
    asked: dict[str, Any] = field(default_factory=dict, repr=False)

    def once(self, name: str, find: Callable[[], Found]) -> Found:
        """What was found of it under a name, or is found now."""
        if name not in self.asked:
            self.asked[name] = find()
        found: Found = self.asked[name]
        return found

    def residuals(self, *, levelled: bool) -> list[Complex]:
        """(lines, pairs) of each set, in tenths of a logarithm; levelled: beside the common factor."""
        return LogShape(self.problem).left(self.values, self.level if levelled else 0.0)

    def squares(self, *, levelled: bool) -> list[Array]:
        """Their squares by FRF (pairs,) of each set."""
        return [np.sum(np.abs(one) ** 2, axis=0) for one in self.residuals(levelled=levelled)]


def scored(
    problem: Problem,
    start: Array | None = None,
    optimizer: GaussNewton = _QUICK,
    shape: LogShape | None = None,
) -> Score:
    """A variant, fitted from the best scale of its start values by magnitudes, or from `start` (parameters,)
    if that is better; shape: of the problem, where it is there already.
    """
    scale, shape = Scale(problem.parameters), shape or LogShape(problem)
    magnitudes = shape.of_magnitudes()
    given = [] if start is None else [scale.to_x(start)]
    scaled = [scale.to_x(values) for values in scaled_drives(problem)]
    starts = np.clip([*given, *scaled], *scale.bounds())
    costs = magnitudes.costs(np.array([scale.to_values(x) for x in starts]))
    x = starts[int(np.argmin(costs))]
    if start is None or costs[0] > costs.min():
        x = _led(magnitudes, scale, x, GaussNewton(evaluations=_TOWARDS, tolerance=2e-3))
    values = scale.to_values(_led(shape, scale, x, optimizer))
    return Score(problem, values, float(shape.costs(values[None])[0]), shape.level(values))


def _led(objective: LogShape, scale: Scale, x: Array, optimizer: GaussNewton) -> Array:
    search = Search(objective, scale, 10 * optimizer.evaluations)
    minimized(optimizer, search, x, np.random.default_rng(0))
    return x if search.best_x is None else search.best_x
