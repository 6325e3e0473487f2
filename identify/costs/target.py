"""Measured data side by side with the model that predicts it: what a cost is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.effects.measurement import MeasurementEffect, Reading
from identify.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.modal_table import ModalTable
from identify.model.frf import frf, frf_and_gradient, frf_slope
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

    out (channels, n), force (n, inputs): the channels in the system's coordinates; those of out are the set's outputs, then what
    readings need besides.  readings: what effects of the measurement do to the FRFs, with the numbers of their parameters.
    record: length of the records behind the FRFs, s, where the response may not have died out (`identify.model.record`), or None.
    """

    name: str
    data: FrfSet
    system: System
    out: Array
    force: Array
    noise: Array | None = None
    readings: tuple[tuple[Reading, NDArray[np.intp]], ...] = ()
    record: float | None = None

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
        h = frf(*self.system.matrices(values), self._s(values), self.out, self.force, POWER[self.data.quantity], self._ends)
        for reading, numbers in self.readings:
            h = reading.apply(h, values[..., numbers], self.data.s)
        return h[..., : len(self.data.outputs), :]

    def _s(self, values: Array) -> Complex:
        """(lines,) or (..., lines): where the model is evaluated; elsewhere than stated where an effect corrects the window's decay."""
        return self.data.s + (values @ self._decay)[..., None] if np.any(self._decay) else self.data.s

    @property
    def _ends(self) -> float | None:
        """The record, but not with hysteretic damping, which has no free motion in time."""
        return None if np.any(self.system.terms["hysteretic"]) else self.record

    @cached_property
    def _decay(self) -> Array:
        """(parameters,): what each parameter adds to the decay of the window."""
        decay = np.zeros(len(self.system.terms["stiffness"]))
        for reading, numbers in self.readings:
            decay[numbers] += reading.decay()
        return decay

    def predict_pairs(self, values: Array) -> Complex:
        """(..., lines, pairs) at parameter values (..., parameters)."""
        outputs, inputs = self.pairs
        return np.asarray(self.predict(values)[..., outputs, inputs])

    def gradient(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """(lines, outputs, inputs) and its derivatives (lines, outputs, inputs, free) at values (parameters,)."""
        matrices, at = self.system.matrices(values), (self._s(values), self.out, self.force, POWER[self.data.quantity])
        h, gradient = frf_and_gradient(matrices, self.system.factors, *at, free, self._ends)
        if np.any(self._decay[free]):
            gradient = gradient + frf_slope(matrices, *at, self._ends)[..., None] * self._decay[free]
        for reading, numbers in self.readings:
            own = values[numbers]
            slopes = reading.slopes(h, own, self.data.s)
            flat = gradient.reshape(*gradient.shape[:2], -1)
            gradient = reading.apply(flat, own, self.data.s).reshape(gradient.shape) + slopes @ (numbers[:, None] == free)
            h = reading.apply(h, own, self.data.s)
        outputs = len(self.data.outputs)
        return h[:, :outputs], gradient[:, :outputs]

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


def frf_target(name: str, data: FrfSet, system: System, points: Mapping[int, Point], noise: Array | None = None) -> FrfTarget:
    """A set with its prediction by a system, through the readings of the system's effects; InputError for a channel without a point."""
    measuring = [(effect, numbers) for effect, numbers in system.effects if isinstance(effect, MeasurementEffect)]
    channels = data.outputs
    for effect, _ in measuring:
        channels += effect.needed(channels, points)
    readings = tuple((effect.reading(channels, points), numbers) for effect, numbers in measuring)
    out, force = channel_rows(system, points, channels, name), channel_rows(system, points, data.inputs, name)
    return FrfTarget(name, data, system, out, force.T, noise, readings, _record(data))


def _record(data: FrfSet) -> float | None:
    """One over the spacing of lines where an exponential window says that the FRFs are those of blows."""
    if data.window_decay_per_s <= 0 or len(data.frequency_hz) < 2:
        return None
    return float(1 / np.diff(data.frequency_hz).min())


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
