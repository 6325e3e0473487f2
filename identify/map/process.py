"""What a model leaves of measured numbers over postures, as a Gaussian process (Rasmussen and Williams 2006,
chapters 2 and 5).

A relative error y of a mode with the shape psi at the posture q is, of an error E(q) of the stiffness matrix
in units of that matrix, psi' E psi / 2 to first order, psi of unit strain energy.  With entries of E that are
independent processes over the posture, two modes (or one at two postures) have

    cov(y, y') = s^2 (psi' psi')^2 exp(-d^2 / 2 l^2) + sigma^2 [same] / w,  d^2 = sum_j (2 sin(dq_j / 2))^2,

so that modes need no numbers, and may cross between postures.  The scatter has Student's distribution of four
degrees of freedom, for pairs of modes that are none (Lange et al. 1989): w by variational Bayes (Tipping and
Lawrence 2005).  Against the process stands scatter alone.  Hyperparameters are integrated over a grid, and
both hypotheses averaged, each with its evidence (Hoeting et al. 1999): what the data do not tell stays in the
interval.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from identify.core.arrays import Array, Index

SIZES = np.geomspace(1e-4, 1.0, 17)
"""Grid of amplitude and scatter, both of relative errors: any that a fit leaves; evenly likely by factor."""
LENGTHS = np.geomspace(0.125, 4.0, 6)
"""rad: by how much a joint turns until errors are others."""
_LENGTH = 0.7
"""Its prior: lognormal about it, of standard deviation 1.  Inertia about a joint goes with sines and cosines
of others, of which it is the length."""
SHARED = np.linspace(0.0, 1.0, 6)
"""Of two robots of a type, the correlation of what their models leave."""
_FREEDOM = 4.0
"""Of Student's distribution of the scatter."""
_NODES = stats.gamma.ppf((np.arange(16) + 0.5) / 16, _FREEDOM / 2, scale=2 / _FREEDOM)
"""Weights of the scatter of a new number, evenly likely."""
_LEFT, _ROUNDS, _SAME, _HALVINGS = 1e-3, 50, 1e-2, 20
"""Budgets: what is left out of the weights of the grid, rounds of the weights of the scatter until they are
the same, halvings of quantiles."""


@dataclass(frozen=True)
class Seen:
    """n places: postures (n, joints), rad; shapes (n, m) of unit length, whose product says how alike two
    are; and the robot (n,) that each was seen on.
    """

    posture: Array
    shape: NDArray[np.complex128]
    robot: Index

    def rows(self, chosen: Index | NDArray[np.bool_]) -> Seen:
        """Some of them."""
        return Seen(self.posture[chosen], self.shape[chosen], self.robot[chosen])

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
    """What was learned of relative errors y (n,) seen at places: the cells that count, the log odds for a
    process over scatter alone, and weights w (n,) of the scatter beside a process.
    """

    seen: Seen
    y: Array
    cells: tuple[Cell, ...]
    log_odds: float
    w: Array

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
        """Mean, 95 % limits of what would be measured at places (k,), and how much of the variance before any
        data (scatter aside) they have taken away, 0 to 1: each (k,).
        """
        size = len(places.posture)
        means, deviations, known, weight = [np.zeros((size, 0))], [np.zeros((size, 0))], np.zeros(size), []
        for cells, mean, left in self._conditioned(places):
            amplitude, scatter, share = (
                np.array([getattr(one, key) for one in cells]) for key in ("amplitude", "scatter", "weight")
            )
            noise = scatter / np.sqrt(_NODES[:, None])
            spread = np.hypot((np.sqrt(left) * amplitude)[:, None], noise).reshape(size, -1)
            deviations.append(spread)
            means.append(np.tile(mean, len(_NODES)))
            weight.append(np.tile(share / len(_NODES), len(_NODES)))
            known += (1 - left) @ share
        m, d, w = (np.concatenate(each, axis=-1) for each in (means, deviations, weight))
        low, high = (_quantile(m, d, w, level) for level in (0.025, 0.975))
        return m @ w, low, high, known

    def _conditioned(self, places: Seen) -> Iterator[tuple[list[Cell], Array, Array]]:
        """By cells that share a kernel: their means (k, cells), and the share of the variance of the process
        that is left (k, cells).
        """
        groups: dict[tuple[float, float, bool], list[Cell]] = {}
        for one in self.cells:
            groups.setdefault((one.length, one.shared, one.amplitude > 0), []).append(one)
        root = np.sqrt(self.w)
        for (length, shared, process), cells in groups.items():
            if not process:
                nothing = np.zeros((len(places.posture), len(cells)))
                yield cells, nothing, nothing + 1
                continue
            own = self.seen.kernel(self.seen, length, shared) * np.outer(root, root)
            values, vectors = np.linalg.eigh(own)
            onto = (places.kernel(self.seen, length, shared) * root) @ vectors
            s2, noise = (np.array([getattr(c, key) for c in cells]) ** 2 for key in ("amplitude", "scatter"))
            gain = s2 / (s2 * np.maximum(values, 0.0)[:, None] + noise)
            mean = onto @ (gain * (vectors.T @ (root * self.y))[:, None])
            yield cells, mean, np.clip(1 - onto**2 @ gain, 0.0, 1.0)


