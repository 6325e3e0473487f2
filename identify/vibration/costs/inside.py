"""What FRFs say by way of the model's coordinates, which are fewer than the sensors.

With S (outputs, n) and weights w, derivatives w S D of residuals by way of the coordinates have the products

    D' (S' |w|^2 S) D,   D' S' |w|^2 B,   D' S' w* r

with each other, with those of sensors' own, w B, and with residuals r: no derivative by way of the
coordinates is made for every sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Index, real_product
from identify.measured.frf_set import POWER
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.blocks import chosen, nuisance_blocks
from identify.vibration.nuisances.placed import Placed, State, state
from identify.vibration.nuisances.sensitivity import Block


@dataclass(frozen=True)
class Inside:
    """seen (outputs, n): S; h (lines, n, inputs): motion of the coordinates; slopes (lines, n, inputs, k):
    its derivatives by unknowns (k,), their numbers.
    """

    seen: Array
    h: Complex
    slopes: Complex
    numbers: Index

    def of_force(self, force: int) -> Inside:
        """That of one input."""
        return replace(self, h=self.h[:, :, [force]], slopes=self.slopes[:, :, [force]])

    def pull(self, load: Complex) -> Array:
        """(..., k): of loads (..., lines, outputs, inputs) on the outputs."""
        flat = real_product(self.seen.T, load).reshape(*load.shape[:-3], -1)
        return np.asarray((flat @ self.slopes.reshape(flat.shape[-1], len(self.numbers))).real)

    def products(
        self, weight: Complex | Array, beside: Sequence[tuple[Index, Complex]]
    ) -> tuple[Array, list[Array]]:
        """(k, k) with each other, and (k, p) with each of some columns (lines, channels, inputs, p) of the
        channels (their numbers), in units of noise times the conjugate of the weight.
        """
        size, lines = self.seen.shape[1], len(self.h)
        led = [
            real_product(self.seen[channels].T, columns.reshape(*columns.shape[:2], -1)).reshape(
                lines, size, *columns.shape[2:]
            )
            for channels, columns in beside
        ]
        own, others = _rows(self.slopes), _rows(np.concatenate(led, axis=-1))
        pairs = (self.seen[:, :, None] * self.seen[:, None]).reshape(len(self.seen), -1)
        metric = np.swapaxes(np.abs(weight) ** 2, 1, 2) @ pairs
        within = metric.reshape(*own.shape[1:3], size, size) @ own
        flat = _flat(own).T
        ends = np.cumsum([columns.shape[-1] for _, columns in beside])[:-1]
        return flat @ _flat(within), np.split(flat @ _flat(others), ends, axis=1)


def _flat(rows: Array) -> Array:
    """(rows, k)."""
    return rows.reshape(int(np.prod(rows.shape[:-1])), rows.shape[-1])


def _rows(columns: Complex) -> Array:
    """(2, lines, inputs, n, k): real and imaginary parts of columns (lines, n, inputs, k)."""
    turned = np.swapaxes(columns, 1, 2)
    return np.array([turned.real, turned.imag])


def inside_of(target: FrfTarget, values: Array, free: Index) -> tuple[Inside, list[Block]] | None:
    """A set at values (unknowns,) inside its model, and what of the free unknowns sensors read besides; None
    where coordinates are not far fewer than outputs, or there is more than a linear model and its sensors.
    """
    parameters = len(target.system.parameters)
    if target.nuisances is None or not _far_fewer(target):
        return None
    own, of_parameters = values[:parameters], free[free < parameters]
    at = state(target.nuisances, values[parameters:])
    there = target.in_state(at)
    bare = replace(there, out=np.eye(there.out.shape[1]))
    h, slopes = target.late_gradient(bare, at.delay, own, of_parameters)
    s = there.s_at(own)
    late = np.exp(-at.delay * s)[:, None, None, None]
    errors = _blocks(target.nuisances, at, there, own)
    blocks = [replace(one, numbers=parameters + one.numbers, slopes=late * one.slopes) for one in errors]
    wanted = [one for block in blocks if (one := chosen(block, free)) is not None]
    inner = [(slopes, of_parameters), *((one.slopes, one.numbers) for one in wanted if one.inside)]
    delay = parameters + target.nuisances.delay.numbers
    if target.nuisances.delay.numbers >= 0 and delay in free:
        by_delay = -float(target.nuisances.delay.std) * (s[:, None, None] * h)[..., None]
        inner.append((by_delay, delay.reshape(1)))
    together, numbers = (np.concatenate(parts, axis=-1) for parts in zip(*inner, strict=True))
    seen = there.out[: len(target.data.outputs)]
    return Inside(seen, h, together, numbers), [one for one in wanted if not one.inside]


def _far_fewer(target: FrfTarget) -> bool:
    """Whether a linear model and its sensors are all there is, and coordinates are far fewer than outputs:
    with more of them the products of all with all take as long.
    """
    linear = target.plain and target.simulated is None and target.system.compliances is None
    return linear and 2 * target.out.shape[1] <= len(target.data.outputs)


def _blocks(placed: Placed, at: State, there: FrfTarget, values: Array) -> list[Block]:
    """Of all nuisances but the delay, by their numbers among them."""
    matrices, power = there.system.matrices(values), POWER[there.data.quantity]
    return nuisance_blocks(placed, at, matrices, there.s_at(values), power, there.end_at(values), inside=True)
