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
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.bounded import bounded_step
from identify.discovery.sparse.unknowns import Unknowns
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, FrfLeastSquaresObjective
from identify.vibration.costs.information import by_lines, each_set, rows_of

PRICE = 3.0
"""lambda: an amplitude must move what is left by about three of its standard deviations."""
_LONGEST = 1.5
"""Change of a logarithm, or of an error in its standard deviations, in one step at most."""
_SETTLED = 0.05
"""Fall of the objective, in natural units of log odds, below which it is done; times the squared gap: far
from the data what is missing gains far more than any last steps do."""
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
    groups in order).
    """

    product: Array
    gap: float
    spring_weights: Array
    group_weights: Array


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
        self.alone = single & (unknowns.usual_compliance == 0)
        self.groups = [unit for unit in unknowns.units if unit.priced and not single[unit.amplitudes].all()]

    def squares(self, x: Array) -> float:
        """Sum of squared residuals."""
        with np.errstate(all="ignore"):
            cost = float(self._likelihood.costs(self.unknowns.to_values(x)[None])[0])
        return cost**2 * self.count if np.isfinite(cost) else np.inf

    def product(self, x: Array, moving: Mask | None = None) -> Array:
        """[J r]'[J r] (f + 1, f + 1) on the search scale; zero for unknowns that are not moving, (f,)."""
        values, numbers = self.unknowns.to_values(x), self.unknowns.free
        some = np.flatnonzero(np.ones(len(numbers), dtype=bool) if moving is None else moving)
        free = numbers[some]
        parts = each_set(
            lambda t: rows_of(t, values, free, self._likelihood.residuals_of).product(free),
            by_lines(self.targets, len(free)),
        )
        slope = np.append(np.where(self.unknowns.log, values[numbers], 1.0)[some], 1.0)
        found, place = np.zeros((len(numbers) + 1,) * 2), np.append(some, len(numbers))
        found[np.ix_(place, place)] = sum(parts) * np.outer(slope, slope)
        return found

    def local(self, x: Array, moving: Mask | None = None) -> Local:
        """What the objective is about a point."""
        product = self.product(x, moving)
        gap = float(np.sqrt(max(product[-1, -1] / self.count, 1.0)))
        near = not self.logarithmic and self.price > 0

        def weights(units: Array) -> Array:
            return 1 / (1 + units / self.price**2) if near else np.ones_like(units)

        of_springs = np.sqrt(np.diag(product)[:-1]) * np.abs(x) / gap
        of_groups = np.array([self.unknowns.moved(unit, x, product) / gap for unit in self.groups])
        return Local(product, gap, np.where(self.alone, weights(of_springs), 0.0), weights(of_groups))

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
        some = np.flatnonzero(np.ones(len(x), dtype=bool) if moving is None else moving)
        for _ in range(_TRIALS):
            damped, change = curvature + damping * np.diag(diagonal), np.zeros(len(x))
            change[some] = bounded_step(damped[np.ix_(some, some)], slope[some], lowest[some], highest[some])
            there = x + change
            fall = here - self.value(self.squares(there), there, local)
            if fall > 0:
                foreseen = slope @ change - 0.5 * change @ curvature @ change
                damping *= 0.2 if fall > 0.7 * foreseen else 3.0 if fall < 0.25 * foreseen else 1.0
                settled, steps = bool(fall < _SETTLED * scale), point.steps + 1
                return Point(there, max(damping, 1e-9), steps, settled, here - fall, fall)
            damping *= 4
            if damping > _MOST_DAMPED:
                break
        return replace(point, settled=True)
