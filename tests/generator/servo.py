"""Motors that hold an arm with sampled controllers while it is struck: position, velocity and current loops
at their own periods.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, exp, pi

import mujoco
import numpy as np

from tests.generator.plant import Force, Plant
from tests.generator.rigid import Array
from tests.generator.tree import Tree

_POSITION_HZ = 4096
_VELOCITY_HZ = 16384


@dataclass(frozen=True)
class Loop:
    """A controller seen from the gear output of joint `coordinate`: rotor inertia and velocity gain times the
    gear ratio squared.

    position_gain in 1/s, integral_time in s, current_hz the bandwidth of the current loop.
    """

    coordinate: str
    velocity_gain: float
    position_gain: float
    integral_time: float
    current_hz: float


class _Controller:
    """The state of one loop: velocity command, integral of its error, torque asked for and torque there (N m
    at the output).
    """

    def __init__(self, loop: Loop) -> None:
        self.loop = loop
        self.command = self.integral = self.asked = self.torque = 0.0

    def position(self, angle: float) -> None:
        """Position loop, proportional: the arm is to stay at zero."""
        self.command = -self.loop.position_gain * angle

    def velocity(self, rate: float, period: float) -> None:
        """Velocity loop, proportional and integral."""
        error = self.command - rate
        self.integral += error * period / self.loop.integral_time
        self.asked = self.loop.velocity_gain * (error + self.integral)

    def follow(self, angle: float, rate: float, wanted: float, wanted_rate: float, period: float) -> None:
        """All three loops once, with a command that moves and its rate fed forward."""
        self.command = wanted_rate + self.loop.position_gain * (wanted - angle)
        self.velocity(rate, period)
        self.current(period)

    def carry(self, torque: float) -> None:
        """Begin with a torque (N m) that the integral holds."""
        self.integral = torque / self.loop.velocity_gain
        self.asked = self.torque = torque

    def current(self, period: float) -> None:
        """Current loop: a lag of first order."""
        self.torque += (1 - exp(-2 * pi * self.loop.current_hz * period)) * (self.asked - self.torque)


class ServoPlant(Plant):
    """A tree some of whose coordinates have no spring, only a controller; the controllers carry the weight at
    rest.
    """

    def __init__(self, tree: Tree, loops: Sequence[Loop]) -> None:
        super().__init__(tree)
        self._loops = list(loops)
        self._driven = np.array([self.coordinates.index(loop.coordinate) for loop in loops], dtype=int)
        self._controllers = [_Controller(loop) for loop in loops]
        self.rest()
        mujoco.mj_forward(self.model, self.data)
        self._hold = -self.data.qfrc_smooth[self._driven]

    def begin(self, torques: Array) -> None:
        """Fresh controllers whose integrals hold torques (loops,), N m, besides the weight."""
        self._controllers = [_Controller(loop) for loop in self._loops]
        for controller, torque in zip(self._controllers, torques, strict=True):
            controller.carry(float(torque))

    def _preload(self) -> None:
        """As the springs of other coordinates; those that a controller holds have none to preload."""
        free = self.model.jnt_stiffness == 0
        self.model.jnt_stiffness[free] = 1.0
        super()._preload()
        self.model.jnt_stiffness[free], self.model.qpos_spring[free] = 0.0, 0.0

    def load(self, sensor: str, force: Array | None, torques: bool = True) -> None:
        """As on any plant, with the controllers' torques."""
        super().load(sensor, force, torques)
        self.data.qfrc_applied[self._driven] += self._hold + [
            controller.torque for controller in self._controllers
        ]

    def respond(self, sensor: str, force: Force, until: float, step: float, steps: int) -> Array:
        """As on any plant; the controllers see the rotors' angles and rates at their own sampling times and
        act from the next step on.
        """
        self.rest()
        data, model = self.data, self.model
        model.opt.timestep = step
        self.begin(np.zeros(len(self._loops)))
        every = round(1 / (step * _POSITION_HZ)), round(1 / (step * _VELOCITY_HZ))
        result = np.empty((steps, model.nsensordata))
        driven = min(steps, ceil(until / step) + 2)
        try:
            mujoco.set_mjcb_control(
                lambda _model, _data: self.load(sensor, force(data.time) if data.time <= until else None)
            )
            for row in range(steps):
                self._control(row, every, step)
                if row >= driven:
                    mujoco.set_mjcb_control(None)
                    self.load(sensor, None)
                mujoco.mj_step(model, data)
                result[row] = data.sensordata
        finally:
            mujoco.set_mjcb_control(None)
        return np.asarray(result - result[0]).reshape(steps, -1, 3)

    def _control(self, row: int, every: tuple[int, int], step: float) -> None:
        for number, controller in zip(self._driven, self._controllers, strict=True):
            if row % every[0] == 0:
                controller.position(float(self.data.qpos[number]))
            if row % every[1] == 0:
                controller.velocity(float(self.data.qvel[number]), every[1] * step)
            controller.current(step)
