"""PD and PID controllers of the motor voltage, each joint on its own (Kawasaki Eq. 3; its section 6 asks for
the integral).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from identify.core.arrays import Array
from identify.motion.controller import ControlLaw, Controller, Sample
from identify.motion.numbers import Number, quantity


class PidVoltage(Controller):
    """U = K_p e + K_d de/dt + K_i integral of e, with e the command less the measured position at the gear
    output.
    """

    kind: Literal["pid-voltage"] = "pid-voltage"
    position_gain: Number = quantity("V/rad", "K_p", least=1e-12)
    derivative_gain: Number = quantity("V s/rad", "K_d", 0.0)
    integral_gain: Number = quantity("V/(rad s)", "K_i; 0 is a PD controller", 0.0)

    @property
    def gives(self) -> str:
        """A voltage."""
        return "voltage"

    def law(self, numbers: Mapping[str, Array]) -> PidLaw:
        """With its three gains."""
        position, derivative, integral = (
            numbers[f"servo.{key}_gain"] for key in ("position", "derivative", "integral")
        )
        return PidLaw(position, derivative, integral, numbers["motor.voltage_limit"], self.period_s)


@dataclass(frozen=True)
class PidState:
    """The error at the last tick, rad, and the integral term, V."""

    error: Array
    integral: Array


@dataclass(frozen=True)
class PidLaw(ControlLaw):
    """The law with gains (lanes, joints)."""

    position_gain: Array
    derivative_gain: Array
    integral_gain: Array
    limit: Array
    period_s: float

    def standing_error(self, holding: Array) -> Array:
        """None with integral action; the share of K_p without."""
        return np.where(self.integral_gain > 0, 0.0, holding / self.position_gain)

    def begin(self, sample: Sample, holding: Array) -> PidState:
        """The integral term holds what K_p does not."""
        error = sample.position - sample.turn
        integral = np.where(self.integral_gain > 0, holding - self.position_gain * error, 0.0)
        return PidState(error, integral)

    def act(self, state: PidState, sample: Sample) -> tuple[Array, PidState]:
        """The integral stops where the voltage is at its limit."""
        error = sample.position - sample.turn
        change = self.derivative_gain * (error - state.error) / self.period_s
        integral = state.integral + self.integral_gain * self.period_s * error
        command = self.position_gain * error + change + integral
        integral = np.where(np.abs(command) < self.limit, integral, state.integral)
        return command, PidState(error, integral)
