"""Recorded motion fed into a model: the drives go where they were, and torques and currents are what that
takes by inverse dynamics (Kawasaki, Table 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.measured.conditioning import moved
from identify.measured.records import MotionRecord
from identify.model.laws.friction import EXPONENTIAL, smooth_sign, stribeck_decay
from identify.motion.simulate import Plant, SimulatedMotion


@dataclass(frozen=True)
class FedMotion:
    """What the drives did at the controller's ticks, (ticks, joints): rad, rad/s, rad/s^2."""

    position: Array
    velocity: Array
    acceleration: Array


def fed_motion(read: MotionRecord, lowpass_hz: float, start: Array, time: Array, where: str) -> FedMotion:
    """The recorded motor positions at ticks (n,), s, and their derivatives up to a frequency, of recorded
    speeds where there are any; joints of which none was recorded stand still at `start`.

    InputError without motor positions, or where the frequency is not below half the sample rate.
    """
    position = read.signal("motor_position")
    if not 0 < lowpass_hz < read.sample_rate_hz / 2:
        found = f"{lowpass_hz:g} Hz at {read.sample_rate_hz:g} samples a second"
        raise InputError(
            f"{where}.recorded_motion_hz", found, f"a frequency below {read.sample_rate_hz / 2:g} Hz"
        )
    velocity, acceleration = moved(
        position, read.signals.get("motor_velocity"), lowpass_hz, read.sample_rate_hz
    )
    still = np.isnan(position).any(axis=0)
    told = (
        np.where(still, start, position),
        np.where(still, 0.0, velocity),
        np.where(still, 0.0, acceleration),
    )
    return FedMotion(*(_at(rows, read.time_s, time) for rows in told))


def _at(rows: Array, times: Array, ticks: Array) -> Array:
    return np.stack([np.interp(ticks, times, column) for column in rows.T], axis=1)


def fed(plant: Plant, motion: FedMotion) -> SimulatedMotion:
    """What a motion takes of the motors of a rigid arm, in every lane."""
    numbers, more = plant.numbers, plant.numbers["bodies.mass"]
    lanes, shape = len(more), motion.position.shape
    links = np.empty((lanes, *shape))
    links[:] = plant.arm.inverse_dynamics(motion.position, motion.velocity, motion.acceleration)
    for lane in np.flatnonzero(more.any(axis=1)):
        with plant.arm.heavier(more[lane]):
            links[lane] = plant.arm.inverse_dynamics(motion.position, motion.velocity, motion.acceleration)
    n = {key: value[:, None] for key, value in numbers.items()}
    rotors = n["gear.ratio"] ** 2 * n["motor.rotor_inertia"] * motion.acceleration
    balance = n["balancer.sine"] * np.sin(motion.position) + n["balancer.cosine"] * np.cos(motion.position)
    torque = links + rotors + _friction(plant, motion.velocity) - balance
    torque /= plant.gain[:, None]
    state, command = _each(plant, torque / n["gear.ratio"])
    current = np.stack([plant.motor.current(row) for row in np.moveaxis(state, 1, 0)], axis=1)
    turn, speed = (np.tile(rows, (lanes, 1, 1)) for rows in (motion.position, motion.velocity))
    return SimulatedMotion(turn, speed, current, torque, command)


def _friction(plant: Plant, velocity: Array) -> Array:
    """Friction of the drives, N m, (lanes, ticks, joints), at velocities (ticks, joints)."""
    n = {key: value[:, None] for key, value in plant.numbers.items()}
    decay = stribeck_decay(velocity, n["friction.stribeck_velocity"], EXPONENTIAL)
    dry = n["friction.coulomb"] + n["friction.stribeck"] * decay
    sign = smooth_sign(velocity, n["friction.creep_velocity"], plant.smoothing)
    viscous = n["friction.viscous"] + n["gear.ratio"] ** 2 * n["motor.viscous"]
    return np.asarray(dry * sign + viscous * velocity)


def _each(plant: Plant, torque: Array) -> tuple[Array, Array]:
    """States and commands of motors that hold torques (lanes, ticks, joints), N m."""
    rows = [plant.motor.holding(row) for row in np.moveaxis(torque, 1, 0)]
    state, command = (np.stack(part, axis=1) for part in zip(*rows, strict=True))
    return state, command
