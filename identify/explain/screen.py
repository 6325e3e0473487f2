"""What further effects would explain beside a fit, and the search for the parameters inside their columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.explain.effects.base import MotionEffect, NonlinearParameter
from identify.explain.regression import (
    RANK,
    Fit,
    RegressionProblem,
    design,
    expected_size,
    loss,
    solve,
    strain,
)
from identify.fitting.memory import Memory, digest

_EDGE = 0.005
"""Share of its range (of the logarithm where it is searched so) by which a nonlinear parameter is at an end
of it.
"""


class Screen:
    """A fit made ready to try further effects on: what is left, and the directions that are already
    explained.
    """

    def __init__(
        self,
        problem: RegressionProblem,
        fit: Fit,
        without: str = "",
        memory: Memory | None = None,
        label: str = "",
    ) -> None:
        self._memory, self._label = Memory() if memory is None else memory, label
        kept = [number for number, other in enumerate(fit.effects) if other.name != without]
        self.problem = problem
        self.effects, self.nonlinear = [fit.effects[n] for n in kept], [fit.nonlinear[n] for n in kept]
        base = solve(problem, self.effects, self.nonlinear, fit.weights) if without else fit
        self.weights, self.residual = fit.weights, base.residual(problem)
        expected = expected_size(problem, self.effects)
        rows = (design(problem, self.effects, self.nonlinear) * self.weights[:, None])[problem.mask]
        rows = np.vstack([rows, np.diag(expected)])
        scale = np.sqrt((rows**2).sum(axis=0))
        vectors, sizes, _ = np.linalg.svd(rows / np.where(scale > 0, scale, 1.0), full_matrices=False)
        self._explained = vectors[:, sizes > np.sqrt(RANK) * sizes.max(initial=0.0)]
        self._expected = len(expected)
        self._left = np.concatenate([(self.residual * self.weights)[problem.mask], -strain(problem, base)])

    def remains(self, effect: MotionEffect, parameters: Array) -> Array:
        """What would be left (used samples + coefficients,), weighted, with the effect's best coefficients
        beside those of the fit.
        """
        columns = (self.problem.columns(effect, parameters) * self.weights[:, None])[self.problem.mask]
        columns = np.vstack([columns, np.zeros((self._expected, columns.shape[1]))])
        columns = columns - self._explained @ (self._explained.T @ columns)
        gram = columns.T @ columns
        return np.asarray(
            self._left
            - columns @ (np.linalg.pinv(gram, rcond=1e-9, hermitian=True) @ (columns.T @ self._left))
        )

    def search(self, effect: MotionEffect) -> Array | None:
        """The best nonlinear parameters of the effect, from the best of its starts; None where it has none to
        start from.

        Searched once for the effects that are at its joint, whatever goes on at others.
        """
        key = self._beside(effect)
        if key not in self.problem.searched:
            kept = self._memory.recall(self.key(effect), lambda: self.found(effect))
            self.problem.searched[key] = np.array(kept[0]) if kept else None
        return self.problem.searched[key]

    def searched(self, effect: MotionEffect) -> bool:
        """Whether that was done."""
        return self._beside(effect) in self.problem.searched

    def key(self, effect: MotionEffect) -> str:
        """Of the search in the memory."""
        name, beside = self._beside(effect)
        return digest("search", self._label, name, sorted(beside))

    def found(self, effect: MotionEffect) -> list[list[float]]:
        """What the search finds, as the memory keeps it: nothing where there is no start."""
        return _as_list(self._search(effect))

    def _beside(self, effect: MotionEffect) -> tuple[str, frozenset[str]]:
        return effect.name, frozenset(other.name for other in self.effects if other.axis == effect.axis)

    def _search(self, effect: MotionEffect) -> Array | None:
        starts = effect.starts(self.problem.scene, self.residual)
        if len(starts) < 2:
            best = starts[0] if starts else None
        else:
            losses = [float((self.remains(effect, start) ** 2).sum()) for start in starts]
            best = starts[int(np.argmin(losses))]
        bounds = effect.parameters(self.problem.scene)
        return (
            best
            if best is None or not bounds
            else _searched(lambda parameters: self.remains(effect, parameters), best, bounds)
        )

    def added(self, effect: MotionEffect) -> Fit | None:
        """The fit with the effect, the nonlinear parameters of the others kept; None where it is not what
        it is called.

        That is where it cannot start, has a sign that cannot be, or ends where its range ends: a harmonic
        that is slowest at the end of its range stands for something slower.
        """
        parameters = self.search(effect)
        if parameters is None or any(map(at_edge, effect.parameters(self.problem.scene), parameters)):
            return None
        found = solve(self.problem, [*self.effects, effect], [*self.nonlinear, parameters], self.weights)
        return found if effect.possible(found.of(effect)) else None


def _as_list(parameters: Array | None) -> list[list[float]]:
    return [] if parameters is None else [parameters.tolist()]


def refine(problem: RegressionProblem, fit: Fit) -> Fit:
    """Search the nonlinear parameters of all effects together from where they are; coefficients follow."""
    chosen = [n for n in range(len(fit.effects)) if len(fit.nonlinear[n])]
    bounds = [parameter for n in chosen for parameter in fit.effects[n].parameters(problem.scene)]
    if not bounds:
        return solve(problem, fit.effects, fit.nonlinear, fit.weights)

    def placed(outer: Array) -> Fit:
        nonlinear = list(fit.nonlinear)
        for n in chosen:
            count = len(nonlinear[n])
            nonlinear[n], outer = outer[:count], outer[count:]
        return solve(problem, fit.effects, nonlinear, fit.weights)

    def left(outer: Array) -> Array:
        found = placed(outer)
        seen = (found.residual(problem) * fit.weights)[problem.mask]
        return np.concatenate([seen, strain(problem, found)])

    better = placed(_searched(left, np.concatenate([fit.nonlinear[n] for n in chosen]), bounds))
    return better if loss(problem, better) < loss(problem, fit) else fit


def _searched(left: Callable[[Array], Array], start: Array, bounds: Sequence[NonlinearParameter]) -> Array:
    """Nonlinear parameters near `start` that leave least, between their bounds."""
    steps = np.array([_fineness(parameter) for parameter in bounds])
    inner = np.clip(_inner(start, bounds), 0.0, 1.0)
    found = scipy.optimize.least_squares(
        lambda x: left(_outer(x, bounds)),
        inner,
        bounds=(0.0, 1.0),
        x_scale=steps,
        diff_step=1e-4 * steps,
        max_nfev=20,
        xtol=1e-6,
        ftol=1e-6,
    )
    return _outer(found.x, bounds)


def at_edge(parameter: NonlinearParameter, value: float) -> bool:
    """Whether a value is at an end of the range in which it is searched."""
    inner = float(_inner(np.array([value]), [parameter])[0])
    return not _EDGE < inner < 1 - _EDGE


def _fineness(parameter: NonlinearParameter) -> float:
    """How finely a nonlinear parameter is searched, as a share of its range: a high order has narrow
    valleys.
    """
    return 1e-3 if parameter.name == "order" else 1.0


def _inner(values: Array, bounds: Sequence[NonlinearParameter]) -> Array:
    lower, upper = _limits(bounds)
    logs = np.array([parameter.log for parameter in bounds])
    plain = np.where(logs, np.log(np.where(logs, values, 1.0)), values)
    return np.asarray((plain - lower) / (upper - lower))


def _outer(inner: Array, bounds: Sequence[NonlinearParameter]) -> Array:
    lower, upper = _limits(bounds)
    plain = lower + inner * (upper - lower)
    logs = np.array([parameter.log for parameter in bounds])
    return np.asarray(np.where(logs, np.exp(np.where(logs, plain, 0.0)), plain))


def _limits(bounds: Sequence[NonlinearParameter]) -> tuple[Array, Array]:
    pairs = [(np.log(s.lower), np.log(s.upper)) if s.log else (s.lower, s.upper) for s in bounds]
    lower, upper = np.array(pairs).T
    return lower, upper
