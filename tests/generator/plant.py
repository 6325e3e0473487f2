"""A tree in MuJoCo: preloaded so that it rests at its posture, struck, and integrated by Runge-Kutta of
fourth order.

Weight acts as a constant force at every centre of mass, so accelerometers read kinematic acceleration; where
`weighed`, gravity is MuJoCo's own and they feel it too, less their reading at rest, as AC-coupled sensors do.
RK4 damps a mode of angular frequency w by (w h)^6 / 144 per step h and lowers its frequency by a share of (w
h)^4 / 120.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil

import mujoco
import numpy as np

from tests.generator.effect import TorqueEffect
from tests.generator.rigid import Array
from tests.generator.tree import Part, Tree

Force = Callable[[float], Array]
"""Force (3,), N, at a time (s), in the axes of the struck sensor."""
_STRUT_LENGTH = 2.0


class Plant:
    """A compiled tree at rest, with the nonlinear torques of its joints."""

    def __init__(self, tree: Tree, torques: Sequence[TorqueEffect] = (), weighed: bool = False) -> None:
        self.model = _compile(tree)
        self.data = mujoco.MjData(self.model)
        # The engine takes longer to hand these over than most of what is done with them at every step.
        self._turn, self._speed, self._applied = self.data.qpos, self.data.qvel, self.data.qfrc_applied
        self.sensors = [sensor.name for sensor in tree.sensors]
        self.coordinates = [self.model.joint(number).name for number in range(self.model.nv)]
        self._torques = [(self.coordinates.index(f"joint{effect.joint}.rz"), effect) for effect in torques]
        self._memory = [effect.start() for _, effect in self._torques]
        self._body_of = {name: int(self.model.site(name).bodyid[0]) for name in self.sensors}
        self._weight = np.zeros((self.model.nbody, 3))
        if weighed:
            self.model.opt.gravity = tree.gravity
        else:
            self._weight = self.model.body_mass[:, None] * tree.gravity
        self._preload()

    def rest(self) -> None:
        """Back to zero displacement, where all forces balance."""
        mujoco.mj_resetData(self.model, self.data)
        self._memory = [effect.start() for _, effect in self._torques]
        self.data.xfrc_applied[:, :3] = self._weight

    def load(self, sensor: str, force: Array | None, torques: bool = True) -> None:
        """Apply a force (3,), N, at a sensor along its axes, and the nonlinear torques, at the present state
        of the data.
        """
        data = self.data
        self._applied[:] = 0.0
        if force is not None:
            site = data.site(sensor)
            world = site.xmat.reshape(3, 3) @ force
            mujoco.mj_applyFT(
                self.model, data, world, np.zeros(3), site.xpos, self._body_of[sensor], self._applied
            )
        for (number, effect), memory in zip(self._torques, self._memory, strict=True) if torques else ():
            self._applied[number] += effect.torque(self._turn[number], self._speed[number], memory)

    def respond(self, sensor: str, force: Force, until: float, step: float, steps: int) -> Array:
        """Accelerations (steps, sensors, 3), m/s^2, in sensor axes, row n at time n * step (s), of a force
        that is zero after `until`.

        The motion begins at rest.
        """
        self.rest()
        data, model = self.data, self.model
        model.opt.timestep = step
        result, read = np.empty((steps, model.nsensordata)), data.sensordata
        driven = steps if self._torques else min(steps, ceil(until / step) + 2)
        try:
            mujoco.set_mjcb_control(
                lambda _model, _data: self.load(sensor, force(data.time) if data.time <= until else None)
            )
            for row in range(steps):
                if row == driven:  # nothing acts from outside any more, and the calls back take time
                    mujoco.set_mjcb_control(None)
                mujoco.mj_step(model, data)
                if self._torques:
                    self._memory = [
                        effect.after(self._turn[number], memory)
                        for (number, effect), memory in zip(self._torques, self._memory, strict=True)
                    ]
                result[row] = read
        finally:
            mujoco.set_mjcb_control(None)
        return np.asarray(result - result[0]).reshape(steps, -1, 3)

    def _preload(self) -> None:
        """Shift the springs' zeros until nothing moves at zero displacement."""
        self.rest()
        mujoco.mj_forward(self.model, self.data)
        self.model.tendon_lengthspring[:] = self.data.ten_length[:, None]
        mujoco.mj_forward(self.model, self.data)
        self.model.qpos_spring[:] = -self.data.qfrc_smooth / self.model.jnt_stiffness


def _compile(tree: Tree) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.gravity = np.zeros(3)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    bodies: dict[int, mujoco.MjsBody] = {-1: spec.worldbody}
    for number in tree.order():
        bodies[number] = _body(bodies[tree.parts[number].parent], tree.parts[number])
    for sensor in tree.sensors:
        bodies[sensor.part].add_site(name=sensor.name, pos=sensor.position)
        reading = {"type": mujoco.mjtSensor.mjSENS_ACCELEROMETER, "objtype": mujoco.mjtObj.mjOBJ_SITE}
        spec.add_sensor(name=sensor.name, objname=sensor.name, **reading)
    for number, strut in enumerate(tree.struts):
        rotation, position = tree.pose(strut.part)
        anchor = position + rotation @ strut.position + _STRUT_LENGTH * strut.direction
        spec.worldbody.add_site(name=f"anchor{number}", pos=anchor)
        bodies[strut.part].add_site(name=f"strut{number}", pos=strut.position)
        tendon = spec.add_tendon(name=f"strut{number}")
        tendon.wrap_site(f"strut{number}")
        tendon.wrap_site(f"anchor{number}")
    model = spec.compile()
    for part in tree.parts:
        for dof in part.dofs:
            number = model.joint(dof.name).id
            model.jnt_stiffness[number], model.dof_damping[number] = dof.stiffness, dof.damping
    model.tendon_stiffness[:] = [strut.stiffness for strut in tree.struts]
    model.tendon_damping[:] = [strut.damping for strut in tree.struts]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _body(parent: mujoco.MjsBody, part: Part) -> mujoco.MjsBody:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, part.rotation.ravel())
    body = parent.add_body(name=part.name, pos=part.position, quat=quaternion)
    body.explicitinertial = True
    body.mass, body.ipos = part.inertia.mass, part.inertia.centre
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = part.inertia.tensor
    body.fullinertia = [xx, yy, zz, xy, xz, yz]
    for dof in part.dofs:
        kind = mujoco.mjtJoint.mjJNT_SLIDE if dof.slides else mujoco.mjtJoint.mjJNT_HINGE
        # The armature at once: without it, coordinates in series about one axis are a singular mass matrix.
        body.add_joint(name=dof.name, type=kind, axis=dof.axis, armature=dof.armature)
    return body
