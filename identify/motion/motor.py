"""Motors: a direct-current motor with winding and back-EMF (Kawasaki Eq. 2), or one that follows a torque
command.

A `Motor*` class is what the config says; its `plant` is the same with arrays (lanes, joints), and the state
is an array beside it. Velocities and torques are the rotor's, before the gear.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Mask
from identify.core.config import Settings
from identify.motion.numbers import Number, quantity


class MotorPlant(ABC):
    """A motor whose one state per joint (lanes, joints) is the winding's current, A, or the torque, N m."""

    @abstractmethod
    def advanced(self, state: Array, command: Array, velocity: Array, step_s: float) -> Array:
        """The state a step later, with command and rotor velocity (rad/s) constant over it."""

    @abstractmethod
    def torque(self, state: Array) -> Array:
        """Torque of the rotor, N m."""

    def torque_at(self, state: Array, command: Array) -> Array:
        """Torque at the moment at which the command is given, N m; the mean of before and after where it
        jumps.
        """
        return self.torque(state)

    @abstractmethod
    def current(self, state: Array) -> Array:
        """Current of the winding, A; NaN where it is not known."""

    @abstractmethod
    def holding(self, torque: Array) -> tuple[Array, Array]:
        """State and command that hold a torque (N m) at standstill."""


class DcMotor(Settings):
    """A direct-current motor, or a synchronous one seen as such: L di/dt = U - R i - k_e omega, torque k_m
    i.
    """

    kind: Literal["dc"] = Field("dc", description="which motor: takes a voltage")
    torque_constant: Number = quantity("N m/A", "k_m", least=1e-9)
    back_emf: Number = quantity("V s/rad", "k_e")
    resistance: Number = quantity("ohm", "R of the winding", least=1e-9)
    inductance: Number = quantity("H", "L of the winding", least=1e-12)
    rotor_inertia: Number = quantity("kg m^2", "of the rotor and what turns with it", 0.0)
    viscous: Number = quantity("N m s/rad", "viscous friction at the motor shaft", 0.0)
    voltage_limit: Number = quantity("V", "largest voltage either way", np.inf)

    def plant(self, numbers: Mapping[str, Array]) -> MotorPlant:
        """With the numbers of its section, (lanes, joints) each."""
        n = {key.removeprefix("motor."): value for key, value in numbers.items() if key.startswith("motor.")}
        return _DcPlant(
            n["torque_constant"], n["back_emf"], n["resistance"], n["inductance"], n["voltage_limit"]
        )


def _within(command: Array, limit: Array) -> Array:
    """Cut to +-limit, in half the time of `np.clip`: this is done at every step."""
    return np.minimum(np.maximum(command, -limit), limit)


def _kept(step_s: float, rate: Array, by_step: dict[float, Array]) -> Array:
    """What a first-order lag of that rate, 1/s, keeps over a step; the same at every one, so found once."""
    if step_s not in by_step:
        by_step[step_s] = np.exp(-step_s * rate)
    return by_step[step_s]


@dataclass(frozen=True)
class _DcPlant(MotorPlant):
    torque_constant: Array
    back_emf: Array
    resistance: Array
    inductance: Array
    limit: Array
    _decay: dict[float, Array] = field(default_factory=dict, init=False, repr=False, compare=False)
    """Of the current over a step, by its length."""

    def advanced(self, state: Array, command: Array, velocity: Array, step_s: float) -> Array:
        """Exact for constant voltage and velocity."""
        voltage = _within(command, self.limit)
        end = (voltage - self.back_emf * velocity) / self.resistance
        kept = _kept(step_s, self.resistance / self.inductance, self._decay)
        return np.asarray(end + (state - end) * kept)

    def torque(self, state: Array) -> Array:
        return self.torque_constant * state

    def current(self, state: Array) -> Array:
        return state

    def holding(self, torque: Array) -> tuple[Array, Array]:
        current = torque / self.torque_constant
        return current, current * self.resistance


class TorqueMotor(Settings):
    """A motor with a current loop of its own that is fast and good enough to be called a torque source with a
    lag.
    """

    kind: Literal["torque"] = Field("torque", description="which motor: gives a torque")
    bandwidth_hz: Number = quantity("Hz", "of the first-order lag from command to torque", np.inf, least=1e-6)
    torque_constant: Number = quantity("N m/A", "gives the current that is reported", np.inf, least=1e-9)
    torque_gain: Number = quantity("", "torque that it gives over the one that it reports", 1.0, least=1e-9)
    rotor_inertia: Number = quantity("kg m^2", "of the rotor and what turns with it", 0.0)
    viscous: Number = quantity("N m s/rad", "viscous friction at the motor shaft", 0.0)
    torque_limit: Number = quantity("N m", "largest torque either way", np.inf)

    def plant(self, numbers: Mapping[str, Array]) -> MotorPlant:
        """With the numbers of its section, (lanes, joints) each."""
        return _TorquePlant(
            numbers["motor.bandwidth_hz"], numbers["motor.torque_constant"], numbers["motor.torque_limit"]
        )


@dataclass(frozen=True)
class _TorquePlant(MotorPlant):
    bandwidth_hz: Array
    torque_constant: Array
    limit: Array
    _decay: dict[float, Array] = field(default_factory=dict, init=False, repr=False, compare=False)
    """Of the torque over a step, by its length."""

    @cached_property
    def _at_once(self) -> Mask:
        return np.isinf(self.bandwidth_hz)

    @cached_property
    def _reported(self) -> Array:
        """A per N m of the rotor; NaN where it is not known."""
        return np.where(np.isfinite(self.torque_constant), 1 / self.torque_constant, np.nan)

    def advanced(self, state: Array, command: Array, velocity: Array, step_s: float) -> Array:
        """Exact for a constant command."""
        end = _within(command, self.limit)
        kept = _kept(step_s, 2 * np.pi * self.bandwidth_hz, self._decay)
        return np.asarray(end + (state - end) * kept)

    def torque(self, state: Array) -> Array:
        return state

    def torque_at(self, state: Array, command: Array) -> Array:
        after = np.where(self._at_once, _within(command, self.limit), state)
        return np.asarray((state + after) / 2)

    def current(self, state: Array) -> Array:
        return state * self._reported

    def holding(self, torque: Array) -> tuple[Array, Array]:
        return torque, torque


Motor = DcMotor | TorqueMotor
