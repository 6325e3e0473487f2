"""The cascade of industrial servos: position P, velocity PI and, for a motor that wants a voltage, current
PI, each at its own rate.

Feed-forward of the commanded velocity and of the torque by inverse dynamics (Nagoya section 5, the
conventional controller).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.motion.controller import ControlLaw, Controller, Sample
from identify.motion.numbers import Number, quantity


class Cascade(Controller):
    """Position P, velocity PI, and current PI where `output` is a voltage; the period is that of the
    innermost loop.
    """

    kind: Literal["cascade"] = "cascade"
    output: Literal["torque", "voltage"] = Field(
        "torque", description="what the motor is given: `voltage` needs the current loop"
    )
    velocity_every: int = Field(1, ge=1, description="ticks between two runs of the velocity loop")
    position_every: int = Field(1, ge=1, description="ticks between two runs of the position loop")
    position_gain: Number = quantity("1/s", "commanded velocity per position error", least=1e-12)
    velocity_gain: Number = quantity("N m s/rad", "torque at the gear output per velocity error")
    velocity_integral: Number = quantity("1/s", "the inverse of the velocity loop's integral time", 0.0)
    velocity_feedforward: Number = quantity("", "share of the commanded velocity", 0.0)
    torque_feedforward: Number = quantity(
        "", "share of the torque that the command takes by inverse dynamics", 0.0
    )
    current_gain: Number = quantity("V/A", "of the current loop", 0.0)
    current_integral: Number = quantity("1/s", "the inverse of the current loop's integral time", 0.0)

    @property
    def gives(self) -> str:
        """As `output` says."""
        return self.output

    def law(self, numbers: Mapping[str, Array]) -> ControlLaw:
        """With its gains and what turns torque at the gear output into the motor's."""
        return self.cascade(numbers)

    def cascade(self, numbers: Mapping[str, Array]) -> CascadeLaw:
        """The three loops."""
        own = {
            key.removeprefix("servo."): value for key, value in numbers.items() if key.startswith("servo.")
        }
        winding = None
        if self.output == "voltage":
            winding = Winding(
                numbers["motor.torque_constant"],
                own["current_gain"],
                own["current_integral"],
                numbers["motor.voltage_limit"],
            )
        limit = numbers.get("motor.torque_limit", np.full_like(own["position_gain"], np.inf))
        return CascadeLaw(self, own, numbers["gear.ratio"], limit, winding)


@dataclass(frozen=True)
class Winding:
    """What the current loop needs: k_m, its gains, and the largest voltage."""

    torque_constant: Array
    gain: Array
    integral: Array
    limit: Array


@dataclass(frozen=True)
class CascadeState:
    """Velocity asked for (rad/s), turn at the last velocity run, its integral and torque (N m, gear output),
    and the voltage integral.
    """

    wanted: Array
    turn: Array
    integral: Array
    torque: Array
    voltage: Array


@dataclass(frozen=True)
class CascadeLaw(ControlLaw):
    """The law with gains by name, (lanes, joints)."""

    settings: Cascade
    gains: Mapping[str, Array]
    ratio: Array
    limit: Array
    winding: Winding | None

    def standing_error(self, holding: Array) -> Array:
        """None: the integral holds; without one, what the proportional gains leave."""
        torque = self.ratio * (holding if self.winding is None else np.zeros_like(holding))
        stiffness = self.gains["position_gain"] * self.gains["velocity_gain"]
        leaves = (
            (self.gains["velocity_integral"] == 0) & (self.gains["torque_feedforward"] == 0) & (stiffness > 0)
        )
        return np.where(leaves, torque / np.where(stiffness > 0, stiffness, 1.0), 0.0)

    def begin(self, sample: Sample, holding: Array) -> CascadeState:
        """The integrals hold."""
        current = sample.current
        torque = self.ratio * (holding if self.winding is None else self.winding.torque_constant * current)
        wanted = self.gains["position_gain"] * (sample.position - sample.turn)
        integral = (
            torque
            - self.gains["torque_feedforward"] * sample.feedforward
            - self.gains["velocity_gain"] * wanted
        )
        return CascadeState(wanted, sample.turn, integral, torque, holding)

    def act(self, state: CascadeState, sample: Sample) -> tuple[Array, CascadeState]:
        """The loops that are due at this tick, from the outermost in."""
        if sample.tick % self.settings.position_every == 0:
            ahead = self.gains["velocity_feedforward"] * sample.velocity
            wanted = self.gains["position_gain"] * (sample.position - sample.turn) + ahead
            state = CascadeState(wanted, state.turn, state.integral, state.torque, state.voltage)
        if sample.tick % self.settings.velocity_every == 0:
            state = self._velocity_loop(state, sample)
        if self.winding is None:
            return state.torque / self.ratio, state
        return self._current_loop(self.winding, state, sample)

    def _velocity_loop(self, state: CascadeState, sample: Sample) -> CascadeState:
        period = self.settings.velocity_every * self.settings.period_s
        error = state.wanted - (sample.turn - state.turn) / period
        integral = state.integral + self._integrated * error
        torque = (
            self.gains["velocity_gain"] * error
            + integral
            + self.gains["torque_feedforward"] * sample.feedforward
        )
        integral = np.where(np.abs(torque) < self._most, integral, state.integral)
        return CascadeState(state.wanted, sample.turn, integral, torque, state.voltage)

    @cached_property
    def _integrated(self) -> Array:
        """By which the integral grows at each run of the velocity loop, over its error."""
        period = self.settings.velocity_every * self.settings.period_s
        return self.gains["velocity_gain"] * self.gains["velocity_integral"] * period

    @cached_property
    def _most(self) -> Array:
        """The largest torque either way, at the gear output."""
        return self.limit * self.ratio

    def _current_loop(
        self, winding: Winding, state: CascadeState, sample: Sample
    ) -> tuple[Array, CascadeState]:
        error = state.torque / (self.ratio * winding.torque_constant) - sample.current
        integral = state.voltage + winding.gain * winding.integral * self.settings.period_s * error
        command = winding.gain * error + integral
        integral = np.where(np.abs(command) < winding.limit, integral, state.voltage)
        return command, replace(state, voltage=integral)
