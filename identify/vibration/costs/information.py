"""J'J, J'r and r'r of FRF residuals in units of noise, assembled in blocks where sensors' own nuisances
touch few channels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.threads import each
from identify.vibration.costs.inside import Inside, inside_of
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.blocks import chosen
from identify.vibration.nuisances.sensitivity import Block

Made = TypeVar("Made")
_SLOPE_BYTES, _MOST_BYTES = 64, 200_000_000
"""Of one slope, complex, on the way and in real and imaginary parts; of those of a part of a set."""


@dataclass(frozen=True)
class Information:
    """product (free + 1, free + 1): [J r]'[J r] over real and imaginary parts; count: real numbers
    measured.
    """

    product: Array
    count: int

    def on_scale(self, slope: Array) -> tuple[Array, Array]:
        """J'J (free, free) and J'r (free,) by x, where slope (free,) is d value / d x."""
        return self.product[:-1, :-1] * np.outer(slope, slope), self.product[:-1, -1] * slope


Residuals = Callable[[FrfTarget, Complex], tuple[Complex, Complex | Array]]
"""Of a set and its prediction (lines, outputs, inputs): residuals, and their derivatives with respect to
it.
"""


def over_noise(target: FrfTarget, h: Complex) -> tuple[Complex, Array]:
    """Residuals in units of noise, zero where nothing was measured."""
    weight = weights(target)
    return (h - np.where(weight > 0, target.data.frf, h)) * weight, weight


def information(targets: Sequence[FrfTarget], values: Array, free: Index) -> Information:
    """The information of FRF sets at values (unknowns,) about the free unknowns."""

    def own(target: FrfTarget) -> Array:
        return rows_of(target, values, free, over_noise).product(free)

    parts = by_lines(targets, len(free))
    product = sum(each_set(own, parts), start=np.zeros((len(free) + 1, len(free) + 1)))
    return Information(product, sum(2 * target.sigma.size for target in targets))


def by_lines(targets: Sequence[FrfTarget], free: int) -> list[FrfTarget]:
    """The sets in parts of so few lines that the slopes of each, by so many unknowns, take little memory:
    sums over lines do not mind.  Sets whose impacts are simulated stay whole.
    """
    found = list[FrfTarget]()
    for target in targets:
        count, outputs, inputs = target.data.frf.shape
        parts = -(-count * outputs * inputs * (free + 1) * _SLOPE_BYTES // _MOST_BYTES)
        if target.simulated is not None or parts < 2:
            found.append(target)
            continue
        for lines in np.array_split(np.arange(count), parts):
            found.append(target.at_lines(np.isin(np.arange(count), lines)))
    return found


def each_set(work: Callable[[FrfTarget], Made], targets: Sequence[FrfTarget]) -> list[Made]:
    """What `work` makes of each set, in threads, unless they share a simulator of impacts; numbers that are
    not finite are no error.
    """

    def quietly(target: FrfTarget) -> Made:
        with np.errstate(all="ignore"):  # of this thread
            return work(target)

    if any(target.simulated is not None for target in targets):
        return [quietly(target) for target in targets]
    return each(quietly, targets)


def bend(told: Sequence[tuple[FrfTarget, Rows]], residuals: Residuals, sides: Array, free: Index) -> Array:
    """J'r'' (free,) of sets and what they say somewhere: how their residuals bend towards sides (2, unknowns)
    of it, one as far away as the other.
    """
    rows = dict(told)

    def own(target: FrfTarget) -> Array:
        one, other = (residuals(target, h)[0] for h in target.predict(sides))
        return rows[target].pull(one + other - 2 * rows[target].residual, free)

    return np.asarray(sum(each_set(own, list(rows)), start=np.zeros(len(free))))


def information_by_force(targets: Sequence[FrfTarget], values: Array, free: Index) -> list[Information]:
    """The same of each force of each set on its own."""
    found = []
    for target in targets:
        rows, inputs = rows_of(target, values, free, over_noise), target.pairs[1]
        for force in np.unique(inputs):
            count = 2 * len(target.sigma) * int(np.sum(inputs == force))
            found.append(Information(rows.of_force(force).product(free), count))
    return found


@dataclass(frozen=True)
class Rows:
    """What a set says: residual and weight (lines, outputs, inputs), slopes (..., parameters), blocks of
    nuisances that touch all channels, and of those that touch few; inside: what it says by way of fewer
    coordinates, which is then neither among the slopes nor the blocks.
    """

    residual: Complex
    weight: Complex | Array
    slopes: Complex
    every: list[Block]
    own: list[Block]
    inside: Inside | None = None

    def of_force(self, force: int) -> Rows:
        """Those of one input."""

        def alone(blocks: list[Block]) -> list[Block]:
            return [replace(block, slopes=block.slopes[:, :, [force]]) for block in blocks]

        one = self.residual[:, :, [force]], self.weight[:, :, [force]], self.slopes[:, :, [force]]
        inside = None if self.inside is None else self.inside.of_force(force)
        return Rows(*one, alone(self.every), alone(self.own), inside)

    @property
    def nbytes(self) -> int:
        """How much memory they take."""
        inside = 0 if self.inside is None else self.inside.slopes.nbytes
        blocks = (*self.every, *self.own)
        return inside + self.slopes.nbytes + sum(block.slopes.nbytes for block in blocks)

    def pull(self, residual: Complex, free: Index) -> Array:
        """(..., free): J'r with other residuals r (..., lines, outputs, inputs)."""
        column = _columns(free)
        load = np.asarray(np.conj(residual) * self.weight, dtype=complex)
        pull = np.zeros((*residual.shape[:-3], len(free)))
        pull[..., : self.slopes.shape[-1]] = _contracted(load, self.slopes)
        for block in (*self.every, *self.own):
            some = _contracted(load[..., block.channels, :], block.slopes)
            np.add.at(pull.T, _places(block.numbers, column), some.T)
        if self.inside is not None:
            pull[..., _places(self.inside.numbers, column)] += self.inside.pull(load)
        return pull

    def product(self, free: Index) -> Array:
        """[J r]'[J r] (free + 1, free + 1)."""
        column = _columns(free)
        parts = [self.slopes, *(block.slopes for block in self.every)]
        dense = side_by_side([*(part * self.weight[..., None] for part in parts), self.residual[..., None]])
        parameters = free[: self.slopes.shape[-1]].tolist()  # none, where they are looked at inside
        numbers = [*parameters, *(n for block in self.every for n in block.numbers.tolist())]
        places = np.array([*(column[number] for number in numbers), len(free)])
        product = np.zeros((len(free) + 1, len(free) + 1))
        np.add.at(product, np.ix_(places, places), gram(dense, dense))
        for block in self.own:
            left, at = _weighted(block, block.channels, self.weight), _places(block.numbers, column)
            cross = gram(left, dense[:, :, block.channels])
            np.add.at(product, np.ix_(at, places), cross)
            np.add.at(product, np.ix_(places, at), cross.T)
            np.add.at(product, np.ix_(at, at), gram(left, left))
        for a, b in _overlapping(self.own, self.residual.shape[1]):
            _add_shared(product, (a, b), np.intersect1d(a.channels, b.channels), self.weight, column)
        if self.inside is not None:
            self._add_inside(self.inside, product, column)
        return product

    def _add_inside(self, inside: Inside, product: Array, column: dict[int, int]) -> None:
        """Add what it says by way of its coordinates, beside all else."""
        blocks, every = (*self.every, *self.own), np.arange(self.residual.shape[1])
        power, own = np.abs(self.weight) ** 2, _places(inside.numbers, column)
        score = (np.conj(self.weight) * self.residual)[..., None]
        beside = [(every, score)]
        beside += [(one.channels, power[:, one.channels, :, None] * one.slopes) for one in blocks]
        within, crosses = inside.products(self.weight, beside)
        product[np.ix_(own, own)] += (within + within.T) / 2
        places = [np.array([len(product) - 1]), *(_places(one.numbers, column) for one in blocks)]
        for at, cross in zip(places, crosses, strict=True):
            np.add.at(product, np.ix_(own, at), cross)
            np.add.at(product, np.ix_(at, own), cross.T)


