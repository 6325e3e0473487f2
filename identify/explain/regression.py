"""Least squares of named effects on a recorded motion: linear coefficients inside, nonlinear parameters
outside (variable projection).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from identify.core.arrays import Array, Mask
from identify.explain.effects.base import MotionEffect
from identify.explain.recorded_motion import RecordedMotion

Datum = Literal["none", "constant", "line"]

RANK = 1e-11
"""Share of the largest eigenvalue of normalised normal equations below which a combination of columns is not
determined.
"""
_STEP = 1e-6
_KEPT = 250
"""Sets of columns kept in memory, some 0.2 MB each."""


@dataclass(frozen=True)
class RegressionProblem:
    """One target of one or several records in a row: what is to be explained (samples, joints) and the
    samples that count.

    datum: what every joint of every record has of its own that no effect need explain, so that only what is
    left beside it counts: nothing, a constant (the zeros of two encoders), or a line (what an integrator
    makes of a constant).
    """

    name: str
    scene: RecordedMotion
    target: Array
    mask: Mask
    datum: Datum
    remembered: dict[object, Array] = field(default_factory=dict, repr=False, compare=False)
    searched: dict[object, Array | None] = field(default_factory=dict, repr=False, compare=False)
    """Nonlinear parameters that were found, by effect and by what was there at its joint."""

    def columns(self, effect: MotionEffect, parameters: Array) -> Array:
        """Columns (samples, joints, coefficients) of an effect; those without nonlinear parameters, and the
        latest with them, are kept.
        """
        key = type(effect), effect, parameters.tobytes()
        if key not in self.remembered:
            if len(self.remembered) > _KEPT:
                for old in [one for one in self.remembered if one[2]]:  # type: ignore[index]
                    del self.remembered[old]
            self.remembered[key] = self.from_datum(effect.columns(self.scene, parameters))
        return self.remembered[key]

    def from_datum(self, values: Array) -> Array:
        """Values (samples, joints, ...) without the datum of each record and joint, by least squares over the
        samples that count.
        """
        return values if self.datum == "none" else values - self.datum_of(values)

    def datum_of(self, values: Array) -> Array:
        """The datum of values (samples, joints, ...) on each record and joint."""
        found = np.zeros_like(values)
        counted = self.mask.reshape(self.mask.shape + (1,) * (values.ndim - 2))
        for record in self.scene.records if self.datum != "none" else []:
            inside, here = counted[record], np.where(counted[record], values[record], 0.0)
            count = np.maximum(inside.sum(axis=0), 1)
            found[record] = here.sum(axis=0) / count
            if self.datum == "line":
                time = np.arange(len(inside), dtype=float).reshape(-1, *(1,) * (values.ndim - 1))
                time = time - np.where(inside, time, 0.0).sum(axis=0) / count
                weight = np.where(inside, time, 0.0)
                square = np.maximum((weight**2).sum(axis=0), 1e-300)
                found[record] += time * ((weight * here).sum(axis=0) / square)
        return found


@dataclass(frozen=True)
class Fit:
    """Effects with their nonlinear parameters, coefficients (of all columns) and the weights used.

    weights (joints,): one over the size of the residual that each joint was expected to leave.
    """

    effects: tuple[MotionEffect, ...]
    nonlinear: tuple[Array, ...]
    coefficients: Array
    weights: Array

    def of(self, effect: MotionEffect) -> Array:
        """Coefficients of one effect, then its nonlinear parameters."""
        number = self.effects.index(effect)
        first = len(self.coefficients) - sum(len(e.coefficients) for e in self.effects[number:])
        return np.concatenate(
            [self.coefficients[first : first + len(effect.coefficients)], self.nonlinear[number]]
        )

    def replaced(self, effect: MotionEffect, coefficients: Array) -> Fit:
        """The same with other coefficients of one effect."""
        number = self.effects.index(effect)
        first = len(self.coefficients) - sum(len(e.coefficients) for e in self.effects[number:])
        changed = self.coefficients.copy()
        changed[first : first + len(coefficients)] = coefficients
        return replace(self, coefficients=changed)

    def predict(self, problem: RegressionProblem) -> Array:
        """What the effects add up to on a record, (samples, joints), from the record's own datum."""
        return np.asarray(
            problem.datum_of(problem.target)
            + design(problem, self.effects, self.nonlinear) @ self.coefficients
        )

    def residual(self, problem: RegressionProblem) -> Array:
        """What is left of a record, (samples, joints), zero where samples do not count."""
        return np.where(problem.mask, problem.target - self.predict(problem), 0.0)

    def share(self, problem: RegressionProblem, effect: MotionEffect) -> Array:
        """What one effect adds on a record, (samples, joints)."""
        values = self.of(effect)
        count = len(effect.coefficients)
        return np.asarray(problem.columns(effect, values[count:]) @ values[:count])


