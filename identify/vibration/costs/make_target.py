"""A measured FRF set brought together with a system: channels in its coordinates, readings, simulation.

Measured modes side by side with the model that has them, and all data that a cost compares.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.model.effects.measurement import MeasurementEffect
from identify.model.modes import (
    ComplexModes,
    eigenvalue_change,
    eigenvalue_gradient,
    frequency_and_damping_change,
)
from identify.model.system import System
from identify.model.transient import Impact
from identify.robot.points import Point
from identify.vibration.costs.impact import simulated_impact
from identify.vibration.costs.target import FrfTarget, together
from identify.vibration.nuisances.placed import Placed, state
from identify.vibration.nuisances.sensitivity import structural_changes


@dataclass(frozen=True, eq=False)
class ModalTarget:
    """One measured modal table and the system whose modes it lists; out (channels, n) where the table has
    shapes.  nuisances: what is uncertain; their values may follow those of the parameters.
    """

    name: str
    data: ModalTable
    system: System
    out: Array | None = None
    nuisances: Placed | None = None

    def at(self, values: Array) -> tuple[System, Array]:
        """The system at values (unknowns,), and the values of the parameters."""
        size = len(self.system.parameters)
        if self.nuisances is None or not values[size:].any():
            return self.system, values[:size]
        there = state(self.nuisances, values[size:])
        return self.system.with_more(there.mass, there.stiffness), values[:size]

    def slopes(self, modes: ComplexModes, values: Array, free: Index) -> tuple[Array, Array]:
        """Derivatives (m, free) of frequency_hz and damping_ratio of the modes at values (unknowns,)."""
        size = len(self.system.parameters)
        change = np.zeros((len(modes.eigenvalues), len(values)), dtype=complex)
        change[:, :size] = eigenvalue_gradient(modes, self.system.factors, size)
        if self.nuisances is not None and np.any(free >= size):
            there = state(self.nuisances, values[size:])
            mass, stiffness, numbers = structural_changes(self.nuisances, there)
            change[:, size + numbers] += eigenvalue_change(modes, mass, stiffness)
        return frequency_and_damping_change(modes, change[:, free])


@dataclass(frozen=True)
class Targets:
    """All data that a cost compares; the impacts on nonlinear systems are simulated together.

    nuisances: numbers of the unknowns that are nuisance parameters, which cost their squares; priors: of
    parameters that do, in units of their standard deviations, which stand beside.
    """

    frf: tuple[FrfTarget, ...] = ()
    modal: tuple[ModalTarget, ...] = ()
    nuisances: tuple[int, ...] = ()
    priors: tuple[tuple[int, float], ...] = ()

    @property
    def stated(self) -> tuple[tuple[int, float], ...]:
        """Numbers of all unknowns that cost their squares, and their standard deviations."""
        return (*((number, 1.0) for number in self.nuisances), *self.priors)

    @property
    def simulated(self) -> bool:
        """Whether impacts of any of them are simulated."""
        return any(target.simulated is not None for target in self.frf)

    def __post_init__(self) -> None:
        if self.simulated:
            simulator = together(self.frf)
            frf = tuple(replace(target, simulator=simulator) for target in self.frf)
            object.__setattr__(self, "frf", frf)


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
