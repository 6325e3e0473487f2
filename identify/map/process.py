"""What a model leaves of measured numbers over postures, as a Gaussian process (Rasmussen and Williams 2006,
chapters 2 and 5).

A relative error y of a mode with the shape psi at the posture q is, of an error E(q) of the stiffness matrix
in units of that matrix, psi' E psi / 2 to first order, psi of unit strain energy.  With entries of E that are
independent processes over the posture, two modes (or one at two postures) have

    cov(y, y') = s^2 (psi' psi')^2 exp(-d^2 / 2 l^2) + sigma^2 [same],   d^2 = sum_j (2 sin(dq_j / 2))^2,

so that modes need no numbers, and may cross between postures.  The fit has moved its parameters to make y
small where it was fitted; so y also has a part A b, b normal of unit variance, that is broad in all that a
fit moves (`identify.map.residuals`), and what it took away counts for nothing.  Against the process stands
scatter alone.  Hyperparameters are integrated over a grid, and both hypotheses averaged, each with its
evidence (Hoeting et al. 1999): what the data do not tell stays in the interval.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import special

from identify.core.arrays import Array, Index

SIZES = np.geomspace(1e-4, 1.0, 17)
"""Grid of amplitude and scatter, both of relative errors.  Each is evenly likely from nothing to 1, the prior
that few numbers mislead least (Gelman 2006, Bayesian Analysis 1, 515)."""
LENGTHS = np.geomspace(0.25, 4.0, 5)
"""rad: by how much a joint turns until errors are others."""
_LENGTH = 0.7
"""Its prior: lognormal about it, of standard deviation 1.  Inertia about a joint goes with sines and cosines
of others, of which it is the length."""
SHARED = np.linspace(0.0, 1.0, 6)
"""Of two robots of a type, the correlation of what their models leave."""
_LEFT, _HALVINGS = 1e-3, 20
"""Budgets: what is left out of the weights of the grid, and halvings of quantiles."""


@dataclass(frozen=True)
class Seen:
    """n places: postures (n, joints), rad; shapes (n, m) of unit length, whose product says how alike two
    are; the robot (n,) that each was seen on; and A (n, r), by which a fit can have moved them.
    """

    posture: Array
    shape: NDArray[np.complex128]
    robot: Index
    absorbed: Array

    def rows(self, chosen: Index | NDArray[np.bool_]) -> Seen:
        """Some of them."""
        return Seen(self.posture[chosen], self.shape[chosen], self.robot[chosen], self.absorbed[chosen])

    def kernel(self, other: Seen, length: float, shared: float) -> Array:
        """Covariance of each with each other (n, k), over s^2."""
        shape = np.abs(self.shape.conj() @ other.shape.T) ** 2
        turned = self.posture[:, None] - other.posture[None]
        distance = np.sum((2 * np.sin(turned / 2)) ** 2, axis=-1)
        same = self.robot[:, None] == other.robot[None]
        return np.asarray(shape * np.exp(-distance / (2 * length**2)) * np.where(same, 1.0, shared))


@dataclass(frozen=True)
class Cell:
    """One hypothesis: amplitude s (0: no process), length l, correlation of robots, scatter sigma; and its
    posterior weight.
    """

    amplitude: float
    length: float
    shared: float
    scatter: float
    weight: float


@dataclass(frozen=True)
class Learned:
    """What was learned of relative errors y (n,) seen at places: the cells that count, and the log odds for a
    process over scatter alone.
    """

    seen: Seen
    y: Array
    cells: tuple[Cell, ...]
    log_odds: float

    def mean_of(self, name: str) -> float:
        """The geometric posterior mean of `amplitude` or `length`, given that there is a process, or of
        `scatter`; the arithmetic mean of `shared`.
        """
        cells = [one for one in self.cells if one.amplitude or name == "scatter"]
        if not cells:
            return float("nan")
        weight, values = (np.array([getattr(one, key) for one in cells]) for key in ("weight", name))
        if name == "shared":
            return float(np.average(values, weights=weight))
        return float(np.exp(np.average(np.log(values), weights=weight)))

    def at(self, places: Seen) -> tuple[Array, Array, Array, Array]:
        """Mean, 95 % limits of what would be measured at places (k,), and how much of the variance of the
        process they have taken away, 0 to 1: each (k,).
        """
        mean, variance = np.stack([each for each in self._conditioned(places)], axis=-1)
        weight, amplitude, scatter = (
            np.array([getattr(one, key) for one in self.cells]) for key in ("weight", "amplitude", "scatter")
        )
        part = np.divide(variance, amplitude**2, out=np.ones_like(variance), where=amplitude > 0)
        deviation = np.sqrt(variance + scatter**2)
        low, high = (_quantile(mean, deviation, weight, level) for level in (0.025, 0.975))
        return mean @ weight, low, high, np.clip(1 - part, 0.0, 1.0) @ weight

    def _conditioned(self, places: Seen) -> Iterator[Array]:
        """By cell, mean and variance (2, k) of the process at places."""
        last, basis, turned, moved = None, None, np.zeros(0), np.zeros(0)
        for one in self.cells:
            key = one.length, one.shared, one.amplitude > 0
            if basis is None or key != last:
                own, towards = (
                    here.kernel(self.seen, one.length, one.shared) * (one.amplitude > 0)
                    for here in (self.seen, places)
                )
                last, basis = key, _turned(own, self.seen.absorbed, self.y)
                turned, moved = towards @ basis.vectors, places.absorbed @ basis.absorbed.T
            onto = one.amplitude**2 * turned + moved
            inverse = 1 / (one.amplitude**2 * basis.values + one.scatter**2)
            within = inverse[:, None] * basis.absorbed
            factor = np.linalg.cholesky(np.eye(within.shape[1]) + basis.absorbed.T @ within)
            through = np.linalg.solve(factor, (onto @ within).T)
            pulled = np.linalg.solve(factor, within.T @ basis.y)
            before = one.amplitude**2 + np.sum(places.absorbed**2, axis=1)
            left = before - onto**2 @ inverse + np.sum(through**2, axis=0)
            yield np.stack([onto @ (inverse * basis.y) - pulled @ through, np.maximum(left, 0.0)])


@dataclass(frozen=True)
class _Prior:
    """A kernel (n, n) of a process, with its length and correlation of robots, and ln of its prior."""

    kernel: Array
    length: float
    shared: float
    prior: float


@dataclass(frozen=True)
class _Basis:
    """Where a kernel is diagonal: its values (n,), its vectors (n, n), and y (n,) and A (n, r) there."""

    values: Array
    vectors: Array
    y: Array
    absorbed: Array


def _turned(kernel: Array, absorbed: Array, y: Array) -> _Basis:
    values, vectors = np.linalg.eigh(kernel)
    return _Basis(np.maximum(values, 0.0), vectors, vectors.T @ y, vectors.T @ absorbed)


def learn(seen: Seen, y: Array) -> Learned:
    """From relative errors y (n,) seen at places."""
    several = len(np.unique(seen.robot)) > 1
    shared: Sequence[float] = SHARED.tolist() if several else [1.0]
    before = -0.5 * np.log(LENGTHS / _LENGTH) ** 2
    before = before - special.logsumexp(before) - np.log(len(shared))
    priors = [
        _Prior(seen.kernel(seen, length, rho), length, rho, float(before[number]))
        for (number, length), rho in product(enumerate(LENGTHS.tolist()), shared)
    ]
    empty = _Prior(np.zeros((len(y), len(y))), float(LENGTHS[0]), 1.0, 0.0)
    (process, cells), (nothing, alone) = (
        _hypothesis(some, amplitudes, seen.absorbed, y)
        for some, amplitudes in ((priors, SIZES), ([empty], np.zeros(1)))
    )
    odds = process - nothing
    chance = float(special.expit(odds))
    every = [replace(one, weight=one.weight * chance) for one in cells]
    every += [replace(one, weight=one.weight * (1 - chance)) for one in alone]
    return Learned(seen, y, _kept(every), odds)


def _kept(cells: Sequence[Cell]) -> tuple[Cell, ...]:
    """The cells that count, their weights 1 in all."""
    weight = np.array([one.weight for one in cells])
    order = np.argsort(-weight, kind="stable")
    kept = order[: int(np.searchsorted(np.cumsum(weight[order]), 1 - _LEFT)) + 1]
    return tuple(replace(cells[k], weight=float(weight[k] / weight[kept].sum())) for k in sorted(kept))


def _hypothesis(
    priors: Sequence[_Prior], amplitudes: Array, absorbed: Array, y: Array
) -> tuple[float, list[Cell]]:
    """ln evidence of a family of processes, and its cells."""
    prior = np.log(SIZES / SIZES.sum())
    of_amplitude = prior[:, None] if len(amplitudes) == len(SIZES) else 0.0
    tables = [_evidence(one, amplitudes, absorbed, y) + of_amplitude + prior for one in priors]
    total = float(special.logsumexp(tables))
    weight = np.exp(np.array(tables) - total)
    return total, [
        Cell(float(amplitudes[a]), one.length, one.shared, float(SIZES[s]), float(weight[k, a, s]))
        for k, one in enumerate(priors)
        for a, s in product(range(len(amplitudes)), range(len(SIZES)))
    ]


def _evidence(one: _Prior, amplitudes: Array, absorbed: Array, y: Array) -> Array:
    """ln p(y) (amplitudes, scatters) of a process; absorbed (n, r): A."""
    basis = _turned(one.kernel, absorbed, y)
    inverse = 1 / (amplitudes[:, None, None] ** 2 * basis.values + SIZES[None, :, None] ** 2)
    within = inverse[..., None] * basis.absorbed
    factor = np.linalg.cholesky(np.eye(absorbed.shape[1]) + basis.absorbed.T @ within)
    pulled = np.linalg.solve(factor, np.swapaxes(within, -1, -2) @ basis.y[:, None])
    square = np.sum(basis.y**2 * inverse, axis=-1) - np.sum(pulled**2, axis=(-2, -1))
    size = 2 * np.sum(np.log(np.diagonal(factor, axis1=-2, axis2=-1)), axis=-1)
    size -= np.sum(np.log(inverse), axis=-1)
    return np.asarray(one.prior - 0.5 * (square + size + len(y) * np.log(2 * np.pi)))


def _quantile(mean: Array, deviation: Array, weight: Array, level: float) -> Array:
    """(k,): of mixtures of normal distributions (k, cells), by bisection."""
    low = (mean - 6 * deviation).min(axis=1)
    high = (mean + 6 * deviation).max(axis=1)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        below = special.ndtr((middle[:, None] - mean) / deviation) @ weight < level
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray((low + high) / 2)
