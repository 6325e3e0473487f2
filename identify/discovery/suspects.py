"""Errors of what was told that are larger than can be believed: effects to be named, not uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.parameters import Values
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.channel_gain import ChannelGain
from identify.model.effects.channel_polarity import ChannelPolarity
from identify.model.effects.channel_swap import ChannelSwap
from identify.model.effects.rigid_body import MOMENTS, REACH
from identify.model.effects.rotor_inertia import RotorInertia
from identify.model.effects.sensor_rotation import SensorRotation
from identify.model.effects.time_delay import TimeDelay
from identify.model.nuisances.inertia import CHANGES, moments
from identify.robot.description import Link, Robot
from identify.robot.points import Point
from identify.vibration.nuisances.nuisance import FORCE, Nuisance, Nuisances

_BEYOND, _CHANCE = 3.0, 0.01
"""Standard deviations beyond which an error may be an effect, and the chance that all errors of its cause
together would be as large."""
_FURTHER = 3.0
"""How many times what errors of a link come to the moments of the body that stands for them may reach."""
_UNTOLD = 1e-6
"""Share of an error that is taken to be told by the data where they tell nothing: it is at nothing then."""
_OF = {"channel-gain": "channel", "time-delay": "set"}


def stated_already(nuisances: Nuisances, effect: Effect) -> bool:
    """Whether an effect is among the errors that are fitted along anyway."""
    if effect.kind == "sensor-rotation":
        return any(one.group == "point" and one.change.startswith("r") for one in nuisances.entries)
    return effect.kind in _OF and nuisances.has(_OF[effect.kind])


@dataclass(frozen=True)
class Suspect:
    """An effect that stands for errors of what was told beyond three standard deviations, by their numbers.

    start: its parameters as large as the errors and what is left of those, by name: the model is then as near
    to the data as it was.
    """

    effect: Effect
    start: dict[str, float]
    errors: list[int]


def beyond_belief(nuisances: Nuisances, values: Mapping[str, float], robot: Robot) -> list[Suspect]:
    """The effects that stand for errors beyond three standard deviations, the least likely first; values by
    name.
    """
    entries = nuisances.entries
    shift = np.array([values[one.name] for one in entries])
    together: dict[tuple[str, str], list[int]] = {}
    for number, one in enumerate(entries):
        together.setdefault(_cause(one), []).append(number)
    found: list[tuple[float, float, Suspect]] = []
    for numbers in together.values():
        own = shift[numbers]
        chance = float(scipy.special.chdtrc(len(own), np.sum(own**2)))
        if np.abs(own).max() <= _BEYOND or chance > _CHANCE:
            continue
        named = _effect([entries[n] for n in numbers], own, robot)
        if named is not None:
            found.append((chance, -float(np.sum(own**2)), Suspect(*named, numbers)))
    return [suspect for *_, suspect in sorted(found, key=lambda row: row[:2])]


def foreseen_fall(shift: Array, covariance: Array) -> float:
    """How much less squares a model would leave, to first order, if these errors cost nothing: shift (e,) of
    their values and covariance (e, e) of what the data leave of them, in standard deviations of what was
    stated.

    At the minimum, errors that data alone would put at m are at (I - covariance) m, and the squares that
    stating them costs are m' (I - covariance) m.
    """
    return _over(shift, np.eye(len(shift)) - covariance)


def by_chance(shift: Array, scatter: Array) -> bool:
    """Whether a fit may have found errors (e,) so large by chance, by the covariance (e, e) with which it
    finds them: residuals that are correlated pull at them by far more than independent ones.
    """
    return bool(log_chance(_over(shift, scatter), len(shift)) > np.log(_CHANCE))


def _over(shift: Array, covariance: Array) -> float:
    return float(shift @ np.linalg.solve(covariance + _UNTOLD * np.eye(len(shift)), shift))


def causes(nuisances: Nuisances) -> int:
    """How many causes of errors there are, each of which may stand out by chance."""
    return len({_cause(one) for one in nuisances.entries})


def log_chance(squares: float, freedom: int) -> float:
    """Logarithm of the chance of so many squares of normal errors of so many degrees of freedom; that of one
    where there is none: a reversed channel has no parameter but is one choice.
    """
    freedom = max(freedom, 1)
    if squares <= 0:
        return 0.0
    tail = float(scipy.special.chdtrc(freedom, squares))
    if tail > 0:
        return float(np.log(tail))
    half = squares / 2  # its asymptotic form, where the number itself is too small
    return float(-half + (freedom / 2 - 1) * np.log(half) - scipy.special.gammaln(freedom / 2))


def _cause(one: Nuisance) -> tuple[str, str]:
    """What errors of one cause have in common: a link, the place or the turn of a sensor, all delays."""
    if one.group == "point" and one.change.startswith("r"):
        return "turn", one.place
    return one.group, "" if one.group == "set" else one.place


def alike(effect: Effect, robot: Robot, points: Mapping[int, Point]) -> list[Effect]:
    """What looks like an effect that errors stand for: whatever may be wrong at the same sensor."""
    kinds: Sequence[type[Effect]] = (ChannelPolarity, ChannelSwap, ChannelGain, SensorRotation)
    every = [one for kind in kinds for one in kind.instances(robot, points)]
    return [one for one in every if one != effect and _node(one) == _node(effect)]


def turning_with(body: AddedMass, robot: Robot) -> list[Effect]:
    """Rotors that turn with the body's link and make its inertia larger about its joint's axis alone."""
    own = [n for n, joint in enumerate(robot.joints, start=1) if joint.child == body.link]
    return [one for one in RotorInertia.instances(robot, {}) if one.joints == own]


def without_errors_at(effect: Effect, nuisances: Nuisances, values: Mapping[str, float]) -> dict[str, float]:
    """The values with no turn and no wrong gains of the sensor that an effect is about."""
    own = [one for one in nuisances.entries if _cause(one)[0] in ("turn", "channel")]
    return {**values, **{one.name: 0.0 for one in own if one.place.partition(":")[0] == _node(effect)}}


def _node(effect: Effect) -> str | None:
    """The node of the sensor that is wrong."""
    if isinstance(effect, (SensorRotation, ChannelSwap)):
        return str(effect.point)
    if isinstance(effect, (ChannelGain, ChannelPolarity)):
        return str(effect.channel).partition(":")[0]
    return None


def _effect(some: Sequence[Nuisance], shift: Array, robot: Robot) -> tuple[Effect, dict[str, float]] | None:
    """The effect that the errors of one cause stand for and its start (`beyond_belief`); None for what has
    none.
    """
    first, sizes = some[0], shift * [one.std for one in some]
    nothing_left = dict.fromkeys((one.name for one in some), 0.0)
    if first.group == "link":
        change = np.zeros(len(CHANGES))
        change[[CHANGES.index(one.change) for one in some]] = sizes
        effect, body = _body(robot, robot.link(first.place), change)
        return effect, {**nothing_left, **body}
    if _cause(first)[0] == "turn":
        number = int(np.argmax(np.abs(shift)))
        largest, angle = some[number], float(sizes[number])
        axis = largest.change.removeprefix("r")
        turned = SensorRotation.model_validate({"point": int(first.place), "axis": axis})
        return turned, {largest.name: 0.0, f"{first.place}.r{axis}.angle": angle}
    if first.group == "channel" and first.place != FORCE:
        factor = float(np.exp(sizes[0]))
        return ChannelGain(channel=first.place), {**nothing_left, f"{first.place}.gain": factor}
    if first.group == "set":
        delay = float(np.mean(sizes))
        left = {one.name: float(size - delay) / one.std for one, size in zip(some, sizes, strict=True)}
        return TimeDelay(), {**left, "responses.delay": delay}
    return None


def _body(robot: Robot, link: Link, change: Array) -> tuple[AddedMass, dict[str, float]]:
    """The body that makes the same of a link as changes (10,) of its inertia; moments reach further than
    usual where the errors ask for it, as those of a rotor that turns with the link do.
    """
    bounds = (-round(link.mass / 2, 3), round(2 * link.mass, 3))
    mass = Values(initial=round(0.02 * link.mass, 6), bounds=bounds)
    here = [replace(link, centre=np.zeros(3))]
    added = moments(here, change[None])[0] - moments(here, np.zeros((1, len(CHANGES))))[0]
    start = {f"{link.name}.{name}": float(value) for name, value in zip(MOMENTS, added[0], strict=True)}
    arm, reaches = sum(one.mass for one in robot.links), dict[str, Values]()
    for what, largest in (
        ("moment", np.abs(added[0, 1:4]).max()),
        ("second_moment", np.abs(added[0, 4:]).max()),
    ):
        reach = round(_FURTHER * float(largest), 6)
        if reach > REACH[what] * arm:
            reaches[what] = Values(initial=0.0, bounds=(-reach, reach))
    return AddedMass(link=link.name, extent="body", mass=mass, **reaches), start
