"""Errors of what was told that are larger than can be believed: effects to be named, not uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.parameters import Values
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.channel_gain import ChannelGain
from identify.model.effects.rotor_inertia import RotorInertia
from identify.model.effects.sensor_mass import SensorMass
from identify.model.effects.sensor_rotation import SensorRotation
from identify.model.effects.time_delay import TimeDelay
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.vibration.nuisances.nuisance import FORCE, Nuisance, Nuisances

_BEYOND, _CHANCE = 3.0, 1e-4
"""Standard deviations beyond which an error may be an effect, and the chance that the largest of all errors
of a place would be as large."""
_OF = {"channel-gain": "channel", "time-delay": "set"}


def stated_already(nuisances: Nuisances, effect: Effect) -> bool:
    """Whether an effect is among the errors that are fitted along anyway."""
    if effect.kind == "sensor-rotation":
        return any(one.group == "point" and one.change.startswith("r") for one in nuisances.entries)
    return effect.kind in _OF and nuisances.has(_OF[effect.kind])


def beyond_belief(nuisances: Nuisances, values: Mapping[str, float], robot: Robot) -> list[Effect]:
    """The effects that stand for errors beyond three standard deviations, which chance cannot explain, the
    least likely first; values by name.
    """
    entries = nuisances.entries
    shift = np.array([values[one.name] for one in entries])
    together: dict[tuple[str, str], list[int]] = {}
    for number, one in enumerate(entries):
        part = "turn" if one.group == "point" and one.change.startswith("r") else ""
        together.setdefault((one.group, one.place + part), []).append(number)
    found = []
    for numbers in together.values():
        own = shift[numbers]
        chance = float(scipy.special.chdtrc(len(own), np.sum(own**2))) * len(together)
        effect = _effect([entries[n] for n in numbers], own, robot)
        if np.abs(own).max() > _BEYOND and chance < _CHANCE and effect is not None:
            found.append((chance, -float(np.sum(own**2)), effect))
    return [effect for *_, effect in sorted(found, key=lambda row: row[:2])]


def alike(effect: Effect, robot: Robot, points: Mapping[int, Point]) -> list[Effect]:
    """What looks like a wrong inertia of a link to a model that does not have it: sensors, and rotors of any
    joint, which errors of several links share among them.
    """
    if not isinstance(effect, AddedMass):
        return []
    return [one for kind in (SensorMass, RotorInertia) for one in kind.instances(robot, points)]


def _effect(some: Sequence[Nuisance], shift: Array, robot: Robot) -> Effect | None:
    """The effect that the errors of one place stand for, with where it is to start; None for what has
    none.
    """
    first = some[0]
    largest = some[int(np.argmax(np.abs(shift)))]
    if first.group == "link":
        mass = robot.link(first.place).mass
        bounds = (-round(mass / 2, 3), round(2 * mass, 3))
        return AddedMass(
            link=first.place, extent="body", mass=Values(initial=round(0.02 * mass, 6), bounds=bounds)
        )
    if first.group == "point" and first.change.startswith("r"):
        axis = largest.change.removeprefix("r")
        return SensorRotation.model_validate({"point": int(first.place), "axis": axis})
    if first.group == "channel" and first.place != FORCE:
        return ChannelGain(channel=first.place)
    if first.group == "set":
        return TimeDelay()
    return None
