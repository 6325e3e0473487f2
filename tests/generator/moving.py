"""An arm that moves along a path while something shakes it: controllers follow a ramp, motors have friction,
sensors ride along.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from tests.generator.rigid import Array
from tests.generator.servo import Loop, ServoPlant
from tests.generator.tree import Tree

Push = Callable[[float], Array]
"""Force (3,), N, at a time (s), in the axes of the body it acts on."""
_SETTLE_S = 1.5
_TRANSITION = 2e-3
"""Speed (rad/s at the gear output) below which Coulomb friction is still building up."""


@dataclass(frozen=True)
class Ride:
    """What was recorded, a row a step: accelerations (steps, sensors, 3), m/s^2, in sensor axes, and the
    forces of the watched coordinates' springs and dampers (steps, watched), N, both less their means before
    anything pushed.
    """

    acceleration: Array
    spring_force: Array


class MovingPlant(ServoPlant):
    """Rotors follow angle = rate * (t - middle); friction (N m at the gear output) of the motors acts against
    their turning.
    """

    def __init__(self, tree: Tree, loops: Sequence[Loop], friction: Sequence[float]) -> None:
        super().__init__(tree, loops)
        self._friction = np.asarray(friction, dtype=float)

    def ride(
        self, site: str, push: Push, rates: Array, step: float, steps: int, watched: Sequence[str]
    ) -> Ride:
        """Move with rotor rates (loops,), rad/s, pushed at a site along the axes of its body; the path's
        middle is the tree's posture.

        Time begins after _SETTLE_S, in which what the start has stirred up dies out.
        """
        self.rest()
        data, model = self.data, self.model
        model.opt.timestep = step
        middle, numbers = step * steps / 2, [self.coordinates.index(name) for name in watched]
        self._start(rates, middle + _SETTLE_S)
        motion, force = np.empty((steps, model.nsensordata)), np.empty((steps, len(watched)))
        for row in range(-round(_SETTLE_S / step), steps):
            for number, controller, rate in zip(self._driven, self._controllers, rates, strict=True):
                controller.follow(
                    float(data.qpos[number]),
                    float(data.qvel[number]),
                    rate * (row * step - middle),
                    rate,
                    step,
                )
            self._act(site, push((row + 0.5) * step) if row >= 0 else np.zeros(3))
            mujoco.mj_step(model, data)
            if row >= 0:
                motion[row] = data.sensordata
                force[row] = data.qfrc_passive[numbers]
        return Ride(motion.reshape(steps, -1, 3), force)

    def _act(self, site: str, force: Array) -> None:
        """What acts during a step: the force in the middle of it, so that holding it makes no delay."""
        data, place = self.data, self.data.site(site)
        data.qfrc_applied[:] = 0.0
        world = place.xmat.reshape(3, 3) @ force
        mujoco.mj_applyFT(
            self.model,
            data,
            world,
            np.zeros(3),
            place.xpos,
            int(self.model.site(site).bodyid[0]),
            data.qfrc_applied,
        )
        turning = data.qvel[self._driven]
        driven = [c.torque for c in self._controllers] - self._friction * np.tanh(turning / _TRANSITION)
        data.qfrc_applied[self._driven] += self._hold + driven

    def _start(self, rates: Array, middle: float) -> None:
        """On the path and at speed, the integrals carrying friction already."""
        self.data.qpos[self._driven], self.data.qvel[self._driven] = -rates * middle, rates
        self.begin(self._friction * np.tanh(rates / _TRANSITION))
