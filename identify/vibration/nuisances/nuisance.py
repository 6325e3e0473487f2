"""All that is uncertain in a study, in one order: each a number about zero in units of its stated standard
deviation.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.measured.channel import Channel
from identify.model.effects.place import Form
from identify.model.nuisances.inertia import CHANGES
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.vibration.nuisances.meshes import made_of_mesh
from identify.vibration.nuisances.settings import UncertaintySettings

FORCE = "force"
"""The place of the sensitivity of the force transducer, which all impacts share."""
IMPACTS = "impacts"
"""The place of what all impacts share."""
_ERROR = ".error"
"""What the name of every nuisance parameter ends in, and of no other parameter."""
Key = tuple[str, str, str]


def bare(values: Mapping[str, float]) -> dict[str, float]:
    """Values by name without those of nuisance parameters, which then begin at nothing."""
    return {name: value for name, value in values.items() if not name.endswith(_ERROR)}


@dataclass(frozen=True)
class Nuisance:
    """One uncertain number: of what (`link`, `point`, `channel`, `impact`, `joint`, `kinematics`, `set`,
    `form`, `impulse`), where, which change of it; its standard deviation in SI units (or relative, of
    logarithms); whether it goes along to other measurements.
    """

    group: str
    place: str
    change: str
    std: float
    unit: str
    lasting: bool = True

    @property
    def name(self) -> str:
        """Unique, as a parameter's: link3.mass.error."""
        return f"{self.place}.{self.change}{_ERROR}"

    @property
    def key(self) -> Key:
        """What finds it."""
        return self.group, self.place, self.change

    @property
    def parameter(self) -> Parameter:
        """It as an unknown of a fit, in units of its standard deviation."""
        return Parameter(self.name, "std", 0.0, -np.inf, np.inf, log=False, nuisance=True)


@dataclass(frozen=True)
class Slot:
    """Where some of them sit: their numbers among all, -1 where something is exact, and their standard
    deviations, alike in shape.
    """

    numbers: Index
    std: Array

    def at(self, nuisances: Array) -> Array:
        """Errors in their own units, in the shape of the slot, at values (..., nuisances)."""
        known = np.concatenate([nuisances, np.zeros((*nuisances.shape[:-1], 1))], axis=-1)[..., self.numbers]
        return np.asarray(self.std * known)