def rows_of(target: FrfTarget, values: Array, free: Index, residuals: Residuals) -> Rows:
    """Residuals of a set and their derivatives at values (unknowns,)."""
    inside = inside_of(target, values, free)
    if inside is not None:
        own, blocks = inside
        residual, weight = residuals(target, own.seen @ own.h)
        none = np.zeros((*residual.shape, 0), dtype=complex)
        return Rows(residual, weight, none, *_by_reach(blocks, residual.shape[1]), own)
    h, slopes = target.parameter_gradient(values, free)
    residual, weight = residuals(target, h)
    every_block = target.blocks(values) if np.any(free >= len(target.system.parameters)) else ()
    blocks = [block for one in every_block if (block := chosen(one, free)) is not None]
    return Rows(residual, weight, slopes, *_by_reach(blocks, h.shape[1]))


def _by_reach(blocks: Sequence[Block], channels: int) -> tuple[list[Block], list[Block]]:
    """Those that touch all of so many channels, and the others."""
    every = [block for block in blocks if len(block.channels) == channels]
    return every, [block for block in blocks if len(block.channels) < channels]


def _overlapping(blocks: Sequence[Block], channels: int) -> list[tuple[Block, Block]]:
    """Pairs of blocks with channels in common, of so many."""
    has = np.zeros((len(blocks), channels))
    for row, block in zip(has, blocks, strict=True):
        row[block.channels] = 1.0
    pairs = np.argwhere(np.triu(has @ has.T, 1) > 0)
    return [(blocks[a], blocks[b]) for a, b in pairs]