@dataclass(frozen=True)
class _Prior:
    """A kernel (n, n) of a process, with its length and correlation of robots, and ln of its prior."""

    kernel: Array
    length: float
    shared: float
    prior: float


def learn(seen: Seen, y: Array, begin: Array | None = None) -> Learned:
    """From relative errors y (n,) seen at places; begin (n,): weights of the scatter that are about right."""
    several = len(np.unique(seen.robot)) > 1
    shared: Sequence[float] = SHARED.tolist() if several else [1.0]
    before = -0.5 * np.log(LENGTHS / _LENGTH) ** 2
    before = before - special.logsumexp(before) - np.log(len(shared))
    priors = [
        _Prior(seen.kernel(seen, length, rho), length, rho, float(before[number]))
        for (number, length), rho in product(enumerate(LENGTHS.tolist()), shared)
    ]
    empty = _Prior(np.zeros((len(y), len(y))), float(LENGTHS[0]), 1.0, 0.0)
    equal = np.ones(len(y))
    nothing, alone, without = _hypothesis([empty], np.zeros(1), y, equal)
    # the bound has several maxima: from equal weights, and from those without a process
    starts = (equal, without) if begin is None else (begin,)
    found = [_hypothesis(priors, SIZES, y, start) for start in starts]
    process, cells, w = max(found, key=lambda one: one[0])
    odds = process - nothing
    chance = float(special.expit(odds))
    every = [replace(one, weight=one.weight * chance) for one in cells]
    every += [replace(one, weight=one.weight * (1 - chance)) for one in alone]
    return Learned(seen, y, _kept(every), odds, w)


def _kept(cells: Sequence[Cell]) -> tuple[Cell, ...]:
    """The cells that count, their weights 1 in all."""
    weight = np.array([one.weight for one in cells])
    order = np.argsort(-weight, kind="stable")
    kept = order[: int(np.searchsorted(np.cumsum(weight[order]), 1 - _LEFT)) + 1]
    return tuple(replace(cells[k], weight=float(weight[k] / weight[kept].sum())) for k in kept)


def _hypothesis(
    priors: Sequence[_Prior], amplitudes: Array, y: Array, begin: Array
) -> tuple[float, list[Cell], Array]:
    """The bound of ln evidence of a family of processes, its cells, and the weights (n,) of the scatter, from
    weights to begin with.
    """
    shape = (_FREEDOM + 1) / 2
    rate = shape / begin
    for _ in range(_ROUNDS):
        w = shape / rate
        tables, squares = zip(*(_evidence(one, amplitudes, y, w) for one in priors), strict=True)
        evidence = np.array(tables) - np.log(len(amplitudes) * len(SIZES))
        total = float(special.logsumexp(evidence))
        weight = np.exp(evidence - total)
        left = sum(np.einsum("as,asn->n", some, own) for some, own in zip(weight, squares, strict=True))
        bound = total + float(np.sum((special.digamma(shape) - np.log(rate)) / 2)) - _divergence(shape, rate)
        changed, rate = rate, (_FREEDOM + left / w) / 2
        if np.max(np.abs(np.log(changed / rate))) < _SAME:
            break
    cells = [
        Cell(float(amplitudes[a]), one.length, one.shared, float(SIZES[s]), float(weight[k, a, s]))
        for k, one in enumerate(priors)
        for a, s in product(range(len(amplitudes)), range(len(SIZES)))
    ]
    return bound, cells, w


def _evidence(one: _Prior, amplitudes: Array, y: Array, w: Array) -> tuple[Array, Array]:
    """ln p(y) (amplitudes, scatters) and what is left of y^2 w / sigma^2 (amplitudes, scatters, n), its
    uncertainty with it, of a process with scatter of weights w (n,).
    """
    root = np.sqrt(w)
    values, vectors = np.linalg.eigh(one.kernel * np.outer(root, root))
    turned = vectors.T @ (root * y)
    signal = amplitudes[:, None, None] ** 2 * np.maximum(values, 0.0)
    noise = np.broadcast_to(SIZES[None, :, None] ** 2, (*signal.shape[:1], len(SIZES), 1))
    variance = signal + noise
    table = one.prior - 0.5 * np.sum(turned**2 / variance + np.log(2 * np.pi * variance), axis=-1)
    rest = (noise / variance * turned) @ vectors.T
    return table, (rest**2 + (signal * noise / variance) @ (vectors**2).T) / noise


def _divergence(shape: float, rate: Array) -> float:
    """Kullback-Leibler divergence of the gamma distributions of all weights from their prior."""
    before = _FREEDOM / 2
    constant = (shape - before) * special.digamma(shape) - special.gammaln(shape) + special.gammaln(before)
    return float(np.sum(constant + before * np.log(rate / before) + shape * (before - rate) / rate))


def _quantile(mean: Array, deviation: Array, weight: Array, level: float) -> Array:
    """(k,): of mixtures of normal distributions (k, cells), by bisection."""
    low = (mean - 6 * deviation).min(axis=1)
    high = (mean + 6 * deviation).max(axis=1)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        below = special.ndtr((middle[:, None] - mean) / deviation) @ weight < level
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray((low + high) / 2)
