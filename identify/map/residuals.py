"""What a fitted model leaves of the measured postures of its result: of natural frequencies, of damping, and
of the peaks of direct FRFs at the tool; and how a fit can have moved these.

A model that lacks something is fitted by wrong parameters, which leave the less the fewer the postures: what
is left where it was fitted says little of what the model lacks.  So parameters count as broadly uncertain, by
a factor of e, in all directions that the fitted postures see: with the slopes S = U diag(v) V' there, errors
go with A = S V diag(v / sqrt(v^2 + v0^2)), v0 a fifth of the slope 1/2 of a frequency by the one stiffness
that makes it.
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
from identify.model.frf import frf_and_gradient
from identify.model.modes import ComplexModes, complex_modes, frequency_and_damping_gradient
from identify.model.system import System
from identify.results.fit import FitResult, FrfComparison, MeasurementResult, ModePairs
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel

QUANTITIES = ("frequency", "damping", "peak")
_AXES = 3
_LEAST_SLOPE = 0.1


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
    measured and by the model, and where they were seen.  moves (p, r): how the fit of the first robot can
    have moved its parameters.
    """

    measurement: tuple[str, ...]
    item: tuple[int, ...]
    measured: Array
    model: Array
    seen: Seen
    moves: Array

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
                rows[row.number.quantity].append(row)
    return {quantity: _observed(some, len(sources)) for quantity, some in rows.items() if some}


@dataclass(frozen=True)
class _Number:
    """One measured number with the model's, its shape, and the slope (p,) of its logarithm by parameters."""

    quantity: str
    item: int
    measured: float
    model: float
    shape: Complex
    slope: Array


@dataclass(frozen=True)
class _Row:
    """Where a number was seen, and whether it was fitted."""

    number: _Number
    measurement: str
    posture: Array
    robot: int
    fitted: bool


def _observed(rows: Sequence[_Row], robots: int) -> Observed:
    numbers, robot = [row.number for row in rows], np.array([row.robot for row in rows])
    fitted = np.array([row.fitted for row in rows])
    absorbed, moves = [np.zeros((len(rows), 0))], np.zeros((0, 0))
    for one in range(robots):
        own = robot == one
        if not own.any():
            continue
        slope = np.array([number.slope for number, here in zip(numbers, own, strict=True) if here])
        amount = moved_by_fit(slope[fitted[own]])
        column = np.zeros((len(rows), amount.shape[1]))
        column[own] = slope @ amount
        absorbed.append(column)
        moves = amount if one == 0 else moves
    seen = Seen(
        np.array([row.posture for row in rows]),
        np.array([number.shape for number in numbers]),
        robot,
        np.concatenate(absorbed, axis=1),
    )
    return Observed(
        tuple(row.measurement for row in rows),
        tuple(number.item for number in numbers),
        np.array([number.measured for number in numbers]),
        np.array([number.model for number in numbers]),
        seen,
        moves,
    )


def moved_by_fit(slope: Array) -> Array:
    """(p, r): how a fit of numbers with slopes (n, p) can have moved its parameters, in all that it sees."""
    _, values, directions = np.linalg.svd(slope, full_matrices=False)
    return np.asarray(directions.T * (values / np.hypot(values, _LEAST_SLOPE)))


def steps(model: FittedModel) -> Array:
    """(p,): a broad error of each parameter: by a factor of e, or of a quarter of its range where it is not
    on a logarithmic scale; 0 of those that are not fitted.
    """
    free = np.any(model.spread, axis=1)
    return np.where(free, np.where(model.log, model.values, (model.upper - model.lower) / 4), 0.0)


def mode_slopes(model: FittedModel, system: System, modes: ComplexModes) -> tuple[Array, Array]:
    """Of ln frequency and ln damping ratio (m, p) by steps of the parameters."""
    slopes = frequency_and_damping_gradient(modes, system.factors, len(model.values))
    values = modes.frequency_hz, modes.damping_ratio
    step = steps(model)
    found = (slope * step / value[:, None] for slope, value in zip(slopes, values, strict=True))
    frequency, damping = found
    return frequency, damping


def peak_slope(model: FittedModel, system: System, out: Array, s: complex) -> Array:
    """(p,): of ln |H| at s, of the direct receptance along a row (n,) of motion per coordinate."""
    every = np.arange(len(model.values))
    matrices, row = system.matrices(model.values), out[None]
    h, gradient = frf_and_gradient(matrices, system.factors, np.array([s]), row, row.T, 0, every)
    with np.errstate(divide="ignore", invalid="ignore"):
        return by_steps(model, gradient[0, 0, 0] / h[0, 0, 0])


def by_steps(model: FittedModel, slopes: Complex) -> Array:
    """(..., p) of ln |H| by steps of the parameters, from slopes (..., p) of H over it; nothing where there
    is no H.
    """
    return np.asarray(np.nan_to_num(np.real(slopes) * steps(model)))


def _rows(source: Source, name: str, one: MeasurementResult, names: Sequence[str]) -> Iterator[_Row]:
    """Of one measurement, those that are positive numbers."""
    posture = np.deg2rad(one.posture_deg)
    system = source.model.system(posture, source.model.driven.get(name, frozenset()))
    found: list[_Number] = []
    if one.pairs is not None:
        found += _of_modes(source.model, system, one.pairs, names)
    if one.frf is not None and source.point is not None:
        found += _of_peaks(source.model, source.point, system, one.frf)
    for number in found:
        if number.measured > 0 and number.model > 0:  # not NaN, and no mode without damping
            yield _Row(number, name, posture, source.number, one.use == "fit")


def _of_modes(
    model: FittedModel, system: System, pairs: ModePairs, names: Sequence[str]
) -> Iterator[_Number]:
    matrices = system.matrices(model.values)
    modes = complex_modes(*matrices)
    shapes = shapes_of(system, matrices[2], modes, names)
    frequency, damping = mode_slopes(model, system, modes)
    for measured, number in zip(pairs.measured, pairs.model, strict=True):
        if number >= len(shapes):
            continue
        for quantity, of, by, slope in (
            ("frequency", pairs.measured_frequency_hz, modes.frequency_hz, frequency),
            ("damping", pairs.measured_damping_ratio, modes.damping_ratio, damping),
        ):
            values = float(of[measured]), float(by[number])
            yield _Number(quantity, int(number) + 1, *values, shapes[number], slope[number])


def _of_peaks(model: FittedModel, point: Point, system: System, frf: FrfComparison) -> Iterator[_Number]:
    """Of the direct receptances of the point, along the directions of its channels."""
    power = POWER.get(frf.quantity)
    if power is None:
        return
    s = frf.window_decay_per_s + 2j * np.pi * frf.frequency_hz
    axes = point.axes @ system.site.engine.axes(point.link).T
    motion = axes @ system.base_jacobian(point.link, point.position)
    for pair, (output, force) in enumerate(zip(frf.output, frf.input, strict=True)):
        channel = Channel.parse(output)
        if channel.node != point.node or channel.place != Channel.parse(force).place:
            continue
        if not 1 <= abs(channel.direction) <= _AXES:
            continue
        measured, fitted = (np.abs(one[:, pair] / s**power) for one in (frf.measured, frf.fitted))
        if np.isfinite(measured).any():
            axis, line = channel.axis, complex(s[np.argmax(fitted)])
            peaks = float(np.nanmax(measured)), float(np.max(fitted))
            slope = peak_slope(model, system, motion[axis], line)
            yield _Number("peak", axis + 1, *peaks, axes[axis].astype(complex), slope)
