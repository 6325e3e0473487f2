"""Least squares of named effects on a recorded motion: linear coefficients inside, shapes outside (variable
projection).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from identify.core.arrays import Array, Mask
from identify.explain.effects.base import MotionEffect, Shape
from identify.explain.recorded_motion import RecordedMotion
from identify.fitting.memory import Memory, digest

_RANK = 1e-11
"""Share of the largest eigenvalue of normalised normal equations below which a combination of columns is not
determined.
"""
_STEP = 1e-6
_EDGE = 0.005
"""Share of its range (of the logarithm where it is searched so) by which a shape is at an end of it."""
_KEPT = 250
"""Sets of columns kept in memory, some 0.2 MB each."""


@dataclass(frozen=True)
class Case:
    """One target of one record: what is to be explained (samples, joints) and the samples that count.

    datum: whether every joint has a constant of its own that no effect need explain (the zeros of two
    encoders).
    """

    name: str
    scene: RecordedMotion
    wanted: Array
    used: Mask
    datum: bool
    remembered: dict[object, Array] = field(default_factory=dict, repr=False, compare=False)
    searched: dict[object, Array | None] = field(default_factory=dict, repr=False, compare=False)
    """Shapes that were found, by effect and by what was there at its joint."""

    def columns(self, effect: MotionEffect, shape: Array) -> Array:
        """Columns (samples, joints, coefficients) of an effect; those without shapes, and the latest with
        shapes, are kept.
        """
        key = type(effect), effect, shape.tobytes()
        if key not in self.remembered:
            if len(self.remembered) > _KEPT:
                for old in [one for one in self.remembered if one[2]]:  # type: ignore[index]
                    del self.remembered[old]
            self.remembered[key] = effect.columns(self.scene, shape)
        return self.remembered[key]


@dataclass(frozen=True)
class Fit:
    """Effects with their shapes, coefficients (all columns; the datum of each joint first where there is one)
    and the weights used.

    weights (joints,): one over the size of the residual that each joint was expected to leave.
    """

    effects: tuple[MotionEffect, ...]
    shapes: tuple[Array, ...]
    coefficients: Array
    weights: Array

    def of(self, effect: MotionEffect) -> Array:
        """Coefficients of one effect, then its shapes."""
        number = self.effects.index(effect)
        first = len(self.coefficients) - sum(len(e.coefficients) for e in self.effects[number:])
        return np.concatenate(
            [self.coefficients[first : first + len(effect.coefficients)], self.shapes[number]]
        )

    def replaced(self, effect: MotionEffect, coefficients: Array) -> Fit:
        """The same with other coefficients of one effect."""
        number = self.effects.index(effect)
        first = len(self.coefficients) - sum(len(e.coefficients) for e in self.effects[number:])
        changed = self.coefficients.copy()
        changed[first : first + len(coefficients)] = coefficients
        return replace(self, coefficients=changed)

    def predict(self, case: Case) -> Array:
        """What the effects add up to on a record, (samples, joints)."""
        return np.asarray(design(case, self.effects, self.shapes) @ self.coefficients)

    def residual(self, case: Case) -> Array:
        """What is left of a record, (samples, joints), zero where samples do not count."""
        return np.where(case.used, case.wanted - self.predict(case), 0.0)

    def share(self, case: Case, effect: MotionEffect) -> Array:
        """What one effect adds on a record, (samples, joints)."""
        values = self.of(effect)
        count = len(effect.coefficients)
        return np.asarray(case.columns(effect, values[count:]) @ values[:count])


def design(case: Case, effects: Sequence[MotionEffect], shapes: Sequence[Array]) -> Array:
    """All columns (samples, joints, p), the datum first."""
    samples, joints = case.wanted.shape
    datum = (
        np.broadcast_to(np.eye(joints), (samples, joints, joints))
        if case.datum
        else np.zeros((samples, joints, 0))
    )
    return np.concatenate(
        [datum, *(case.columns(effect, shape) for effect, shape in zip(effects, shapes, strict=True))], axis=2
    )


def solve(case: Case, effects: Sequence[MotionEffect], shapes: Sequence[Array], weights: Array) -> Fit:
    """The best coefficients for given shapes; of columns that cannot be told apart, the smallest."""
    columns = design(case, effects, shapes)
    rows, wanted = (columns * weights[:, None])[case.used], (case.wanted * weights)[case.used]
    scale = np.sqrt((rows**2).sum(axis=0))
    scale[scale == 0] = 1.0
    rows = rows / scale
    values, vectors = np.linalg.eigh(rows.T @ rows)
    inverse = np.where(
        values > _RANK * max(values.max(initial=0.0), 1e-300), 1 / np.maximum(values, 1e-300), 0.0
    )
    coefficients = vectors @ (inverse * (vectors.T @ (rows.T @ wanted))) / scale
    return Fit(tuple(effects), tuple(shapes), coefficients, weights)


def aligned(case: Case, fit: Fit) -> Fit:
    """The fit with the phases of its waves turned to suit a record whose positions count from its own
    beginning; sizes stay.
    """
    if not case.scene.relative:
        return fit
    residual = fit.residual(case)
    for number, effect in enumerate(fit.effects):
        if effect.wave:
            coefficients, columns = (
                fit.of(effect)[: len(effect.coefficients)],
                case.columns(effect, fit.shapes[number]),
            )
            quarter = np.stack([-coefficients[1::2], coefficients[::2]], axis=1).ravel()
            wave, turned = (np.where(case.used, columns @ values, 0.0) for values in (coefficients, quarter))
            left = residual + wave
            angle = np.arctan2((left * turned).sum(), (left * wave).sum())
            fit = fit.replaced(effect, np.cos(angle) * coefficients + np.sin(angle) * quarter)
            residual = left - np.cos(angle) * wave - np.sin(angle) * turned
    return fit


def loss(case: Case, fit: Fit) -> float:
    """Weighted sum of squares of what is left."""
    return float(((fit.residual(case) * fit.weights) ** 2).sum())


class Screen:
    """A fit made ready to try further effects on: what is left, and the directions that are already
    explained.
    """

    def __init__(
        self, case: Case, fit: Fit, without: str = "", memory: Memory | None = None, label: str = ""
    ) -> None:
        self._memory, self._label = Memory() if memory is None else memory, label
        kept = [number for number, other in enumerate(fit.effects) if other.name != without]
        self.case = case
        self.effects, self.shapes = [fit.effects[n] for n in kept], [fit.shapes[n] for n in kept]
        base = solve(case, self.effects, self.shapes, fit.weights) if without else fit
        self.weights, self.residual = fit.weights, base.residual(case)
        rows = (design(case, self.effects, self.shapes) * self.weights[:, None])[case.used]
        scale = np.sqrt((rows**2).sum(axis=0))
        vectors, sizes, _ = np.linalg.svd(rows / np.where(scale > 0, scale, 1.0), full_matrices=False)
        self._explained = vectors[:, sizes > np.sqrt(_RANK) * sizes.max(initial=0.0)]
        self._left = (self.residual * self.weights)[case.used]

    def remains(self, effect: MotionEffect, shape: Array) -> Array:
        """What would be left (used samples,), weighted, with the effect's best coefficients beside those of
        the fit.
        """
        columns = (self.case.columns(effect, shape) * self.weights[:, None])[self.case.used]
        columns = columns - self._explained @ (self._explained.T @ columns)
        gram = columns.T @ columns
        return np.asarray(
            self._left
            - columns @ (np.linalg.pinv(gram, rcond=1e-9, hermitian=True) @ (columns.T @ self._left))
        )

    def search(self, effect: MotionEffect) -> Array | None:
        """The best shapes of the effect, from the best of its starts; None where it has none to start from.

        Searched once for the effects that are at its joint, whatever goes on at others.
        """
        key = effect.name, frozenset(other.name for other in self.effects if other.axis == effect.axis)
        if key not in self.case.searched:
            kept = self._memory.recall(
                digest("search", self._label, key[0], sorted(key[1])), lambda: _as_list(self._search(effect))
            )
            self.case.searched[key] = np.array(kept[0]) if kept else None
        return self.case.searched[key]

    def _search(self, effect: MotionEffect) -> Array | None:
        starts = effect.starts(self.case.scene, self.residual)
        if len(starts) < 2:
            best = starts[0] if starts else None
        else:
            losses = [float((self.remains(effect, start) ** 2).sum()) for start in starts]
            best = starts[int(np.argmin(losses))]
        bounds = effect.parameters(self.case.scene)
        return (
            best
            if best is None or not bounds
            else _searched(lambda shape: self.remains(effect, shape), best, bounds)
        )

    def added(self, effect: MotionEffect) -> Fit | None:
        """The fit with the effect, the shapes of the others kept; None where it is not what it is called.

        That is where it cannot start, has a sign that cannot be, or ends where its range ends: a wave that is
        slowest at the end of its range stands for something slower.
        """
        shape = self.search(effect)
        if shape is None or any(map(at_edge, effect.parameters(self.case.scene), shape)):
            return None
        found = solve(self.case, [*self.effects, effect], [*self.shapes, shape], self.weights)
        return None if effect.positive and found.of(effect)[0] < 0 else found


def _as_list(shape: Array | None) -> list[list[float]]:
    return [] if shape is None else [shape.tolist()]


def without(case: Case, fit: Fit, name: str) -> Fit:
    """The fit without the effect of that name, shapes of the others kept."""
    kept = [number for number, other in enumerate(fit.effects) if other.name != name]
    return solve(case, [fit.effects[n] for n in kept], [fit.shapes[n] for n in kept], fit.weights)


def refine(case: Case, fit: Fit) -> Fit:
    """Search the shapes of all effects together from where they are; coefficients follow."""
    chosen = [n for n in range(len(fit.effects)) if len(fit.shapes[n])]
    bounds = [shape for n in chosen for shape in fit.effects[n].parameters(case.scene)]
    if not bounds:
        return solve(case, fit.effects, fit.shapes, fit.weights)

    def placed(outer: Array) -> Fit:
        shapes = list(fit.shapes)
        for n in chosen:
            count = len(shapes[n])
            shapes[n], outer = outer[:count], outer[count:]
        return solve(case, fit.effects, shapes, fit.weights)

    def left(outer: Array) -> Array:
        return np.asarray((placed(outer).residual(case) * fit.weights)[case.used])

    better = placed(_searched(left, np.concatenate([fit.shapes[n] for n in chosen]), bounds))
    return better if loss(case, better) < loss(case, fit) else fit


def _searched(left: Callable[[Array], Array], start: Array, bounds: Sequence[Shape]) -> Array:
    """Shapes near `start` that leave least, between their bounds."""
    steps = np.array([_fineness(shape) for shape in bounds])
    inner = np.clip(_inner(start, bounds), 0.0, 1.0)
    found = least_squares(
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


def jacobian(case: Case, fit: Fit) -> Array:
    """Derivatives of the prediction (samples, joints, datum + coefficients + shapes) in the order of
    `values`, shapes by differences.
    """
    samples, joints = case.wanted.shape
    found = [np.eye(joints)[None].repeat(samples, axis=0) if case.datum else np.zeros((samples, joints, 0))]
    for effect, shape in zip(fit.effects, fit.shapes, strict=True):
        coefficients = fit.of(effect)[: len(effect.coefficients)]
        found.append(case.columns(effect, shape))
        for number, bound in enumerate(effect.parameters(case.scene)):
            step = np.zeros(len(shape))
            step[number] = _STEP * (shape[number] if bound.log else bound.upper - bound.lower)
            change = (case.columns(effect, shape + step) - case.columns(effect, shape - step)) @ coefficients
            found.append((change / (2 * step[number]))[:, :, None])
    return np.concatenate(found, axis=2)


def at_edge(shape: Shape, value: float) -> bool:
    """Whether a value is at an end of the range in which it is searched."""
    inner = float(_inner(np.array([value]), [shape])[0])
    return not _EDGE < inner < 1 - _EDGE


def _fineness(shape: Shape) -> float:
    """How finely a shape is searched, as a share of its range: an order of many waves has narrow valleys."""
    return 1e-3 if shape.name == "order" else 1.0


def _inner(values: Array, bounds: Sequence[Shape]) -> Array:
    lower, upper = _limits(bounds)
    logs = np.array([shape.log for shape in bounds])
    plain = np.where(logs, np.log(np.where(logs, values, 1.0)), values)
    return np.asarray((plain - lower) / (upper - lower))


def _outer(inner: Array, bounds: Sequence[Shape]) -> Array:
    lower, upper = _limits(bounds)
    plain = lower + inner * (upper - lower)
    logs = np.array([shape.log for shape in bounds])
    return np.asarray(np.where(logs, np.exp(np.where(logs, plain, 0.0)), plain))


def _limits(bounds: Sequence[Shape]) -> tuple[Array, Array]:
    pairs = [(np.log(s.lower), np.log(s.upper)) if s.log else (s.lower, s.upper) for s in bounds]
    lower, upper = np.array(pairs).T
    return lower, upper
