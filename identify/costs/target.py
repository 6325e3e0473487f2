"""Measured data side by side with the model that predicts it: what a cost is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.modal_table import ModalTable
from identify.model.frf import frf, frf_and_gradient
from identify.model.system import System
from identify.robot.points import Point

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_CHUNK = 100_000
"""Complex numbers worked on at a time for a population: what stays in a processor's cache."""


def channel_rows(system: System, points: Mapping[int, Point], channels: tuple[Channel, ...], where: str) -> Array:
    """(channels, n): motion of each channel per released coordinate; a channel without a point is an InputError."""
    rows = []
    for channel in channels:
        if channel.node not in points:
            raise InputError(where, f"channel {channel} has no point", "a node of the points file", "add it there or leave the channel out")
        point = points[channel.node]
        motion = system.jacobian(point.link, point.position, where)
        turned = np.concatenate([point.axes @ motion[:3], point.axes @ motion[3:]])
        rows.append(channel.sign * turned[channel.axis])
    return np.array(rows)


@dataclass(frozen=True, eq=False)
class FrfTarget:
    """One measured FRF set and its prediction; noise (lines, outputs, inputs) is the standard deviation of real or imaginary part, or None.

    out (outputs, n), force (n, inputs): the channels in the system's coordinates.
    """

    name: str
    data: FrfSet
    system: System
    out: Array
    force: Array
    noise: Array | None = None

    @property
    def pairs(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Output and input numbers of the measured FRFs."""
        outputs, inputs = np.nonzero(self.data.measured)
        return outputs, inputs

    @property
    def moved(self) -> NDArray[np.intp]:
        """Which pairs the model moves at all: a point on a rigid base has no FRF to compare on a logarithmic scale."""
        outputs, inputs = self.pairs
        return np.flatnonzero(np.any(self.out, axis=1)[outputs] & np.any(self.force, axis=0)[inputs])

    @cached_property
    def measured(self) -> Complex:
        """(lines, pairs): the measured FRFs."""
        outputs, inputs = self.pairs
        return np.asarray(self.data.frf[:, outputs, inputs])

    @cached_property
    def sigma(self) -> Array:
        """(lines, pairs): the noise of the measured FRFs; an InputError where it is not known."""
        if self.noise is None:
            fix = "give `noise: {relative: 0.02}` in the measurement, or choose another cost"
            raise InputError(self.name, "its noise is not known: no coherence and no repeats", "coherence with `averages`, or `noise`", fix)
        outputs, inputs = self.pairs
        return np.asarray(self.noise[:, outputs, inputs])

    def predict(self, values: Array) -> Complex:
        """(..., lines, outputs, inputs) at parameter values (..., parameters)."""
        mass, damping, stiffness = self.system.matrices(values)
        return frf(mass, damping, stiffness, self.data.s, self.out, self.force, POWER[self.data.quantity])

    def predict_pairs(self, values: Array) -> Complex:
        """(..., lines, pairs) at parameter values (..., parameters)."""
        outputs, inputs = self.pairs
        return np.asarray(self.predict(values)[..., outputs, inputs])

    def gradient(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """(lines, outputs, inputs) and its derivatives (lines, outputs, inputs, free) at values (parameters,)."""
        power = POWER[self.data.quantity]
        return frf_and_gradient(self.system.matrices(values), self.system.factors, self.data.s, self.out, self.force, power, free)

    def gradient_pairs(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """(lines, pairs) and its derivatives (lines, pairs, free) at values (parameters,)."""
        outputs, inputs = self.pairs
        h, gradient = self.gradient(values, free)
        return h[:, outputs, inputs], gradient[:, outputs, inputs]

    def chunks(self, candidates: int) -> list[slice]:
        """Slices of a population small enough to predict at once."""
        size = self.data.frf.size + len(self.data.s) * len(self.system.coordinates)
        step = max(1, _CHUNK // max(1, size))
        return [slice(first, first + step) for first in range(0, candidates, step)]


@dataclass(frozen=True, eq=False)
class ModalTarget:
    """One measured modal table and the system whose modes it lists; out (channels, n) where the table has shapes."""

    name: str
    data: ModalTable
    system: System
    out: Array | None = None


@dataclass(frozen=True)
class Targets:
    """All data that a cost compares."""

    frf: tuple[FrfTarget, ...] = ()
    modal: tuple[ModalTarget, ...] = ()