def design(problem: RegressionProblem, effects: Sequence[MotionEffect], nonlinear: Sequence[Array]) -> Array:
    """All columns (samples, joints, p)."""
    columns = [
        problem.columns(effect, parameters) for effect, parameters in zip(effects, nonlinear, strict=True)
    ]
    return np.concatenate([np.zeros((*problem.target.shape, 0)), *columns], axis=2)


def solve(
    problem: RegressionProblem, effects: Sequence[MotionEffect], nonlinear: Sequence[Array], weights: Array
) -> Fit:
    """The best coefficients for given nonlinear parameters; of columns that cannot be told apart, the
    smallest.
    """
    columns = design(problem, effects, nonlinear)
    wanted = problem.from_datum(problem.target)
    rows, target = (columns * weights[:, None])[problem.mask], (wanted * weights)[problem.mask]
    scale = np.sqrt((rows**2).sum(axis=0))
    scale[scale == 0] = 1.0
    rows = rows / scale
    values, vectors = np.linalg.eigh(rows.T @ rows)
    inverse = np.where(
        values > RANK * max(values.max(initial=0.0), 1e-300), 1 / np.maximum(values, 1e-300), 0.0
    )
    coefficients = vectors @ (inverse * (vectors.T @ (rows.T @ target))) / scale
    return Fit(tuple(effects), tuple(nonlinear), coefficients, weights)


def aligned(problem: RegressionProblem, fit: Fit) -> Fit:
    """The fit with the phases of its waves turned to suit a record whose positions count from its own
    beginning; sizes stay.
    """
    if not problem.scene.relative:
        return fit
    residual = fit.residual(problem)
    for number, effect in enumerate(fit.effects):
        if effect.harmonic:
            coefficients, columns = (
                fit.of(effect)[: len(effect.coefficients)],
                problem.columns(effect, fit.nonlinear[number]),
            )
            quadrature = np.stack([-coefficients[1::2], coefficients[::2]], axis=1).ravel()
            harmonic, turned = (
                np.where(problem.mask, columns @ values, 0.0) for values in (coefficients, quadrature)
            )
            left = residual + harmonic
            angle = np.arctan2((left * turned).sum(), (left * harmonic).sum())
            fit = fit.replaced(effect, np.cos(angle) * coefficients + np.sin(angle) * quadrature)
            residual = left - np.cos(angle) * harmonic - np.sin(angle) * turned
    return fit


def loss(problem: RegressionProblem, fit: Fit) -> float:
    """Weighted sum of squares of what is left."""
    return float(((fit.residual(problem) * fit.weights) ** 2).sum())


def without(problem: RegressionProblem, fit: Fit, name: str) -> Fit:
    """The fit without the effect of that name, nonlinear parameters of the others kept."""
    kept = [number for number, other in enumerate(fit.effects) if other.name != name]
    return solve(problem, [fit.effects[n] for n in kept], [fit.nonlinear[n] for n in kept], fit.weights)


def jacobian(problem: RegressionProblem, fit: Fit) -> Array:
    """Derivatives of the prediction (samples, joints, coefficients + nonlinear parameters) in the
    order of `values`, nonlinear parameters by differences.
    """
    found = [np.zeros((*problem.target.shape, 0))]
    for effect, parameters in zip(fit.effects, fit.nonlinear, strict=True):
        coefficients = fit.of(effect)[: len(effect.coefficients)]
        found.append(problem.columns(effect, parameters))
        for number, bound in enumerate(effect.parameters(problem.scene)):
            step = np.zeros(len(parameters))
            step[number] = _STEP * (parameters[number] if bound.log else bound.upper - bound.lower)
            change = (
                problem.columns(effect, parameters + step) - problem.columns(effect, parameters - step)
            ) @ coefficients
            found.append((change / (2 * step[number]))[:, :, None])
    return np.concatenate(found, axis=2)
