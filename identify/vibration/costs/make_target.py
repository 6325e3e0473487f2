"""A measured FRF set brought together with a system: channels in its coordinates, readings, simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.model.effects.measurement import MeasurementEffect
from identify.model.system import System
from identify.model.transient import Impact
from identify.robot.points import Point
from identify.vibration.costs.impact import simulated_impact
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.placed import Placed

Uncertain = Callable[[System, tuple[Channel, ...], tuple[Channel, ...]], Placed]


def frf_target(
    name: str,
    data: FrfSet,
    system: System,
    points: Mapping[int, Point],
    noise: Array | None = None,
    record: float | None = None,
    impact: Impact | None = None,
    uncertain: Uncertain | None = None,
) -> FrfTarget:
    """A set with its prediction by a system, through the readings of the system's effects; InputError for a
    channel without a point.

    uncertain: places the nuisances of the measurement, for a system, its response channels (those that
    readings need too) and its forces.
    """
    measuring = [
        (effect, numbers) for effect, numbers in system.effects if isinstance(effect, MeasurementEffect)
    ]
    channels = needed_channels(data, system, points)
    readings = tuple(
        (effect.reading_of(channels, data.inputs, points), numbers) for effect, numbers in measuring
    )
    out, force = channel_rows(system, points, channels, name), channel_rows(system, points, data.inputs, name)
    simulated = simulated_impact(name, data, system, force.T, impact)
    placed = None if uncertain is None else uncertain(system, channels, data.inputs)
    return FrfTarget(name, data, system, out, force.T, noise, readings, record, simulated, nuisances=placed)


def needed_channels(data: FrfSet, system: System, points: Mapping[int, Point]) -> tuple[Channel, ...]:
    """The set's outputs, then what readings of the system's effects need besides."""
    channels = data.outputs
    for effect, _ in system.effects:
        if isinstance(effect, MeasurementEffect):
            channels += effect.needed(channels, points)
    return channels


def channel_rows(
    system: System, points: Mapping[int, Point], channels: tuple[Channel, ...], where: str
) -> Array:
    """(channels, n): motion of each channel per released coordinate; a channel without a point, or of a
    motor that the model does not have, is an InputError.
    """
    rows, turned = [], dict[int, Array]()
    for channel in channels:
        if channel.motor is not None:
            rows.append(channel.sign * system.motor(channel.motor, where))
            continue
        if channel.node not in points:
            raise InputError(
                where,
                f"channel {channel} has no point",
                "a node of the points file",
                "add it there or leave the channel out",
            )
        if channel.node not in turned:
            point = points[channel.node]
            motion = system.jacobian(point.link, point.position, where)
            turned[channel.node] = np.concatenate([point.axes @ motion[:3], point.axes @ motion[3:]])
        rows.append(channel.sign * turned[channel.node][channel.axis])
    return np.array(rows)
