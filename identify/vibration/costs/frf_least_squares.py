"""FRF residuals in units of their own noise: the maximum-likelihood cost, and a robust logarithmic form
for a first stage.

Where the model's coordinates are fewer than the sensors, FRFs are compared in coordinates: with outputs S
(outputs, n) and noise W^-1, residuals W (S y - h) of motions y have the same squares and derivatives as Q'
W (S y - h) = R y - Q' W h, beside what no motion can change, where W S = Q R line by line and input by
input.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Complex, Index, logarithm, real_product
from identify.fitting.objective import Objective, ProductObjective
from identify.vibration.costs.base import Cost, FrfObjective, real_rows
from identify.vibration.costs.information import Rows, bend, by_lines, each_set, over_noise, rows_of, weights
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget

LOG_FLOOR = 0.1
"""Relative error below which the logarithmic form no longer trusts a line more: 10 % of the FRF."""
LOG_LEAST = 1e-3
"""Of the measured FRF: what the model moves less is as far off as this, such as all that a rigid bearing does
not move."""
_KEPT_BYTES = 400_000_000
"""Derivatives that are kept to tell how residuals bend; they are not kept of larger data, nor where every
prediction simulates impacts."""


class FrfLeastSquares(Cost):
    """`complex`: RMS of (H_sim - H_exp)/sigma over real and imaginary parts, the gap; least where the data
    are most likely (Gaussian).

    `log`: RMS of ln(H_sim/H_exp) with weights from the noise; its valley is wide, so a first stage from poor
    guesses ends in the right one.  Channels that the model cannot move say nothing on a log scale and are
    left out of it.
    """

    kind: Literal["frf-least-squares"] = "frf-least-squares"
    residual: Literal["complex", "log"] = Field("complex", description="`log` for a robust first stage")

    def objective(self, targets: Targets) -> Objective:
        """The cost for FRF sets with known noise."""
        if targets.stated:
            return PosteriorObjective(self, targets)
        return FrfLeastSquaresObjective(self, targets)

    @property
    def likelihood(self) -> bool:
        """The complex form, with Gaussian noise."""
        return self.residual == "complex"


class FrfLeastSquaresObjective(FrfObjective[FrfLeastSquares]):
    """RMS over all real and imaginary parts of all measurements.

    shortened: compare in the model's coordinates where these are fewer than the outputs, for fits of many
    models to the same data.
    """

    def __init__(self, cost: FrfLeastSquares, targets: Targets, *, shortened: bool = False) -> None:
        super().__init__(cost, targets)
        wanted = self.targets if shortened and cost.residual == "complex" else ()
        self._short = {target: compressed_frfs(target) for target in wanted}
        self.count = sum(2 * target.sigma.size for target in self.targets)
        self._known: tuple[Array, Array] | None = None
        self._weight: dict[FrfTarget, Array] = {}

    def at(self, values: Array) -> Objective:
        """With nothing known yet."""
        fresh = copy(self)
        fresh._known = None
        return fresh

    def costs(self, candidates: Array) -> Array:
        """Known already where residuals have just been computed, as they are before every step of a gradient
        method.
        """
        if self._known is not None and np.array_equal(self._known[0], candidates):
            return self._known[1]
        return super().costs(candidates)

    def residuals(self, values: Array, free: Index) -> tuple[Array, Array]:
        """In units of noise, or weighted logarithms."""
        rows, slopes = super().residuals(values, free)
        total = float(rows @ rows)
        self._known = values[None].copy(), self.finish(np.array([np.inf if np.isnan(total) else total]))
        return rows, slopes

    def finish(self, total: Array) -> Array:
        """Root of the mean square."""
        return np.asarray(np.sqrt(total / self.count))

    def sums(self, target: FrfTarget, candidates: Array) -> Array:
        """Sum of squares."""
        short = self._short.get(target)
        if short is not None:
            return short.squares(candidates)
        h = target.predict_pairs(candidates)
        if self.cost.residual == "complex":
            residual: Complex = (h - target.measured) / target.sigma
        else:
            residual = self._logarithm(target, h)
        return np.asarray(np.sum(residual.real**2 + residual.imag**2, axis=(-2, -1)))

    def parts(self, target: FrfTarget, values: Array, free: Index) -> tuple[Array, Array]:
        """Real and imaginary parts, in units of noise."""
        short = self._short.get(target)
        if short is not None:
            return short.rows(values, free)
        h, gradient = target.gradient_pairs(values, free)
        if self.cost.residual == "complex":
            return real_rows((h - target.measured) / target.sigma, gradient * (1.0 / target.sigma)[..., None])
        seen = target.observable
        own = gradient if len(seen) == gradient.shape[1] else gradient[:, seen]
        return real_rows(self._logarithm(target, h), own * self._slope(target, h)[..., None])

    def residuals_of(self, target: FrfTarget, h: Complex) -> tuple[Complex, Complex | Array]:
        """Residuals of a set and their derivatives with respect to h, (lines, outputs, inputs) both."""
        if self.cost.residual == "complex":
            return over_noise(target, h)
        outputs, inputs = (numbers[target.observable] for numbers in target.pairs)
        residual, slope = np.zeros_like(h), np.zeros_like(h)
        residual[:, outputs, inputs] = self._logarithm(target, target.paired(h))
        slope[:, outputs, inputs] = self._slope(target, target.paired(h))
        return residual, slope

    def _logarithm(self, target: FrfTarget, h: Complex) -> Complex:
        """Weighted ln(H_sim/H_exp) of the pairs that the model moves, (..., lines, observable)."""
        ratio = h[..., target.observable] / target.measured[:, target.observable]
        some = np.where(np.abs(ratio) < LOG_LEAST, LOG_LEAST, ratio)
        return np.asarray(logarithm(some) * self._weights(target), dtype=complex)

    def _slope(self, target: FrfTarget, h: Complex) -> Complex:
        """Derivative of the same by h."""
        own, measured = h[..., target.observable], target.measured[:, target.observable]
        moved = np.abs(own) >= LOG_LEAST * np.abs(measured)
        return np.asarray(np.where(moved, self._weights(target) / np.where(moved, own, 1.0), 0.0))

    def _weights(self, target: FrfTarget) -> Array:
        if target not in self._weight:
            noise = target.sigma[:, target.observable] / np.abs(target.measured[:, target.observable])
            self._weight[target] = np.asarray(1.0 / np.hypot(LOG_FLOOR, noise))
        return self._weight[target]


class PosteriorObjective(ProductObjective):
    """The same with nuisance parameters fitted along: their squares, and those of parameters with priors
    about zero, in units of their standard deviations, count as residuals (maximum a posteriori), but not as
    measured numbers.

    temperature: what squared residuals are divided by, for stages that lead to the likelihood.
    """

    def __init__(self, cost: FrfLeastSquares, targets: Targets, temperature: float = 1.0) -> None:
        self._likelihood = FrfLeastSquaresObjective(cost, targets)
        self.errors = np.array([number for number, _ in targets.stated], dtype=int)
        self._std = np.array([std for _, std in targets.stated])
        self._temperature = temperature
        self.count, self.targets = self._likelihood.count, self._likelihood.targets
        self._known: tuple[Array, float] | None = None
        self._told: list[tuple[FrfTarget, Rows]] = []
        self._simulated = targets.simulated

    def at(self, values: Array) -> Objective:
        """With nothing known yet."""
        fresh = copy(self)
        fresh._known, fresh._told = None, []
        return fresh

    def costs(self, candidates: Array) -> Array:
        """Root of the mean square of the residuals, with the squares of the errors added to their sum; known
        already where residuals have just been computed.
        """
        if self._known is not None and np.array_equal(self._known[0], candidates):
            return np.array([self._known[1]])
        data = self._likelihood.costs(candidates)
        size = np.linalg.norm(candidates[..., self.errors] / self._std, axis=-1) / np.sqrt(self.count)
        return np.asarray(np.hypot(data / np.sqrt(self._temperature), size))

    def product(self, values: Array, free: Index) -> Array:
        """Of the data, then of the errors."""
        targets = by_lines(self.targets, len(free))
        share = 0 if self._simulated else _KEPT_BYTES // len(targets)
        self._told = []  # before others are made: there is room for one of each set

        def own(target: FrfTarget) -> tuple[Array, Rows | None]:
            rows = rows_of(target, values, free, self._likelihood.residuals_of)
            return rows.product(free), rows if rows.nbytes < share else None

        products, rows = zip(*each_set(own, targets), strict=True)
        kept = [(target, one) for target, one in zip(targets, rows, strict=True) if one is not None]
        self._told = kept if len(kept) == len(targets) else []
        product = np.asarray(sum(products) / self._temperature)
        add_errors(product, values, free, self.errors, self._std)
        total = float(product[-1, -1])
        cost = float(np.sqrt(total / self.count)) if np.isfinite(total) else np.inf
        self._known = values[None].copy(), cost
        return product

    def bend(self, values: Array, free: Index, sides: Array) -> Array | None:
        """Of the data alone, because errors are residuals as they are; where derivatives were kept."""
        there = self._known is not None and np.array_equal(self._known[0][0], values)
        if not there or not self._told:
            return None
        return bend(self._told, self._likelihood.residuals_of, sides, free) / self._temperature


def add_errors(product: Array, values: Array, free: Index, errors: Index, std: Array) -> None:
    """Add to [J r]'[J r] (free + 1, free + 1) the nuisance parameters, numbers (e,) among the values
    (unknowns,), over their standard deviations (e,) as residuals.
    """
    precision = np.zeros(len(values))
    precision[errors] = std**-2
    own = np.flatnonzero(np.isin(free, errors))
    pull = precision[free[own]] * values[free[own]]
    product[own, own] += precision[free[own]]
    product[own, -1] += pull
    product[-1, own] += pull
    product[-1, -1] += precision @ values**2


@dataclass(frozen=True)
class CompressedFrfs:
    """One set: |residual / noise|^2 of motions y (lines, n, inputs) is |R y - w|^2 + rest.

    target: the set with its coordinates as outputs; factor R (lines, inputs, n, n); wanted w (lines, inputs,
    n).
    """

    target: FrfTarget
    factor: Array
    wanted: Complex
    rest: float

    def squares(self, candidates: Array) -> Array:
        """(m,): sums of squares at values (m, parameters)."""
        moved = np.swapaxes(self.target.predict(candidates), -1, -2)[..., None]
        left = np.ascontiguousarray(real_product(self.factor, moved)[..., 0] - self.wanted)
        flat = left.view(float).reshape(len(candidates), -1)
        return np.asarray(np.einsum("mr,mr->m", flat, flat) + self.rest)

    def rows(self, values: Array, free: Index) -> tuple[Array, Array]:
        """Residuals (r,) and derivatives (r, free) with the same squares and products as those of all
        channels.
        """
        return self.compared(*self.target.gradient(values, free))

    def compared(self, h: Complex, gradient: Complex) -> tuple[Array, Array]:
        """The same of motions h (lines, n, inputs) and their derivatives (lines, n, inputs, free)."""
        every = np.concatenate([gradient, h[..., None]], axis=3)
        turned = real_product(self.factor, np.swapaxes(every, 1, 2)).reshape(-1, every.shape[3])
        turned[:, -1] -= self.wanted.ravel()
        real = np.concatenate([turned.real, turned.imag, np.zeros((1, every.shape[3]))])
        real[-1, -1] = np.sqrt(self.rest)
        return real[:, -1], real[:, :-1]


def compressed_frfs(target: FrfTarget) -> CompressedFrfs | None:
    """A set in coordinates; None where instruments do not read them as they are, they are not fewer than the
    outputs, or a noise is not a number.
    """
    size = target.out.shape[1]
    weight = weights(target)
    plain = target.plain and target.nuisances is None
    if not plain or size >= len(target.data.outputs) or not np.isfinite(weight).all():
        return None
    turned = np.swapaxes(weight, 1, 2)[..., None]
    measured = np.swapaxes(np.where(weight > 0, target.data.frf, 0.0), 1, 2)[..., None]
    basis, factor = np.linalg.qr(turned * target.out)
    wanted = np.asarray(np.swapaxes(basis, -1, -2) @ (turned * measured), dtype=complex)
    rest = float(np.sum(np.abs(turned * measured - basis @ wanted) ** 2))
    return CompressedFrfs(replace(target, out=np.eye(size)), factor, wanted[..., 0], rest)
