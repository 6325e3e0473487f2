"""Derivatives of what a measurement predicts with respect to its nuisances, as the instruments record it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.model.compliant import Response
from identify.model.effects.measurement import Reading
from identify.model.frf import motion_and_transfer
from identify.model.truncation import TruncationCorrection
from identify.vibration.nuisances.placed import Placed, State
from identify.vibration.nuisances.sensitivity import (
    Block,
    Excited,
    Matrices,
    excited,
    impacts,
    sensors,
    shapes,
    structural,
    structural_changes,
)

Record = Callable[[Complex], Complex]


def nuisance_blocks(
    placed: Placed,
    at: State,
    matrices: Matrices,
    s: Complex,
    power: int,
    end: TruncationCorrection | Response | float | None,
    *,
    inside: bool = False,
) -> list[Block]:
    """Of all nuisances but the delay, for what the model itself does; end: the length of the records, or
    what is known of the motion after them, which is then taken as it is, or the whole response of a model
    with springs given by compliance.  inside: of a linear model, in its coordinates as far as they tell, and
    what sensors read besides.
    """
    mass, stiffness, numbers = structural_changes(placed, at)
    if isinstance(end, Response):
        motion = [end.motion(k) for k in range(3)]
        model = Excited(matrices, s, power, motion, at.out, end.to_out, None, at.out @ motion[power])
    elif end is None or isinstance(end, float):
        model = excited(at, matrices, s, power, end, (mass, stiffness), inside=inside)
    else:
        motion, transfer = motion_and_transfer(end, matrices, s, at.out, at.force)
        model = Excited(matrices, s, power, motion, at.out, transfer, end, at.out @ motion[power])
    dense = structural(placed, at, model, (mass, stiffness, numbers))
    return [*dense, *shapes(placed, at, model), *impacts(placed, at, model), *sensors(placed, at, model)]


def recorded(
    block: Block, readings: Sequence[tuple[Reading, Array]], s: Complex, channels: int, outputs: int
) -> Block:
    """A block as effects of the measurement, each with its values, record it: of `channels` that they know,
    the first `outputs` are kept; where readings mix channels, it has more of them.
    """
    slopes, own = block.slopes, block.channels
    if readings:
        wide = np.zeros((len(s), channels, *slopes.shape[2:]), dtype=complex)
        wide[:, own] = slopes
        flat = wide.reshape(len(s), channels, -1)
        for reading, values in readings:
            flat = reading.apply(flat, values, s)
        slopes = flat.reshape(wide.shape)
        own = np.flatnonzero(np.any(slopes != 0, axis=(0, 2, 3)))
        slopes = slopes[:, own]
    kept = own < outputs
    if not readings and kept.all():
        return block
    return Block(own[kept], block.numbers, slopes[:, kept])


def chosen(block: Block, numbers: Index) -> Block | None:
    """The part of a block that belongs to some nuisances; None where nothing does."""
    known = np.isin(block.numbers, numbers)
    if not known.any() or not len(block.channels):
        return None
    if known.all():
        return block
    return replace(block, numbers=block.numbers[known], slopes=block.slopes[..., known])
