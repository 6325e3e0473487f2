"""Channels that agree with the fitted model once their sign is reversed or two of them are exchanged.

A wrong sign off the drive point breaks no law of physics, so only a model can see it.  With outputs H_i
measured and h_k predicted, each over its own noise, all sums |H_i - s h_k|^2 over lines and inputs follow
from two products of matrices.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.text import listed
from identify.measured.channel import Channel
from identify.vibration.costs.target import FrfTarget

_LEFT = 0.25
"""A fault is reported where at most this share of the channels' squared residual is left with it."""
_ALIKE = 0.5
"""And of their squared FRFs: what does not resemble the model either way has another fault."""


@dataclass(frozen=True)
class Fault:
    """What would make channels agree: one with its sign reversed, or two exchanged; left: share of the
    squared residual that remains.
    """

    channels: tuple[Channel, ...]
    left: float

    def sentence(self, sets: Iterable[str]) -> str:
        """What a report says, with the names of the sets that show it."""
        names = " and ".join(map(str, self.channels))
        how = "if exchanged" if len(self.channels) == 2 else "with its sign reversed"
        where = listed(list(sets))
        return f"{where}: channel {names} would agree with the model {how}: check the cables and settings"


def fault_notes(targets: Iterable[FrfTarget], values: Array) -> list[str]:
    """Sentences about the channels of these sets that have such a fault at parameter values (parameters,)."""
    found: dict[tuple[Channel, ...], list[tuple[str, Fault]]] = defaultdict(list)
    for target in targets:
        for fault in channel_faults(target, values):
            found[fault.channels].append((target.name, fault))
    return [rows[0][1].sentence(name for name, _ in rows) for rows in found.values()]


def channel_faults(target: FrfTarget, values: Array) -> Iterator[Fault]:
    """The faults of one set: reversed signs first, then exchanged pairs of channels of one point or one
    axis.
    """
    plain, crossed = _residuals(target, target.predict(values))
    own, reversed_ = np.diag(plain), np.diag(crossed)
    size = (own + reversed_) / 2  # |H_i|^2 + |h_i|^2
    outputs, named = target.data.outputs, set()
    reversed_alone = (own > 0) & (reversed_ <= _LEFT * own) & (reversed_ <= _ALIKE * size)
    for i in np.flatnonzero(reversed_alone).tolist():
        named.add(i)
        yield Fault((outputs[i],), float(reversed_[i] / own[i]))
    best, moving = np.minimum(plain, crossed), own > 0
    better = moving[:, None] & moving & (best <= _LEFT * own[:, None])
    for i, k in np.argwhere(np.triu(better & better.T, 1)).tolist():
        related = outputs[i].node == outputs[k].node or abs(outputs[i].direction) == abs(outputs[k].direction)
        alike = best[i, k] + best[k, i] <= _ALIKE * (size[i] + size[k])
        if related and alike and not named & {i, k}:
            named |= {i, k}
            yield Fault((outputs[i], outputs[k]), float((best[i, k] + best[k, i]) / (own[i] + own[k])))


def _residuals(target: FrfTarget, predicted: np.ndarray) -> tuple[Array, Array]:
    """Sums of |H_i - h_k|^2 and |H_i + h_k|^2 over lines and inputs in units of the noise of i, (outputs,
    outputs).
    """
    data = target.data
    known = np.broadcast_to(data.measured, data.frf.shape)
    level = np.sqrt(np.mean(np.abs(np.where(known, data.frf, 0.0)) ** 2, axis=(0, 2)))
    noise = np.broadcast_to(level[:, None], data.frf.shape) if target.noise is None else target.noise
    weight = np.divide(1.0, noise, out=np.zeros(data.frf.shape), where=known & (noise > 0))
    flat = [
        np.moveaxis(array, 1, 0).reshape(len(data.outputs), -1) for array in (data.frf, weight, predicted)
    ]
    measured, w, model = np.where(flat[1] > 0, flat[0], 0.0), flat[1], flat[2]
    sizes = np.sum(np.abs(measured * w) ** 2, axis=1)[:, None] + w**2 @ (np.abs(model) ** 2).T
    product = 2 * ((np.conj(measured) * w**2) @ model.T).real
    return sizes - product, sizes + product