def _add_shared(
    product: Array, pair: tuple[Block, Block], shared: Index, weight: Complex | Array, column: dict[int, int]
) -> None:
    """Sensors whose channels a reading mixes."""
    cross = gram(*(_weighted(one, shared, weight) for one in pair))
    a, b = (_places(one.numbers, column) for one in pair)
    np.add.at(product, np.ix_(a, b), cross)
    np.add.at(product, np.ix_(b, a), cross.T)


def _weighted(block: Block, channels: Index, weight: Complex | Array) -> Array:
    """Weighted slopes of some channels of a block."""
    slopes = block.slopes[:, np.searchsorted(block.channels, channels)]
    return side_by_side([slopes * weight[:, channels, :, None]])


def _contracted(load: Complex, slopes: Complex) -> Array:
    """(..., k): real part of the sums of loads (..., lines, channels, inputs) times slopes (lines, channels,
    inputs, k).
    """
    flat = load.reshape(*load.shape[:-3], -1)
    return np.asarray((flat @ slopes.reshape(flat.shape[-1], -1 if slopes.size else 0)).real)


def _columns(free: Index) -> dict[int, int]:
    """The column of each free unknown, by its number."""
    return {number: position for position, number in enumerate(free.tolist())}


def _places(numbers: Index, column: dict[int, int]) -> Index:
    """The columns of unknowns, by their numbers."""
    return np.array([column[number] for number in numbers.tolist()], dtype=int)


def weights(target: FrfTarget) -> Array:
    """(lines, outputs, inputs): one over the noise, zero where nothing was measured."""
    weight = np.zeros(target.data.frf.shape)
    outputs, inputs = target.pairs
    weight[:, outputs, inputs] = 1.0 / target.sigma
    return weight


def side_by_side(parts: Sequence[Complex]) -> Array:
    """(2, lines, outputs, inputs, columns): real and imaginary parts of arrays (lines, outputs, inputs,
    ...).
    """
    result, first = np.empty((2, *parts[0].shape[:-1], sum(part.shape[-1] for part in parts))), 0
    for part in parts:
        last = first + part.shape[-1]
        result[0, ..., first:last], result[1, ..., first:last] = part.real, part.imag
        first = last
    return result


def gram(a: Array, b: Array) -> Array:
    """Sums of products over all but the last axes, (p, q), of arrays (..., p) and (..., q)."""
    return np.asarray(a.reshape(-1, a.shape[-1]).T @ b.reshape(-1, b.shape[-1]))
