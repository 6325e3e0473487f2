"""A tree in MuJoCo: preloaded so that it rests at its posture, struck, and integrated by Runge-Kutta of fourth order.

Weight acts as a constant force at every centre of mass, so accelerometers read kinematic acceleration; where `weighed`, gravity is
MuJoCo's own and they feel it too, less their reading at rest, as AC-coupled sensors do.
RK4 damps a mode of angular frequency w by (w h)^6 / 144 per step h and lowers its frequency by a share of (w h)^4 / 120.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from tests.generator.effect import TorqueEffect
from tests.generator.rigid import Array
from tests.generator.tree import Dof, Tree

Force = Callable[[float], Array]
"""Force (3,), N, at a time (s), in the axes of the struck sensor."""


class Plant:
    """A compiled tree at rest, with the nonlinear torques of its joints."""

    def __init__(self, tree: Tree, torques: Sequence[TorqueEffect] = (), weighed: bool = False) -> None:
        self.model = _compile(tree)
        self.data = mujoco.MjData(self.model)
        self.coordinates = [dof.name for part in tree.parts for dof in part.dofs]
        self._torques = [(self.coordinates.index(f"joint{effect.joint}.rz"), effect) for effect in torques]
        self._weight = np.zeros((self.model.nbody, 3))
        if weighed:
            self.model.opt.gravity = tree.gravity
        else:
            self._weight = self.model.body_mass[:, None] * tree.gravity
        self._preload()

    def rest(self) -> None:
        """Back to zero displacement, where all forces balance."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.xfrc_applied[:, :3] = self._weight

    def strike(self, sensor: str, force: Force) -> None:
        """Apply a force at a sensor, for the present state and time of the data."""
        data, site = self.data, self.data.site(sensor)
        body = int(self.model.site_bodyid[site.id])
        world = site.xmat.reshape(3, 3) @ force(data.time)
        mujoco.mj_applyFT(self.model, data, world, np.zeros(3), site.xpos, body, data.qfrc_applied)

    def respond(self, sensor: str, force: Force, until: float, step: float, steps: int) -> Array:
        """Accelerations (steps, sensors, 3), m/s^2, in sensor axes, row n at time n * step (s), of a force that is zero after `until`.

        The motion begins at rest.
        """
        self.rest()
        data, model = self.data, self.model
        model.opt.timestep = step
        result = np.empty((steps, model.nsensordata))

        def drive(_model: mujoco.MjModel, _data: mujoco.MjData) -> None:
            data.qfrc_applied[:] = 0.0
            if data.time <= until:
                self.strike(sensor, force)
            for number, effect in self._torques:
                data.qfrc_applied[number] += effect.torque(data.qpos[number], data.qvel[number])

        try:
            mujoco.set_mjcb_control(drive)
            for row in range(steps):
                if data.time > until + step and not self._torques:
                    mujoco.set_mjcb_control(None)
                mujoco.mj_step(model, data)
                result[row] = data.sensordata
        finally:
            mujoco.set_mjcb_control(None)
        return (result - result[0]).reshape(steps, -1, 3)

    def _preload(self) -> None:
        """Shift the springs' zeros until nothing moves at zero displacement."""
        self.rest()
        mujoco.mj_forward(self.model, self.data)
        self.model.qpos_spring[:] -= self.data.qacc_smooth_force if False else self.data.qfrc_smooth / self.model.jnt_stiffness


def _compile(tree: Tree) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.gravity = np.zeros(3)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    bodies: list[mujoco.MjsBody] = []
    for part in tree.parts:
        parent = spec.worldbody if part.parent < 0 else bodies[part.parent]
        bodies.append(_body(parent, part))
    return spec.compile()
