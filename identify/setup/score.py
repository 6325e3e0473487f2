"""How well a variant of a study can explain the data, quickly: a few steps on logarithmic residuals.

    r = w (ln(H / H_exp) + c),   w = 1 / hypot(0.1, sigma / |H_exp|)

c is a common factor of all FRFs, eliminated, so that a wrong unit hides no other mistake; it is read off
afterwards.  The valley of logarithms is wide, and the first steps begin at the best of several scales of all
stiffnesses, over what drives of robots have.
"""

from __future__ import annotations

from dataclasses import dataclass

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

_SCALES = np.linspace(-4.0, 4.0, 9)
"""Logarithms of factors of all stiffnesses that are tried first: drives of arms from 5 to 500 kg."""
_QUICK = GaussNewton(evaluations=14, tolerance=2e-3)


class LogShape(ProductObjective):
    """RMS of weighted logarithms of predicted over measured FRFs, up to one common factor."""

    def __init__(self, problem: Problem) -> None:
        self.targets = problem.targets().frf + problem.targets("validate").frf
        self._weights = [_weights(target) for target in self.targets]
        self.count = sum(2 * weight.size for weight in self._weights)
        self._square = sum(float(np.sum(weight**2)) for weight in self._weights)
        if not self._square:
            raise InputError("points", "no channel that the model moves", "points on links that move")

    def costs(self, candidates: Array) -> Array:
        """(m,) with the best factor for each."""
        squares, pull = np.full(len(candidates), np.inf), np.zeros(len(candidates))
        with np.errstate(all="ignore"):
            for part in in_chunks(self.targets, candidates):
                squares[part] = 0.0
                for target, weight in zip(self.targets, self._weights, strict=True):
                    logs = self._logs(target, target.predict_pairs(candidates[part]))
                    squares[part] += np.sum(weight**2 * np.abs(logs) ** 2, axis=(1, 2))
                    pull[part] += np.sum(weight**2 * logs.real, axis=(1, 2))
        total = squares - pull**2 / self._square
        return np.sqrt(np.where(np.isfinite(total), np.maximum(total, 0.0), np.inf) / self.count)

    def product(self, values: Array, free: Index) -> Array:
        """[J r]'[J r] with the factor eliminated."""
        size = len(free) + 1
        total, along = np.zeros((size, size)), np.zeros(size)
        with np.errstate(all="ignore"):
            for target, weight in zip(self.targets, self._weights, strict=True):
                h, gradient = target.gradient_pairs(values, free)
                seen = target.observable
                slope = gradient[:, seen] / h[:, seen, None]
                logs = self._logs(target, h)[..., None]
                rows = (np.concatenate([slope, logs], axis=-1) * weight[..., None]).reshape(-1, size)
                total += rows.real.T @ rows.real + rows.imag.T @ rows.imag
                along += weight.ravel() @ rows.real
        return np.asarray(total - np.outer(along, along) / self._square)

    def squares(self, values: Array, level: float = 0.0) -> list[Array]:
        """Squares by FRF (pairs,) of each set, less what a common factor exp(level) explains; zero for FRFs
        that the model does not move.
        """
        found = []
        for target, weight in zip(self.targets, self._weights, strict=True):
            logs = self._logs(target, target.predict_pairs(values)) + level
            own = np.zeros(len(target.pairs[0]))
            own[target.observable] = np.sum(weight**2 * np.abs(logs) ** 2, axis=0)
            found.append(own)
        return found

    def level(self, values: Array) -> float:
        """ln of the factor that the measured FRFs have beyond the model, at values (parameters,)."""
        pull = 0.0
        for target, weight in zip(self.targets, self._weights, strict=True):
            logs = self._logs(target, target.predict_pairs(values))
            pull += float(np.sum(weight**2 * logs.real))
        return -pull / self._square

    @staticmethod
    def _logs(target: FrfTarget, h: Complex) -> Complex:
        seen = target.observable
        return np.asarray(logarithm(h[..., seen] / target.measured[:, seen]), dtype=complex)


def _weights(target: FrfTarget) -> Array:
    seen = target.observable
    return np.asarray(1.0 / np.hypot(LOG_FLOOR, target.sigma[:, seen] / np.abs(target.measured[:, seen])))


@dataclass(frozen=True)
class Score:
    """A variant that was fitted quickly: values (parameters,), RMS of logarithms in tenths, and the logarithm
    of the factor that the measured FRFs have.
    """

    problem: Problem
    values: Array
    cost: float
    level: float

    def squares(self, *, levelled: bool) -> list[Array]:
        """By FRF (pairs,) of each set, in tenths of a logarithm; levelled: beside the common factor."""
        return LogShape(self.problem).squares(self.values, self.level if levelled else 0.0)


def scored(problem: Problem, start: Array | None = None, optimizer: GaussNewton = _QUICK) -> Score:
    """A variant, fitted from the best scale of its start values, or from `start` (parameters,) if that is
    better.
    """
    objective, scale = LogShape(problem), Scale(problem.parameters)
    x = scale.to_x(problem.initial)
    starts = np.array([scale.to_values(np.clip(one, *scale.bounds())) for one in _scaled(problem, scale, x)])
    if start is not None:
        starts = np.concatenate([start[None], starts])
    first = starts[int(np.argmin(objective.costs(starts)))]
    search = Search(objective, scale, 10 * optimizer.evaluations)
    minimized(optimizer, search, scale.to_x(first), np.random.default_rng(0))
    values = first if search.best_x is None else scale.to_values(search.best_x)
    return Score(problem, values, float(search.best_cost), objective.level(values))


def _scaled(problem: Problem, scale: Scale, x: Array) -> Array:
    """Start values (m, free) with all stiffnesses a factor larger, dampers by its root."""
    power = np.zeros(len(x))
    for place, number in enumerate(scale.free):
        parameter = problem.parameters[number]
        if parameter.log:
            power[place] = {"stiffness": 1.0, "damping": 0.5}.get(parameter.name.rpartition(".")[2], 0.0)
    return np.asarray(x + _SCALES[:, None] * power)