@dataclass(frozen=True)
class Nuisances:
    """All of a study."""

    entries: tuple[Nuisance, ...]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Them as unknowns of a fit."""
        return tuple(one.parameter for one in self.entries)

    @cached_property
    def _numbers(self) -> dict[Key, int]:
        return {one.key: number for number, one in enumerate(self.entries)}

    @cached_property
    def _groups(self) -> frozenset[str]:
        return frozenset(one.group for one in self.entries)

    @cached_property
    def _std(self) -> Array:
        """Of each, and of nothing."""
        return np.append([one.std for one in self.entries], 0.0)

    def of_model(
        self, forms: Iterable[Form], simulated: Sequence[Tested], settings: UncertaintySettings
    ) -> Nuisances:
        """With errors of the forms of a model's effects, and of the impacts of the measurements in which it
        has them simulated, in place of those of another's.
        """
        kept = (one for one in self.entries if one.group not in ("form", "impulse"))
        more = [
            Nuisance("form", form.place, name, settings.std("flexible_links", what), "1")
            for form in forms
            for name, what in form.errors
        ]
        strength = settings.std("impacts", "strength")
        more += [
            Nuisance("impulse", f"{one.name} {channel}", "strength", strength, "1", lasting=False)
            for one in simulated
            for channel in one.inputs
        ]
        if simulated:
            more.append(Nuisance("impulse", IMPACTS, "duration", settings.std("impacts", "duration"), "1"))
        return Nuisances((*kept, *(one for one in more if one.std > 0)))

    def has(self, group: str) -> bool:
        """Whether anything of a group is uncertain."""
        return group in self._groups

    def slot(self, keys: Sequence[Key], shape: tuple[int, ...]) -> Slot:
        """The nuisances of these keys in that shape; a key that is none is exact."""
        numbers = np.array([self._numbers.get(key, -1) for key in keys], dtype=int).reshape(shape)
        return Slot(numbers, self._std[numbers])


NOTHING = Nuisances(())
"""All is exactly as stated."""


class Tested(Protocol):
    """What is asked of a measurement: its name, posture, channels."""

    @property
    def name(self) -> str:
        """Unique name."""

    @property
    def posture(self) -> Array:
        """(joints,), rad."""

    @property
    def outputs(self) -> tuple[Channel, ...]:
        """Response channels."""

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """Force channels."""


def list_nuisances(
    settings: UncertaintySettings, robot: Robot, points: Mapping[int, Point], tested: Sequence[Tested]
) -> Nuisances:
    """All nuisances of a study; raises InputError where it states something of a link or point that does not
    exist.
    """
    _check_known("links", "link", settings.links.each, [link.name for link in robot.links])
    _check_known("points", "point", settings.points.each, list(points))
    for name in settings.channels.each:
        where = f"uncertainty.channels.each.{name}"
        if name != unsigned(Channel.parse(name, where)):
            raise InputError(where, f"channel {name!r}", f"{unsigned(Channel.parse(name))!r}")
    every = [
        *_of_links(settings, robot),
        *_of_points(settings, points, tested),
        *_of_channels(settings, tested),
        *_of_postures(settings, robot, tested),
        *_of_measurements(settings, tested),
    ]
    return Nuisances(tuple(one for one in every if one.std > 0))


def _check_known(group: str, what: str, stated: Iterable[str | int], known: Sequence[str | int]) -> None:
    for name in stated:
        if name not in known:
            expected = "one of " + ", ".join(map(str, known))
            raise InputError(f"uncertainty.{group}.each.{name}", f"unknown {what} {name!r}", expected)


def _of_links(settings: UncertaintySettings, robot: Robot) -> Iterator[Nuisance]:
    keys = ("mass", *("centre_m",) * 3, *("inertia",) * 6)
    for link in robot.links:
        if link.mass <= 0:
            continue
        made = made_of_mesh(robot, link)
        for change, key in zip(CHANGES, keys, strict=True):
            share = 0.5 if change.startswith("product") else 1.0
            unit = "m" if key == "centre_m" else "1"
            yield Nuisance("link", link.name, change, share * settings.of_link(link.name, key, made), unit)


def _of_points(
    settings: UncertaintySettings, points: Mapping[int, Point], tested: Sequence[Tested]
) -> Iterator[Nuisance]:
    sensors = sorted({channel.node for one in tested for channel in one.outputs if channel.node in points})
    struck = {channel.node for one in tested for channel in one.inputs if channel.node in points}
    for node in sorted({*sensors, *struck}):
        for axis in "xyz":
            yield Nuisance("point", str(node), axis, settings.of("points", node, "position_m"), "m")
    for node in sensors:
        for axis in "xyz":
            std = np.radians(settings.of("points", node, "direction_deg"))
            yield Nuisance("point", str(node), f"r{axis}", float(std), "rad")


def _of_channels(settings: UncertaintySettings, tested: Sequence[Tested]) -> Iterator[Nuisance]:
    for channel in sorted({unsigned(channel) for one in tested for channel in one.outputs}):
        yield Nuisance("channel", channel, "gain", settings.of("channels", channel, "gain"), "1")
    if any(one.inputs for one in tested):
        yield Nuisance("channel", FORCE, "gain", settings.std("channels", "force_gain"), "1")


def unsigned(channel: Channel) -> str:
    """A channel whichever its sign."""
    return str(Channel(channel.node, abs(channel.direction)))


def posture_name(posture: Array) -> str:
    """A posture (joints,), rad, as a name, the same for all measurements at it."""
    return "posture(" + " ".join(f"{angle:.4g}" for angle in np.degrees(posture)) + ")"


def _of_postures(settings: UncertaintySettings, robot: Robot, tested: Sequence[Tested]) -> Iterator[Nuisance]:
    std = float(np.radians(settings.std("joints", "angle_deg")))
    for posture in dict.fromkeys(posture_name(one.posture) for one in tested):
        for number in range(1, len(robot.joints) + 1):
            yield Nuisance("joint", posture, f"joint{number}", std, "rad", lasting=False)
    for number in range(1, len(robot.joints) + 1):
        for axis in "xyz":
            std_m = settings.std("kinematics", "position_m")
            yield Nuisance("kinematics", f"joint{number}", f"origin_{axis}", std_m, "m")


def _of_measurements(settings: UncertaintySettings, tested: Sequence[Tested]) -> Iterator[Nuisance]:
    std = float(np.radians(settings.std("impacts", "direction_deg")))
    for one in tested:
        for channel in (channel for channel in one.inputs if channel.motor is None):
            for axis in sorted({0, 1, 2} - {channel.axis % 3}):
                place = f"{one.name} {channel}"
                yield Nuisance("impact", place, f"r{'xyz'[axis]}", std, "rad", lasting=False)
        if one.inputs:
            yield Nuisance("set", one.name, "delay", settings.std("sets", "delay_s"), "s", lasting=False)
