"""Units of a fitted model as effects of the catalogue, with the values that they start from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.parameters import DampingValues, Values
from identify.measured.channel import Channel
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.base_compliance import BaseCompliance
from identify.model.effects.channel_gain import ChannelGain
from identify.model.effects.channel_polarity import ChannelPolarity
from identify.model.effects.channel_swap import ChannelSwap
from identify.model.effects.coupling import PAIRS, from_diagonals, soft_axes
from identify.model.effects.frf_gain import FrfGain
from identify.model.effects.geared import RotorInertia
from identify.model.effects.joint_compliance import CLASSES, JointCompliance
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.model.effects.sensor_rotation import SensorRotation
from identify.model.effects.springs import Axis

_AXES = ("x", "y", "z")
_RIGID = 1e3
"""Times as stiff as its softest axis a rigid one of a link begins."""
_ANGLES = 73
"""From which the angle of a turned sensor is found."""
_ALIKE = 0.02
"""Logarithms of factors that are one and the same."""
_SPAN = 1e3
"""Bounds lie this many times below and above what was found."""


@dataclass(frozen=True)
class Named:
    """An effect with start values by name of parameter; evidence: its log odds."""

    effect: Effect
    values: Mapping[str, float]
    evidence: float


def of_springs(effect: Effect, name: str, values: Mapping[str, float]) -> tuple[Effect, dict[str, float]]:
    """A unit of springs, such as joint2.tilt, as an ordinary effect with stiffnesses; rigid axes are left
    out.
    """
    body, _, kind = name.partition(".")
    if isinstance(effect, LinkFlexibility):
        return _of_parts(effect, values) if effect.nonuniform else _of_beam(effect, values)
    classes: dict[str, tuple[Axis, ...]] = {**CLASSES, "turning": ("rz",), "": get_args(Axis)}
    own = {name.split(".")[1]: value for name, value in values.items() if name.endswith(".compliance")}
    soft, coupled = soft_axes(place for place, compliance in own.items() if compliance > 0)
    axes: list[Axis] = [axis for axis in classes[kind] if axis in soft]
    places = [f"{body}.{axis}" for axis in axes]
    found = _stiffnesses(places, values, max(own.values()))
    for pair in PAIRS:
        if coupled and set(pair) <= soft:
            found |= from_diagonals(values, body, pair, max(own.values()) / _RIGID)
    stiffness, damping = _about(places, found)
    more = {"axes": axes, "stiffness": stiffness, "damping": damping, "coupled": coupled}
    if body == "base":
        return BaseCompliance(**more), found
    if body.startswith("payload"):
        return effect.model_copy(update={**more, "shrink": False, "compliance_std": None}), found
    at = getattr(effect, "at_m", None) if kind == "tilt" else None
    return JointCompliance(joints=[int(body.removeprefix("joint"))], at_m=at, **more), found


def of_rotor(effect: RotorInertia, values: Mapping[str, float]) -> tuple[Effect, dict[str, float]]:
    """A rotor and what holds it as an ordinary effect with a stiffness."""
    [name] = (name.removesuffix(".compliance") for name in values if name.endswith(".compliance"))
    found = {f"{name}.inertia": values[f"{name}.inertia"], **_stiffnesses([name], values)}
    inertia, (holding, damping) = found[f"{name}.inertia"], _about([name], found)
    more = {"holding_stiffness": holding, "holding_damping": damping, "shrink": False}
    about = Values(initial=inertia, bounds=(inertia / _SPAN, inertia * _SPAN))
    return effect.model_copy(update={"inertia": about, **more}), found


def _of_beam(effect: LinkFlexibility, values: Mapping[str, float]) -> tuple[Effect, dict[str, float]]:
    """A link that bends as one beam."""
    places = [f"{effect.link}.{what}" for what in ("bending_1", "bending_2", "torsion")]
    return _bending(effect, places, _stiffnesses(places, values))


def _of_parts(effect: LinkFlexibility, values: Mapping[str, float]) -> tuple[Effect, dict[str, float]]:
    """A link that bends by parts: all of it as its middle, and what its ends have more; one damper for
    all, which loses as much under a load at the end as those of the parts, sum c^2 d = sum c t.
    """
    found = {name: value for name, value in values.items() if ".part_" not in name}
    places = [f"{effect.link}.{what}" for what in ("bending_1", "bending_2", "torsion")]
    softest = max(values[f"{place}.part_{n}.compliance"] for place in places for n in (1, 2, 3))
    for place in places:
        parts = _stiffnesses([f"{place}.part_{n}" for n in (1, 2, 3)], values, softest)
        near, middle, far = (parts[f"{place}.part_{n}.stiffness"] for n in (1, 2, 3))
        dampers = [
            (parts[f"{place}.part_{n}.stiffness"], parts[f"{place}.part_{n}.damping"]) for n in (1, 2, 3)
        ]
        loss = sum(d / k**2 for k, d in dampers) / sum(1 / k**2 for k, _ in dampers)
        found |= {f"{place}.stiffness": middle, f"{place}.damping": loss}
        found |= {f"{place}.near_stiffness": near - middle, f"{place}.far_stiffness": far - middle}
    return _bending(effect, places, found)


def _bending(
    effect: LinkFlexibility, places: Sequence[str], found: dict[str, float]
) -> tuple[Effect, dict[str, float]]:
    """A link that bends in two planes and twists, about stiffnesses that were found."""
    bending, torsion = _about(places[:2], found), _about(places[2:], found)
    more = {"bending": bending[0], "bending_damping": bending[1]}
    more |= {"torsion": torsion[0], "torsion_damping": torsion[1]}
    return effect.model_copy(update={"shrink": False, "compliance_std": None, **more}), found


def _stiffnesses(
    places: Sequence[str], values: Mapping[str, float], softest: float | None = None
) -> dict[str, float]:
    """Those that are rigid begin so many times as stiff as the softest."""
    found = dict[str, float]()
    softest = softest or max(values[f"{place}.compliance"] for place in places)
    for place in places:
        compliance = max(values[f"{place}.compliance"], softest / _RIGID)
        found[f"{place}.stiffness"] = 1 / compliance
        found[f"{place}.damping"] = values[f"{place}.retardation_time"] / compliance
    return found


def _about(places: Sequence[str], values: Mapping[str, float]) -> tuple[Values, DampingValues]:
    """Starts and bounds of stiffness and damping about what was found: the usual start may be far from it."""
    found = []
    for role in ("stiffness", "damping"):
        start = [float(f"{values[f'{place}.{role}']:.4g}") for place in places]
        found.append({"initial": start, "bounds": (min(start) / _SPAN, max(start) * _SPAN)})
    return Values.model_validate(found[0]), DampingValues.model_validate(found[1])


def of_body(effect: AddedMass, values: Mapping[str, float]) -> tuple[Effect, dict[str, float]]:
    """A body as the catalogue has it."""
    start = max(abs(values[f"{effect.link}.mass"]), 1e-6)
    mass = effect.mass.model_copy(update={"initial": float(f"{start:.3g}")})
    return effect.model_copy(update={"mass": mass}), {
        name: value for name, value in values.items() if name.startswith(f"{effect.link}.")
    }


def of_all_forces(found: Sequence[Named], forces: int) -> list[Named]:
    """One factor of all FRFs in place of the same one of every force."""
    own = [one for one in found if isinstance(one.effect, FrfGain)]
    gains = np.array([gain for one in own for gain in one.values.values()])
    if len(own) < forces or forces < 2 or np.ptp(np.log(gains)) > _ALIKE:
        return list(found)
    gain = float(np.exp(np.mean(np.log(gains))))
    whole = Named(FrfGain(), {"frf.gain": gain}, sum(one.evidence for one in own))
    return [whole, *(one for one in found if one not in own)]


def of_sensor(
    node: int, error: Array, information: Array, price: float
) -> tuple[Effect, dict[str, float], Array]:
    """The simplest thing that says what a sensor's matrix I + E (3, 3) says, by how far it is from it in
    the information (9, 9) of the data, and `price` for each number; and the matrix error it stands for.
    """

    def cost(form: tuple[Effect, dict[str, float], Array]) -> float:
        off = (error - form[2]).ravel()
        return float(0.5 * off @ information @ off + price * len(form[1]))

    return min(_forms(node, error, information), key=cost)


def _forms(node: int, error: Array, information: Array) -> Iterator[tuple[Effect, dict[str, float], Array]]:
    yield ChannelPolarity(channel=node), {}, -2 * np.eye(3)
    gain = _best(error, np.eye(3), information)
    if 0.1 < 1 + gain < 10:
        yield ChannelGain(channel=node), {f"{node}.gain": 1 + gain}, gain * np.eye(3)
    for number, axis in enumerate(np.eye(3)):
        channel, one = str(Channel(node, number + 1)), np.outer(axis, axis)
        yield ChannelPolarity(channel=channel), {}, -2 * one
        gain = _best(error, one, information)
        if 0.1 < 1 + gain < 10:
            yield ChannelGain(channel=channel), {f"{channel}.gain": 1 + gain}, gain * one
        a, b = (n for n in range(3) if n != number)
        swapped = np.eye(3)
        swapped[[a, b]] = swapped[[b, a]]
        yield ChannelSwap(point=node, axes=(_AXES[a], _AXES[b])), {}, swapped - np.eye(3)
        turned, angle = _turned(error, axis, information)
        rotation = SensorRotation(point=node, axis=_AXES[number])
        yield rotation, {f"{node}.r{_AXES[number]}.angle": angle}, turned
    names = [f"{node}.matrix_{a}{b}" for a in _AXES for b in _AXES]
    yield SensorMatrix(points=[node]), dict(zip(names, map(float, error.ravel()), strict=True)), error


def _best(error: Array, form: Array, information: Array) -> float:
    """The amount of a form that is nearest to an error."""
    f = form.ravel()
    return float(f @ information @ error.ravel() / (f @ information @ f))


def _turned(error: Array, axis: Array, information: Array) -> tuple[Array, float]:
    """The error of a sensor that is turned about an axis by the angle that is nearest to an error, rad."""

    def of(angle: float) -> Array:
        turn: Array = scipy.spatial.transform.Rotation.from_rotvec(angle * axis).as_matrix().T
        return turn - np.eye(3)

    def off(angle: float) -> float:
        left = (error - of(angle)).ravel()
        return float(left @ information @ left)

    near = float(min(np.linspace(-np.pi, np.pi, _ANGLES), key=off))
    step = 2 * np.pi / (_ANGLES - 1)
    best = scipy.optimize.minimize_scalar(off, bounds=(near - step, near + step), method="bounded")
    return of(float(best.x)), float(best.x)
