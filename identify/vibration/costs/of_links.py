"""The posterior where only errors of the links' inertia move: a first look from afar, at a tenth of the cost.

Masses move resonances; what a sensor or an impact is off by multiplies and mixes FRFs, and counts here as
noise of that size.  So the other errors are held at nothing, and the FRFs are compared in the model's
coordinates (`identify.vibration.costs.compressed`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Index
from identify.fitting.objective import ProductObjective
from identify.measured.frf_set import POWER
from identify.model.nuisances.inertia import moments
from identify.vibration.costs.base import real_rows
from identify.vibration.costs.compressed import CompressedFrfs, compressed_frfs
from identify.vibration.costs.frf_least_squares import add_errors
from identify.vibration.costs.target import FrfTarget, Targets
from identify.vibration.nuisances.nuisance import Slot
from identify.vibration.nuisances.placed import Ends, Placed, State, state
from identify.vibration.nuisances.sensitivity import excited, structural, structural_changes


@dataclass(frozen=True)
class _Set:
    """One FRF set without errors; short: the same in coordinates, where that can be; placed: its links alone;
    told: their state as told.
    """

    target: FrfTarget
    short: CompressedFrfs | None
    placed: Placed
    told: State

    def squares(self, values: Array, off: Array) -> Array:
        """(m,): sums of squares at parameter values (m, parameters) and inertial parameters off (m, links,
        10) what was told.
        """
        mass, stiffness = self.placed.basis.added(off)
        if self.short is not None:
            return replace(self.short, target=_heavier(self.short.target, mass, stiffness)).squares(values)
        h = _heavier(self.target, mass, stiffness).predict_pairs(values)
        residual = (h - self.target.measured) / self.target.sigma
        return np.asarray(np.sum(residual.real**2 + residual.imag**2, axis=(-2, -1)))

    def rows(self, values: Array, free: Index, off: Array, slopes: Array) -> tuple[Array, Array, Index]:
        """Residuals (r,), derivatives (r, k) and the numbers (k,) of what they are by: of the free parameters
        at values (parameters,), then of the errors of links.  slopes (links, 10, 10): of the inertial
        parameters.
        """
        mass, stiffness = self.placed.basis.added(off)
        there = _heavier(self.target if self.short is None else self.short.target, mass, stiffness)
        at = replace(self.told, mass=mass, stiffness=stiffness, slopes=slopes)
        changes = structural_changes(self.placed, at)
        power, s = POWER[there.data.quantity], there.s_at(values)
        model = excited(at, there.system.matrices(values), s, power, there.end_at(values), changes[:2])
        block = structural(self.placed, at, model, changes)
        h, gradient = there.gradient(values, free)
        every = np.concatenate([gradient, there.read(block.slopes, values)], axis=3)
        numbers = np.concatenate([free, len(there.system.parameters) + block.numbers])
        if self.short is not None:
            return *self.short.compared(h, every), numbers
        outputs, inputs = there.pairs
        residual = (there.paired(h) - there.measured) / there.sigma
        slopes_over_noise = np.asarray(every[:, outputs, inputs] / there.sigma[..., None], dtype=complex)
        return *real_rows(residual, slopes_over_noise), numbers


class LinksObjective(ProductObjective):
    """As `PosteriorObjective` of FRF least squares, with all errors but those of links held at nothing, and
    noise that counts for `softness` times as much, with what sensors and impacts may be off by.

    Of linear systems whose uncertainty is stated (`of_links`).
    """

    def __init__(self, targets: Targets, softness: float) -> None:
        self._sets = [_set(target, len(targets.nuisances), softness) for target in targets.frf]
        self.errors = np.array(targets.nuisances)
        self._count = sum(2 * target.sigma.size for target in targets.frf)

    def costs(self, candidates: Array) -> Array:
        """Of a population (m, unknowns)."""
        own, errors = self._split(candidates)
        off = self._inertia(errors)[0]
        with np.errstate(all="ignore"):  # a candidate whose model has no solution costs infinity
            squares = sum(one.squares(own, off) for one in self._sets)
        total = squares + np.sum(errors**2, axis=1)
        return np.asarray(np.sqrt(np.where(np.isfinite(total), total, np.inf) / self._count))

    def product(self, values: Array, free: Index) -> Array:
        """Of the data, then of the errors."""
        own, errors = self._split(values[None])
        off, slopes = (part[0] for part in self._inertia(errors))
        product = np.zeros((len(free) + 1,) * 2)
        column = {number: position for position, number in enumerate(free.tolist())}
        with np.errstate(all="ignore"):
            for one in self._sets:
                residual, derivatives, numbers = one.rows(own[0], free[free < own.shape[1]], off, slopes)
                known = [n for n, number in enumerate(numbers.tolist()) if number in column]
                places = [*(column[int(numbers[n])] for n in known), len(free)]
                rows = np.column_stack([derivatives[:, known], residual])
                product[np.ix_(places, places)] += rows.T @ rows
        add_errors(product, values, free, self.errors)
        return product

    def _split(self, values: Array) -> tuple[Array, Array]:
        size = values.shape[1] - len(self.errors)
        return values[:, :size], values[:, size:]

    def _inertia(self, errors: Array) -> tuple[Array, Array]:
        """(m, links, 10) off what was told, and slopes (m, links, 10, 10), at errors (m, nuisances)."""
        placed = self._sets[0].placed
        links, changes = placed.basis.links, placed.links.at(errors)
        found, slopes = moments(links * len(errors), changes.reshape(-1, changes.shape[-1]))
        found, slopes = found.reshape(changes.shape), slopes.reshape(*changes.shape, -1)
        return found - placed.basis.told, slopes


def of_links(targets: Targets) -> bool:
    """Whether the objective serves such data."""
    frf = targets.frf
    return bool(frf) and all(one.nuisances is not None and one.simulated is None for one in frf)


def _set(target: FrfTarget, errors: int, softness: float) -> _Set:
    assert target.nuisances is not None
    exact = Slot(np.zeros(0, dtype=int), np.zeros(0))
    basis = replace(target.nuisances.basis, geometry=())
    placed = replace(target.nuisances, basis=basis, geometry=exact)
    assert target.noise is not None
    noise = np.sqrt((softness * target.noise) ** 2 + _by_instruments(target, placed))
    plain = replace(target, noise=noise, nuisances=None)
    short = compressed_frfs(plain)
    out = target.out if short is None else short.target.out
    told = replace(state(placed, np.zeros(errors)), out=out, force=target.force)
    return _Set(plain, short, placed, told)


def _by_instruments(target: FrfTarget, placed: Placed) -> Array:
    """(lines, outputs, inputs): variance of real or imaginary parts by gains, turned sensors and impacts.

    What a turn mixes in is taken from what was measured along the other axes of the same point.
    """
    outputs, inputs = placed.outputs.of(np.arange(len(target.data.outputs))), placed.inputs
    squares = np.where(target.data.measured, np.abs(target.data.frf) ** 2, 0.0)
    own = placed.gains.std[: len(outputs.point)] ** 2
    turned = np.mean(placed.rotations.std**2, axis=1)[outputs.point]
    struck = np.sum(placed.impacts.std**2, axis=1) / 2
    total = own[:, None] * squares
    total += turned[:, None] * np.einsum("ab,lbi->lai", _others(outputs), squares)
    total += struck * np.einsum("ab,lob->loa", _others(inputs), squares)
    return np.asarray(0.5 * total, dtype=float)


def _others(ends: Ends) -> Array:
    """(c, c): one where another channel is at the same point along another axis."""
    same = (ends.point[:, None] == ends.point) & (ends.axis[:, None] // 3 == ends.axis // 3)
    return np.asarray(same & (ends.axis[:, None] != ends.axis), dtype=float)


def _heavier(target: FrfTarget, mass: Array, stiffness: Array) -> FrfTarget:
    """The target with more mass and stiffness, (..., n, n)."""
    return replace(target, system=target.system.with_more(mass, stiffness))
