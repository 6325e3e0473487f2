"""Measured FRFs beside what a fitted model says of every point along every axis: enough to see whether a
sensor reads another point, other axes or another size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER
from identify.model.frf import frf
from identify.robot.points import Point
from identify.setup.score import Score
from identify.vibration.costs.frf_least_squares import LOG_FLOOR
from identify.vibration.costs.target import FrfTarget
from identify.vibration.given import base_axes
from identify.vibration.log_shape import frf_targets
from identify.vibration.problem import Measurement


@dataclass(frozen=True)
class Beside:
    """One measurement.

    moved (lines, coordinates, inputs): how the model moves, with the common factor; channels: the file's, of
    each point and axis, None where it has none; measured, predicted (lines, nodes, 3, inputs) along +x, +y,
    +z of the axes that the file has, the prediction with the common factor; weight (lines, nodes, 1, 1): one
    over the square of what is expected to be off: noise, and a tenth of what the point does there.
    """

    measurement: Measurement
    target: FrfTarget
    moved: Complex
    nodes: tuple[int, ...]
    channels: tuple[tuple[Channel | None, ...], ...]
    measured: Complex
    predicted: Complex
    weight: Array

    def apart(self, node: int, prediction: Complex) -> float:
        """Weighted squares of a point less another prediction (lines, 3, inputs)."""
        at = self.nodes.index(node)
        away = np.abs(np.nan_to_num(self.measured[:, at] - prediction)) ** 2
        return float(np.sum(away * self.weight[:, at]))

    def of(self, point: Point) -> Complex:
        """What the model says of a point (lines, 3, inputs)."""
        return np.asarray(_seen(self.measurement, self.target, self.moved, [point])[:, 0])


def beside(score: Score) -> list[Beside]:
    """Every measurement of translations beside a fitted model; made once."""
    return score.once("beside", lambda: _views(score))


def _views(score: Score) -> list[Beside]:
    pairs = zip(score.problem.measurements, frf_targets(score.problem), strict=True)
    return [
        _beside(m, target, score, score.problem.points)
        for m, target in pairs
        if any(0 < abs(one.direction) <= 3 for one in target.data.outputs)
    ]


def _beside(m: Measurement, target: FrfTarget, score: Score, points: Mapping[int, Point]) -> Beside:
    data = target.data
    nodes = tuple(dict.fromkeys(one.node for one in data.outputs if 0 < abs(one.direction) <= 3))
    shape = (len(data.frequency_hz), len(nodes), 3, len(data.inputs))
    measured, noise = np.full(shape, np.nan, dtype=complex), np.zeros(shape)
    channels: list[list[Channel | None]] = [[None] * 3 for _ in nodes]
    for number, one in enumerate(data.outputs):
        if 0 < abs(one.direction) <= 3:
            at = nodes.index(one.node), one.axis
            measured[:, at[0], at[1]] = one.sign * data.frf[:, number]
            channels[at[0]][at[1]] = one
            if target.noise is not None:
                noise[:, at[0], at[1]] = target.noise[:, number]
    if m.settings.correct.axes == "base":
        turns = np.array([_axes(m, points[node]) for node in nodes])
        measured = np.einsum("nji,lnjk->lnik", turns, measured) @ _forces(m, target, points)
    power = np.nanmean(np.abs(measured) ** 2, axis=(2, 3), keepdims=True)
    weight = 1 / (2 * np.mean(noise**2, axis=(2, 3), keepdims=True) + LOG_FLOOR**2 * power)
    moved = _moved(m, target, score)
    predicted = _seen(m, target, moved, [points[node] for node in nodes])
    kept = tuple(tuple(row) for row in channels)
    return Beside(m, target, moved, nodes, kept, measured, predicted, np.nan_to_num(weight))


def _moved(m: Measurement, target: FrfTarget, score: Score) -> Complex:
    """Of all coordinates (lines, coordinates, inputs), with the common factor."""
    force = target.force
    if m.settings.correct.axes == "base":
        force = force @ _forces(m, target, score.problem.points)
    matrices, power = target.system.matrices(score.values), POWER[target.data.quantity]
    h = frf(*matrices, target.data.s, np.eye(len(force)), force, power)
    return np.asarray(np.exp(score.level) * h)


def _seen(m: Measurement, target: FrfTarget, moved: Complex, points: Sequence[Point]) -> Complex:
    """What points see of that (lines, points, 3, inputs)."""
    rows = [point.axes @ target.system.jacobian(point.link, point.position)[:3] for point in points]
    if m.settings.correct.axes == "base":
        rows = [_axes(m, point).T @ one for point, one in zip(points, rows, strict=True)]
    h = np.concatenate(rows) @ moved
    return h.reshape(len(h), len(points), 3, -1)


def _axes(m: Measurement, point: Point) -> Array:
    """A point's axes (3, 3), as rows, in those of the base."""
    return base_axes(m.system.site.engine, point)


def _forces(m: Measurement, target: FrfTarget, points: Mapping[int, Point]) -> Array:
    """(inputs, inputs): forces along the axes of the points made of those along the axes of the base."""
    inputs = target.data.inputs
    found = np.zeros((len(inputs), len(inputs)))
    for a, one in enumerate(inputs):
        for b, other in enumerate(inputs):
            if one.node == other.node:
                found[a, b] = _axes(m, points[one.node])[one.axis, other.axis]
    return found
