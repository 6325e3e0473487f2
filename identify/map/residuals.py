"""What a fitted model leaves of the measured postures of its result: of natural frequencies, of damping, and
of the peaks of direct FRFs at the tool.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex
from identify.map.process import Seen
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER
from identify.model.modes import ComplexModes, complex_modes
from identify.model.system import System
from identify.results.fit import FitResult, FrfComparison, MeasurementResult, ModePairs
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel

QUANTITIES = ("frequency", "damping", "peak")
_AXES = 3


@dataclass(frozen=True)
class Source:
    """A result with its model, and the point that is looked at, None: not measured; number: of the robot."""

    result: FitResult
    model: FittedModel
    point: Point | None
    number: int


@dataclass(frozen=True)
class Observed:
    """n measured numbers of one quantity: in which measurement, of which mode (from 1) or axis (1 to 3), as
    measured and by the model, and where they were seen.
    """

    measurement: tuple[str, ...]
    item: tuple[int, ...]
    measured: Array
    model: Array
    seen: Seen

    @property
    def error(self) -> Array:
        """(n,): ln of measured over model."""
        return np.asarray(np.log(self.measured / self.model))


def coordinates_of(models: Sequence[FittedModel]) -> tuple[str, ...]:
    """Names of all coordinates of some models, by which shapes of their modes are compared."""
    names = (name for model in models for name in model.system(model.posture).coordinates)
    return tuple(dict.fromkeys(names))


def shapes_of(
    system: System, stiffness: NDArray[np.generic], modes: ComplexModes, names: Sequence[str]
) -> Complex:
    """(m, names): shapes of modes scaled by the roots of the own stiffness of each coordinate, of unit
    length, so that their squares are shares of strain energy.
    """
    scale = np.sqrt(np.abs(np.diag(stiffness)))
    found = np.zeros((len(modes.shapes), len(names)), dtype=complex)
    found[:, [names.index(name) for name in system.coordinates]] = modes.shapes * scale
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def observed(sources: Sequence[Source], names: Sequence[str]) -> dict[str, Observed]:
    """By quantity, all that was measured on some robots; quantities of which nothing was are left out."""
    rows: dict[str, list[_Row]] = {quantity: [] for quantity in QUANTITIES}
    for source in sources:
        for name, one in source.result.measurements.items():
            if name in source.model.detached:
                continue
            for row in _rows(source, name, one, names):
                rows[row.quantity].append(row)
    return {quantity: _observed(some) for quantity, some in rows.items() if some}


@dataclass(frozen=True)
class _Row:
    quantity: str
    measurement: str
    item: int
    measured: float
    model: float
    posture: Array
    shape: Complex
    robot: int


def _observed(rows: Sequence[_Row]) -> Observed:
    seen = Seen(
        np.array([row.posture for row in rows]),
        np.array([row.shape for row in rows]),
        np.array([row.robot for row in rows]),
    )
    return Observed(
        tuple(row.measurement for row in rows),
        tuple(row.item for row in rows),
        np.array([row.measured for row in rows]),
        np.array([row.model for row in rows]),
        seen,
    )


def _rows(source: Source, name: str, one: MeasurementResult, names: Sequence[str]) -> Iterator[_Row]:
    """Of one measurement, those that are positive numbers."""
    posture = np.deg2rad(one.posture_deg)
    system = source.model.system(posture, source.model.driven.get(name, frozenset()))
    found: list[tuple[str, int, float, float, Complex]] = []
    if one.pairs is not None:
        found += _of_modes(source.model, system, one.pairs, names)
    if one.frf is not None and source.point is not None:
        found += _of_peaks(source.point, system, one.frf)
    for quantity, item, measured, model, shape in found:
        if measured > 0 and model > 0:  # not NaN, and no mode without damping
            yield _Row(quantity, name, item, measured, model, posture, shape, source.number)


def _of_modes(
    model: FittedModel, system: System, pairs: ModePairs, names: Sequence[str]
) -> Iterator[tuple[str, int, float, float, Complex]]:
    matrices = system.matrices(model.values)
    modes = complex_modes(*matrices)
    shapes = shapes_of(system, matrices[2], modes, names)
    for measured, number in zip(pairs.measured, pairs.model, strict=True):
        if number >= len(shapes):
            continue
        for quantity, of, by in (
            ("frequency", pairs.measured_frequency_hz, modes.frequency_hz),
            ("damping", pairs.measured_damping_ratio, modes.damping_ratio),
        ):
            yield quantity, int(number) + 1, float(of[measured]), float(by[number]), shapes[number]


def _of_peaks(
    point: Point, system: System, frf: FrfComparison
) -> Iterator[tuple[str, int, float, float, Complex]]:
    """Of the direct receptances of the point, along the directions of its channels."""
    power = POWER.get(frf.quantity)
    if power is None:
        return
    size = np.abs(frf.window_decay_per_s + 2j * np.pi * frf.frequency_hz) ** power
    axes = point.axes @ system.site.engine.axes(point.link).T
    for pair, (output, force) in enumerate(zip(frf.output, frf.input, strict=True)):
        channel = Channel.parse(output)
        if channel.node != point.node or channel.place != Channel.parse(force).place:
            continue
        if not 1 <= abs(channel.direction) <= _AXES:
            continue
        measured, fitted = (np.abs(one[:, pair]) / size for one in (frf.measured, frf.fitted))
        if np.isfinite(measured).any():
            item, direction = channel.axis, axes[channel.axis].astype(complex)
            yield "peak", item + 1, float(np.nanmax(measured)), float(np.max(fitted)), direction
