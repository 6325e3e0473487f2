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
from identify.setup.score import Score, frf_targets
from identify.vibration.costs.frf_least_squares import LOG_FLOOR
from identify.vibration.costs.target import FrfTarget


@dataclass(frozen=True)
class Beside:
    """One measurement.

    channels: the file's, of each point and axis, None where it has none; measured, predicted (lines, nodes,
    3, inputs) along +x, +y, +z, the prediction with the common factor; weight (lines, nodes, 1, 1): one over
    the square of what is expected to be off: noise, and a tenth of what the point does there.
    """

    target: FrfTarget
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

    def of(self, point: Point, score: Score) -> Complex:
        """What the model says of a point (lines, 3, inputs)."""
        return np.asarray(_predicted(self.target, score, [point])[:, 0])


def beside(score: Score, points: Mapping[int, Point]) -> list[Beside]:
    """Every measurement of translations beside a fitted model."""
    return [
        _beside(target, score, points)
        for target in frf_targets(score.problem)
        if any(0 < abs(one.direction) <= 3 for one in target.data.outputs)
    ]


def _beside(target: FrfTarget, score: Score, points: Mapping[int, Point]) -> Beside:
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
    power = np.nanmean(np.abs(measured) ** 2, axis=(2, 3), keepdims=True)
    weight = 1 / (2 * np.mean(noise**2, axis=(2, 3), keepdims=True) + LOG_FLOOR**2 * power)
    predicted = _predicted(target, score, [points[node] for node in nodes])
    kept = tuple(tuple(row) for row in channels)
    return Beside(target, nodes, kept, measured, predicted, np.nan_to_num(weight))


def _predicted(target: FrfTarget, score: Score, points: Sequence[Point]) -> Complex:
    """(lines, points, 3, inputs), with the common factor."""
    system, values = target.system, score.values
    rows = [point.axes @ system.jacobian(point.link, point.position)[:3] for point in points]
    h = frf(
        *system.matrices(values),
        target.data.s,
        np.concatenate(rows),
        target.force,
        POWER[target.data.quantity],
    )
    return np.asarray(np.exp(score.level) * h.reshape(len(h), len(points), 3, -1))
