"""Least squares of named effects on a recorded motion: linear coefficients inside, nonlinear parameters
outside (variable projection).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from identify.core.arrays import Array, Index, Mask
from identify.core.correlated import column_sizes
from identify.core.latest import Latest
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


def summed(columns: Array, coefficients: Array) -> Array:
    """Columns (samples, joints, coefficients) times their coefficients."""
    flat = columns.reshape(-1, columns.shape[2])
    return np.asarray((flat @ coefficients).reshape(columns.shape[:2]))


@dataclass(frozen=True)
class Columns:
    """Columns of an effect, (samples, some joints, coefficients), of the joints where it acts: most act at
    one.
    """

    joints: Index
    values: Array

    def added_to(self, total: Array, coefficients: Array) -> None:
        """Add what they make of coefficients to a total (samples, joints)."""
        total[:, self.joints] += summed(self.values, coefficients)

    def everywhere(self, joints: int) -> Array:
        """(samples, joints, coefficients)."""
        samples, _, count = self.values.shape
        found = np.zeros((samples, joints, count))
        found[:, self.joints] = self.values
        return found


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
    slow_part: Callable[[Array], Array] | None = None
    """The part (samples, ...) of target and columns that counts, where not all of it does: as far as speeds
    and accelerations are known.
    """
    bodies: Array | None = None
    """What errors of rigid bodies within their stated uncertainty add, (samples, joints, k), each column for
    one standard deviation of its own: `identify.explain.body_errors`.
    """
    remembered: dict[object, Columns] = field(default_factory=dict, repr=False, compare=False)
    searched: dict[object, Array | None] = field(default_factory=dict, repr=False, compare=False)
    """Nonlinear parameters that were found, by effect and by what was there at its joint."""

    @cached_property
    def body_products(self) -> Array:
        """(joints, k, k): products of the columns of `bodies` over the samples that count, joint by joint."""
        assert self.bodies is not None
        counted = np.where(self.mask[:, :, None], self.bodies, 0.0).swapaxes(0, 1)
        return np.asarray(counted.swapaxes(1, 2) @ counted)

    @cached_property
    def left(self) -> Latest[tuple[Array, float]]:
        """What two fits leave, of which one is compared with many others (`identify.explain.gain`)."""
        return Latest(2)

    @cached_property
    def samples(self) -> Latest[float]:
        """How many independent samples what such a fit leaves is worth."""
        return Latest(1)

    def columns(self, effect: MotionEffect, parameters: Array) -> Array:
        """Columns (samples, joints, coefficients) of an effect."""
        return self.columns_where(effect, parameters).everywhere(self.target.shape[1])

    def columns_where(self, effect: MotionEffect, parameters: Array) -> Columns:
        """The same where it acts; those without nonlinear parameters, and the latest with them, are kept."""
        key = type(effect), effect, parameters.tobytes()
        if key not in self.remembered:
            if len(self.remembered) > _KEPT:
                for old in [one for one in self.remembered if one[2]]:  # type: ignore[index]
                    del self.remembered[old]
            found = self.from_datum(effect.columns(self.scene, parameters))
            joints = np.flatnonzero(found.any(axis=(0, 2)))
            self.remembered[key] = Columns(joints, np.ascontiguousarray(found[:, joints]))
        return self.remembered[key]

    def instruments_where(self, effect: MotionEffect, parameters: Array) -> Array | None:
        """Instruments (samples, joints where it acts, coefficients) of an effect, if it has any."""
        found = effect.instruments(self.scene, parameters)
        if found is None:
            return None
        return np.ascontiguousarray(self.from_datum(found)[:, self.columns_where(effect, parameters).joints])

    @cached_property
    def wanted(self) -> Array:
        """What counts of the target (samples, joints), without its datum."""
        return self.from_datum(self.target)

    def from_datum(self, values: Array) -> Array:
        """What counts of values (samples, joints, ...), without the datum of each record and joint, by least
        squares over the samples that count.
        """
        values = values if self.slow_part is None else self.slow_part(values)
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
    """Effects with their nonlinear parameters, coefficients (of all columns, errors of stated bodies last)
    and the weights used.

    weights (joints,): one over the size of the residual that each joint was expected to leave.
    """

    effects: tuple[MotionEffect, ...]
    nonlinear: tuple[Array, ...]
    coefficients: Array
    weights: Array

    def of(self, effect: MotionEffect) -> Array:
        """Coefficients of one effect, then its nonlinear parameters."""
        first = self._first(effect)
        nonlinear = self.nonlinear[self.effects.index(effect)]
        return np.concatenate([self.coefficients[first : first + len(effect.coefficients)], nonlinear])

    def _first(self, effect: MotionEffect) -> int:
        return sum(len(e.coefficients) for e in self.effects[: self.effects.index(effect)])

    @property
    def body_errors(self) -> Array:
        """Errors of stated bodies (k,), in standard deviations of each."""
        return self.coefficients[sum(len(effect.coefficients) for effect in self.effects) :]

    def replaced(self, effect: MotionEffect, coefficients: Array) -> Fit:
        """The same with other coefficients of one effect."""
        first = self._first(effect)
        changed = self.coefficients.copy()
        changed[first : first + len(coefficients)] = coefficients
        return replace(self, coefficients=changed)

    def predict(self, problem: RegressionProblem) -> Array:
        """What the effects add up to on a record, (samples, joints), from the record's own datum and what
        does not count.
        """
        total, first = problem.target - problem.wanted, 0
        for effect, parameters in zip(self.effects, self.nonlinear, strict=True):
            last = first + len(effect.coefficients)
            problem.columns_where(effect, parameters).added_to(total, self.coefficients[first:last])
            first = last
        if problem.bodies is not None:
            total += summed(problem.bodies, self.coefficients[first:])
        return total

    def residual(self, problem: RegressionProblem) -> Array:
        """What is left of a record, (samples, joints), zero where samples do not count."""
        return np.where(problem.mask, problem.target - self.predict(problem), 0.0)

    def share(self, problem: RegressionProblem, effect: MotionEffect) -> Array:
        """What one effect adds on a record, (samples, joints)."""
        values = self.of(effect)
        count = len(effect.coefficients)
        found = np.zeros(problem.target.shape)
        problem.columns_where(effect, values[count:]).added_to(found, values[:count])
        return found


def design(problem: RegressionProblem, effects: Sequence[MotionEffect], nonlinear: Sequence[Array]) -> Array:
    """All columns (samples, joints, p), those of errors of stated bodies last."""
    parts = [problem.columns_where(*one) for one in zip(effects, nonlinear, strict=True)]
    ends = np.cumsum([0, *(part.values.shape[2] for part in parts)])
    errors = 0 if problem.bodies is None else problem.bodies.shape[2]
    found = np.zeros((*problem.target.shape, ends[-1] + errors))
    for part, first, last in zip(parts, ends, ends[1:], strict=False):
        found[:, part.joints, first:last] = part.values
    if problem.bodies is not None:
        found[:, :, ends[-1] :] = problem.bodies
    return found


def instruments(
    problem: RegressionProblem, effects: Sequence[MotionEffect], nonlinear: Sequence[Array]
) -> Array | None:
    """What residuals are made orthogonal to, like `design`; None where that is the columns themselves."""
    own = [problem.instruments_where(*one) for one in zip(effects, nonlinear, strict=True)]
    if all(part is None for part in own):
        return None
    found, first = design(problem, effects, nonlinear), 0
    for effect, parameters, part in zip(effects, nonlinear, own, strict=True):
        last = first + len(effect.coefficients)
        if part is not None:
            found[:, problem.columns_where(effect, parameters).joints, first:last] = part
        first = last
    return found


def expected_size(problem: RegressionProblem, effects: Sequence[MotionEffect]) -> Array:
    """One over the standard deviation that each coefficient (p,) is expected to have before the data speak;
    zero where it may be anything.
    """
    own = [effect.expected_size(problem.scene) for effect in effects]
    bodies = np.zeros(0) if problem.bodies is None else np.ones(problem.bodies.shape[2])
    return np.concatenate([*own, bodies])


def strain(problem: RegressionProblem, fit: Fit) -> Array:
    """Coefficients (p,) over what they were expected to be: half its sum of squares is their log odds."""
    return expected_size(problem, fit.effects) * fit.coefficients


def solve(
    problem: RegressionProblem,
    effects: Sequence[MotionEffect],
    nonlinear: Sequence[Array],
    weights: Array,
    *,
    plain: bool = False,
) -> Fit:
    """The best coefficients for given nonlinear parameters, and for what is expected of them; of columns that
    cannot be distinguished, the smallest; plain: by least squares, whatever instruments there are.
    """
    columns, weight = design(problem, effects, nonlinear), np.where(problem.mask, weights, 0.0)
    rows = _weighted(columns, weight)
    other = None if plain else instruments(problem, effects, nonlinear)
    probes = rows if other is None else _weighted(other, weight)
    products, pull = probes.T @ rows, probes.T @ (problem.wanted * weight).ravel()
    scale, own = column_sizes(rows), column_sizes(probes)
    prior = expected_size(problem, effects) / scale
    matrix = products / np.outer(own, scale) + np.diag(prior**2)
    coefficients = np.linalg.pinv(matrix, rcond=RANK, hermitian=other is None) @ (pull / own) / scale
    return Fit(tuple(effects), tuple(nonlinear), coefficients, weights)


def _weighted(columns: Array, weight: Array) -> Array:
    """(samples * joints, p) of columns (samples, joints, p) and weights (samples, joints)."""
    return np.asarray((columns * weight[:, :, None]).reshape(weight.size, columns.shape[2]))


def aligned(problem: RegressionProblem, fit: Fit) -> Fit:
    """The fit with the phases of its waves turned to suit a record whose positions count from its own
    beginning; sizes stay.
    """
    if not problem.scene.relative:
        return fit
    residual = fit.residual(problem)
    for number, effect in enumerate(fit.effects):
        if effect.harmonic:
            columns = problem.columns_where(effect, fit.nonlinear[number])
            coefficients, mask = fit.of(effect)[: len(effect.coefficients)], problem.mask[:, columns.joints]
            quadrature = np.stack([-coefficients[1::2], coefficients[::2]], axis=1).ravel()
            harmonic, turned = (
                np.where(mask, summed(columns.values, values), 0.0) for values in (coefficients, quadrature)
            )
            left = residual[:, columns.joints] + harmonic
            angle = np.arctan2((left * turned).sum(), (left * harmonic).sum())
            fit = fit.replaced(effect, np.cos(angle) * coefficients + np.sin(angle) * quadrature)
            residual[:, columns.joints] = left - np.cos(angle) * harmonic - np.sin(angle) * turned
    return fit


def loss(problem: RegressionProblem, fit: Fit) -> float:
    """Weighted sum of squares of what is left, and of what coefficients are beyond what was expected."""
    return float(((fit.residual(problem) * fit.weights) ** 2).sum() + (strain(problem, fit) ** 2).sum())


def without(problem: RegressionProblem, fit: Fit, name: str) -> Fit:
    """The fit without the effect of that name, nonlinear parameters of the others kept."""
    kept = [number for number, other in enumerate(fit.effects) if other.name != name]
    return solve(problem, [fit.effects[n] for n in kept], [fit.nonlinear[n] for n in kept], fit.weights)


def jacobian(problem: RegressionProblem, fit: Fit, *, probes: bool = False) -> Array:
    """Derivatives of the prediction (samples, joints, coefficients + nonlinear parameters) in the order of
    `values`, nonlinear parameters by differences; errors of stated bodies last.  probes: what residuals are
    made orthogonal to, in their place.
    """
    found = [np.zeros((*problem.target.shape, 0))]
    for effect, parameters in zip(fit.effects, fit.nonlinear, strict=True):
        coefficients = fit.of(effect)[: len(effect.coefficients)]
        found.append(problem.columns(effect, parameters))
        own = problem.instruments_where(effect, parameters) if probes else None
        if own is not None:
            found[-1][:, problem.columns_where(effect, parameters).joints] = own
        for number, bound in enumerate(effect.parameters(problem.scene)):
            step = np.zeros(len(parameters))
            step[number] = _STEP * (parameters[number] if bound.log else bound.upper - bound.lower)
            change = (
                problem.columns(effect, parameters + step) - problem.columns(effect, parameters - step)
            ) @ coefficients
            found.append((change / (2 * step[number]))[:, :, None])
    if problem.bodies is not None:
        found.append(problem.bodies)
    return np.concatenate(found, axis=2)


def parameter_prior(problem: RegressionProblem, fit: Fit) -> Array:
    """`expected_size` in the order of `jacobian`; nonlinear parameters may be anything in their bounds."""
    found = []
    for effect, parameters in zip(fit.effects, fit.nonlinear, strict=True):
        found += [effect.expected_size(problem.scene), np.zeros(len(parameters))]
    return np.concatenate([*found, np.ones(len(fit.body_errors))])
