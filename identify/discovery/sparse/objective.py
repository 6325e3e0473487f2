"""The penalised fit: likelihood with a marginal scale, a price on every amplitude, priors on the rest.

    N/2 ln(r'r / N) + lambda sum_j w_j u_j + e'P e / 2,    u_j = |J_j a_j| / g,  g^2 = max(r'r / N, 1)

u_j is by how many units of what is left an amplitude a_j (of one spring, or of a group) moves the FRFs:
the square-root lasso (Belloni, Chernozhukov and Wang, Biometrika 98 (2011) 791-806), in which no noise
level has to be known.  w = 1 / (1 + u / lambda^2): what is large is not shrunk (majorise-minimise of the
logarithmic price lambda^3 ln(1 + u / lambda^2): Candes, Wakin and Boyd, J. Fourier Anal. Appl. 14 (2008)
877-905), so that the price of much that is missing does not keep a fit away from data that ask for it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Index, Mask
from identify.core.bounded import ASIDE, aside, bounded_step
from identify.core.thresholds import CLOSED
from identify.discovery.sparse.unknowns import Unknowns
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, FrfLeastSquaresObjective
from identify.vibration.costs.information import Rows, bend, by_lines, each_set, rows_of
from identify.vibration.costs.target import FrfTarget

PRICE = 3.0
"""lambda: an amplitude must move what is left by about three of its standard deviations."""
_LONGEST = 1.5
"""Change of a logarithm, or of an error in its standard deviations, in one step at most."""
_SETTLED, _OF_OPEN = 0.05, 3e-3
"""Fall of the objective, in natural units of log odds, below which it is done; share of what closing the gap
would gain that is as little, where a step was foreseen well: what is missing gains far more than last steps.
"""
_POOR = 0.25
"""Share of a foreseen fall below which a step was foreseen badly: then residuals bend."""
_FEWEST = 3
_TRIALS, _MOST_DAMPED = 8, 1e8
_INNER, _SPARSE = 4, 0.7
"""Steps of what is present alone between two of all unknowns, where that is less than so much of them."""


@dataclass(frozen=True)
class Point:
    """Where a fit is: x (f,) on the search scale, damping of the next step, steps taken; settled: no step
    lowers it; the objective there and its fall in the last step.
    """

    x: Array
    damping: float = 1e-2
    steps: int = 0
    settled: bool = False
    value: float = np.inf
    fall: float = np.inf


@dataclass(frozen=True)
class Local:
    """The objective about a point: product (f + 1, f + 1) of [J r], scale g, weights (springs as f,
    groups in order); told: what the sets say there of the unknowns that move, numbers (m,); slope: d value /
    d x of these.
    """

    product: Array
    gap: float
    spring_weights: Array
    group_weights: Array
    told: Sequence[tuple[FrfTarget, Rows]]
    moving: Index
    slope: Array


class Penalised:
    """The objective of a dense problem; logarithmic: residuals are logarithms, for the first steps;
    price: lambda, 0 where nothing is shrunk.
    """

    def __init__(self, unknowns: Unknowns, *, logarithmic: bool = False, price: float = PRICE) -> None:
        self.unknowns, self.price, self.logarithmic = unknowns, price, logarithmic
        targets = replace(unknowns.problem.targets(), nuisances=())
        cost = FrfLeastSquares(residual="log" if logarithmic else "complex")
        self._likelihood, self.targets = FrfLeastSquaresObjective(cost, targets), targets.frf
        self.count = unknowns.count
        single = unknowns.springs & ~unknowns.coupled
        self.alone = single & ~unknowns.with_prior
        self.groups = [unit for unit in unknowns.units if unit.priced and not single[unit.amplitudes].all()]

    def squares(self, x: Array) -> float:
        """Sum of squared residuals."""
        with np.errstate(all="ignore"):
            cost = float(self._likelihood.costs(self.unknowns.to_values(x)[None])[0])
        return cost**2 * self.count if np.isfinite(cost) else np.inf

    def local(self, x: Array, moving: Mask | None = None) -> Local:
        """What the objective is about a point; nothing of unknowns that are not moving, (f,)."""
        values, numbers = self.unknowns.to_values(x), self.unknowns.free
        some = np.flatnonzero(np.ones(len(numbers), dtype=bool) if moving is None else moving)
        free, targets = numbers[some], by_lines(self.targets, len(some))

        def own(target: FrfTarget) -> tuple[Rows, Array]:
            rows = rows_of(target, values, free, self._likelihood.residuals_of)
            return rows, rows.product(free)

        rows, parts = zip(*each_set(own, targets), strict=True)
        slope = np.where(self.unknowns.log, values[numbers], 1.0)[some]
        product, place = np.zeros((len(numbers) + 1,) * 2), np.append(some, len(numbers))
        product[np.ix_(place, place)] = sum(parts) * np.outer(np.append(slope, 1.0), np.append(slope, 1.0))
        gap = float(np.sqrt(max(product[-1, -1] / self.count, 1.0)))
        near = not self.logarithmic and self.price > 0

        def weights(units: Array) -> Array:
            return 1 / (1 + units / self.price**2) if near else np.ones_like(units)

        of_springs = np.where(self.alone, weights(np.sqrt(np.diag(product)[:-1]) * np.abs(x) / gap), 0.0)
        of_groups = weights(np.array([self.unknowns.moved(unit, x, product) / gap for unit in self.groups]))
        told = list(zip(targets, rows, strict=True))
        return Local(product, gap, of_springs, of_groups, told, some, slope)

    def value(self, squares: float, x: Array, local: Local) -> float:
        """The objective at x, with the prices of the point that `local` is about."""
        mean = squares / self.count
        fit = 0.5 * self.count * (np.log(mean) if mean > 1 else mean - 1)
        each = local.spring_weights * np.sqrt(np.diag(local.product)[:-1]) * np.abs(x) / local.gap
        groups = [self.unknowns.moved(unit, x, local.product) / local.gap for unit in self.groups]
        prices = self.price * (each.sum() + local.group_weights @ np.array(groups))
        return float(fit + prices + self.unknowns.unlikely(x))

    def quadratic(self, x: Array, local: Local) -> tuple[Array, Array]:
        """Curvature (f, f) and downhill slope (f,) of the objective; groups by the quadratic that touches
        their price.
        """
        away, scale = x - self.unknowns.reference, local.gap**2
        curvature, slope = local.product[:-1, :-1] / scale, -local.product[:-1, -1] / scale
        precision = self.unknowns.precision_at(x)
        curvature = curvature + np.diag(precision)
        slope = slope - precision * away
        slope -= self.price * local.spring_weights * np.sqrt(np.diag(local.product)[:-1]) / local.gap
        for unit, weight in zip(self.groups, local.group_weights, strict=True):
            own = np.ix_(unit.amplitudes, unit.amplitudes)
            units = self.unknowns.moved(unit, x, local.product) / local.gap
            pull = self.price * weight / max(units, 1.0) * local.product[own] / scale
            curvature[own] += pull
            slope[unit.amplitudes] -= pull @ away[unit.amplitudes]
        return curvature, slope

    def led(self, point: Point, steps: int) -> Point:
        """So many steps at most of all but nuisance parameters, which wait: near a start others matter."""
        while not point.settled and point.steps < steps:
            point = self.step(point, ~self.unknowns.nuisances)
        return point

    def minimise(self, point: Point, steps: int, until: float = np.inf, rival: float = np.inf) -> Point:
        """So many steps at most: of all unknowns, and between those a few of what is present alone, which
        cost far less where most is absent; few after `until`, s of the monotonic clock; none once as large
        ones as the last would not reach the objective of a rival.
        """
        while not point.settled and point.steps < steps:
            if point.steps >= _FEWEST and time.monotonic() > until:
                break
            point = self.step(point)
            if point.value - rival > (steps - point.steps) * point.fall:
                break
            inner, last = point, min(point.steps + _INNER, steps)
            moving = self.unknowns.present(point.x)
            while not inner.settled and inner.steps < last and moving.mean() < _SPARSE:
                inner = self.step(inner, moving)
            point = replace(inner, settled=point.settled)
        return point

    def _least(self, gap: float) -> float:
        """The fall below which a fit is done."""
        return max(_SETTLED, _OF_OPEN * self.count * float(np.log(gap / CLOSED)))

    def _bend(self, x: Array, change: Array, local: Local) -> Array:
        """J'r'' (f,), with the second derivatives r'' of the residuals along a change (f,), but for unknowns
        so near a bound that there is nothing on its other side; zero where it is not finite.
        """
        away = aside(x, change, *self.unknowns.limits)
        sides = np.array([self.unknowns.to_values(x + away), self.unknowns.to_values(x - away)])
        found, free = np.zeros(len(x)), self.unknowns.free[local.moving]
        bent = bend(local.told, self._likelihood.residuals_of, sides, free) * local.slope / ASIDE**2
        found[local.moving] = bent if np.isfinite(bent).all() else 0.0
        return found

    def step(self, point: Point, moving: Mask | None = None) -> Point:
        """One damped Gauss-Newton step within bounds (Marquardt, J. SIAM 11 (1963) 431-441)."""
        x, damping, local = point.x, point.damping, self.local(point.x, moving)
        if not np.isfinite(local.product).all():
            return replace(point, settled=True)
        (curvature, slope), scale = self.quadratic(x, local), local.gap**2
        diagonal = np.where(np.diag(curvature) > 0, np.diag(curvature), 1.0)
        here = self.value(float(local.product[-1, -1]), x, local)
        lower, upper = (side - x for side in self.unknowns.limits)
        reach = np.where(self.unknowns.log | (self.unknowns.precision > 0), _LONGEST, np.inf)
        reach = np.where(self.unknowns.log, reach, 2 * reach)
        lowest, highest = np.maximum(lower, -reach), np.minimum(upper, reach)
        growth = 4.0
        for _ in range(_TRIALS):
            damped = curvature + damping * np.diag(diagonal)
            change = _within(damped, slope, (lowest, highest), local.moving)
            foreseen = slope @ change - 0.5 * change @ curvature @ change
            fall, there = here - self.value(self.squares(x + change), x + change, local), x + change
            if fall < _POOR * foreseen:
                bent, left = -self._bend(x, change, local) / (2 * scale), (lowest - change, highest - change)
                other = np.clip(there + _within(damped, bent, left, local.moving), *self.unknowns.limits)
                less = here - self.value(self.squares(other), other, local)
                fall, there = max((fall, there), (less, other), key=lambda pair: pair[0])
            if fall > 0:
                poor = fall < _POOR * foreseen
                damping *= 0.2 if fall > 0.7 * foreseen else 3.0 if poor else 1.0
                done = fall < (_SETTLED if poor else self._least(local.gap))
                return Point(there, max(damping, 1e-9), point.steps + 1, bool(done), here - fall, fall)
            damping, growth = damping * growth, 2 * growth
            if damping > _MOST_DAMPED:
                break
        return replace(point, settled=True)


def _within(curvature: Array, slope: Array, bounds: tuple[Array, Array], moving: Index) -> Array:
    """(f,): the step within bounds of those that move."""
    own, change = curvature[np.ix_(moving, moving)], np.zeros(len(slope))
    change[moving] = bounded_step(own, slope[moving], *(side[moving] for side in bounds))
    return change
