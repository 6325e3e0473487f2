"""FRFs of motors at the gear output, where their file tells torque or motion at the motor's shaft.

With n turns of the motor per turn of the joint, a turn of the shaft is n times that of the gear output, and a
torque at the gear output n times that at the shaft.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.channel import Channel, motors_of
from identify.measured.frf_set import FrfSet
from identify.model.effects.base import Effect
from identify.model.effects.geared import Geared
from identify.robot.description import Robot


def at_gear_outputs(
    data: FrfSet, motor_side: Sequence[str], effects: Sequence[Effect], robot: Robot, where: str
) -> FrfSet:
    """The set with `torque` and `motion` of motors at the gear output, where `motor_side` names them;
    InputError for a motor whose gear ratio no effect states, or a set without motors.
    """
    if not motor_side:
        return data
    if not motors_of((*data.outputs, *data.inputs)):
        raise InputError(f"{where} motor_side", "no channel of a motor", "joint2:motor", "leave the key out")
    ratios = _ratios(effects, robot)
    out, force = np.ones(len(data.outputs)), np.ones(len(data.inputs))
    if "motion" in motor_side:
        out = 1 / _factors(data.outputs, ratios, where)
    if "torque" in motor_side:
        force = 1 / _factors(data.inputs, ratios, where)
    factor = out[:, None] * force
    return replace(
        data, frf=data.frf * factor, noise=None if data.noise is None else data.noise * np.abs(factor)
    )


def _ratios(effects: Iterable[Effect], robot: Robot) -> dict[int, float]:
    """Gear ratios by number of the joint."""
    geared = [effect for effect in effects if isinstance(effect, Geared)]
    return {
        number: ratio
        for effect in geared
        for number, ratio in zip(effect.numbers(robot), effect.gear_ratio, strict=True)
    }


def _factors(channels: Sequence[Channel], ratios: dict[int, float], where: str) -> Array:
    """(channels,): gear ratio of each that is a motor, else one."""
    for channel in channels:
        if channel.motor is not None and channel.motor not in ratios:
            raise InputError(
                f"{where} motor_side",
                f"{channel}, whose gear ratio is not stated",
                f"`gear_ratio` of a rotor-inertia or servo of joint {channel.motor}",
            )
    return np.array([1.0 if one.motor is None else ratios[one.motor] for one in channels])
