"""A mechanism in motion: forward dynamics, time integration and inverse dynamics by the engine (MuJoCo), for
many copies at once.

Every joint has the coordinate `jointN.drive`, the turn of its drive seen at the gear output, and after it
whatever elastic coordinates were asked for (`joint2.rz`, `base.rx`), small displacements in the joint frame,
which turns with the drive.  So the link is at drive + rz, and a rotor's inertia n^2 J sits on the drive
alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np

from identify.core.arrays import Array, Index, Mask
from identify.robot.description import Robot
from identify.robot.engine import DRIVE_ARMATURE, compile_mechanism
from identify.robot.posture import AXES, Body, at_posture, hinged

_PASSES = 2
"""Passes that find dampers which depend on velocity, each of which may learn from what the last gave."""
_DIFFERENCE = 1e-6
"""Of position, velocity and acceleration, for what inverse dynamics changes with them."""
_HALF = ("tx", "ty", "rx", "ry", "rz")
"""Coordinates of the far part of a link, z along it."""
_RUNAWAY = 1e3
"""Velocity, rad/s or m/s, that no arm reaches: the controller is unstable."""


class MovingArm:
    """A robot compiled for motion with the elastic coordinates of that name released; all others are rigid.

    names (n,): coordinates in the engine's order; drive (joints,): their numbers for the drives; elastic: the
    others'.  halves: the far part of links by their names, poses in the link's frame, which turns against the
    near one about its own three axes and moves across the third, `link1.rx` and so on of the link behind
    joint 1.
    """

    def __init__(
        self, robot: Robot, released: Sequence[str] = (), halves: Mapping[str, Body] | None = None
    ) -> None:
        self.robot = robot
        self.mechanism = at_posture(robot, np.zeros(len(robot.joints)))
        for name in released:
            self.mechanism.coordinate(name, "effects")
        axes: dict[str, list[str]] = {}
        for body in self.mechanism.bodies:
            elastic = [axis for axis in AXES if f"{body.name}.{axis}" in released]
            axes[body.name] = elastic if body.name == "base" else ["drive", *elastic]
        for link, far in (halves or {}).items():
            self.mechanism = hinged(self.mechanism, link, far)
        axes = {body.name: axes.get(body.name, list(_HALF)) for body in self.mechanism.bodies}
        self._axes = axes
        self.model = self.copies(1)
        self.names = tuple(f"{body}.{axis}" for body, own in axes.items() for axis in own)
        self.drive = np.array(
            [self.names.index(f"joint{number + 1}.drive") for number in range(len(robot.joints))], dtype=int
        )
        self.elastic = np.array(
            [number for number in range(len(self.names)) if number not in self.drive], dtype=int
        )
        self._data = mujoco.MjData(self.model)

    def copies(self, lanes: int) -> mujoco.MjModel:
        """The engine's model of so many copies of the arm in one place: one step moves them all, which saves
        most of the cost of each.
        """
        return compile_mechanism(self.mechanism, self._axes, lanes)

    @contextmanager
    def heavier(self, more: Array) -> Iterator[None]:
        """For as long as it lasts, the bodies behind the joints are heavier by shares (joints,)."""
        mass, inertia = self.model.body_mass.copy(), self.model.body_inertia.copy()
        _load(self.model, more[None])
        try:
            yield
        finally:
            self.model.body_mass[:], self.model.body_inertia[:] = mass, inertia
            mujoco.mj_setConst(self.model, mujoco.MjData(self.model))

    def mass_matrix(self, position: Array) -> Array:
        """M (n, n) at coordinates (n,), without rotors."""
        self._data.qpos[:] = position
        mujoco.mj_fwdPosition(self.model, self._data)
        mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self._data, mass)
        mass[self.drive, self.drive] -= DRIVE_ARMATURE
        return mass

    def inverse_dynamics(self, position: Array, velocity: Array, acceleration: Array) -> Array:
        """Forces (..., n) on the coordinates for a motion (..., n) each, without rotors, springs and
        dampers.
        """
        shape, n = position.shape, position.shape[-1]
        forces = np.empty((position.size // n, n))
        rows = zip(
            position.reshape(-1, n), velocity.reshape(-1, n), acceleration.reshape(-1, n), forces, strict=True
        )
        for q, v, a, force in rows:
            self._data.qpos[:], self._data.qvel[:], self._data.qacc[:] = q, v, a
            mujoco.mj_inverse(self.model, self._data)
            force[:] = self._data.qfrc_inverse
        forces[:, self.drive] -= DRIVE_ARMATURE * acceleration.reshape(-1, n)[:, self.drive]
        return forces.reshape(shape)

    def frame_position(self, position: Array, frame: str, point: Array) -> Array:
        """Where a point (3,) of a frame is in the base's axes, m, (..., 3), at coordinates (..., n)."""
        body, inside = self._fixed(frame, point)
        places = np.empty((position.size // position.shape[-1], 3))
        for q, place in zip(position.reshape(-1, position.shape[-1]), places, strict=True):
            self._data.qpos[:] = q
            mujoco.mj_kinematics(self.model, self._data)
            place[:] = self._data.xpos[body] + self._data.xmat[body].reshape(3, 3) @ inside
        return places.reshape(*position.shape[:-1], 3)

    def frame_motion(self, position: Array, frame: str, point: Array) -> tuple[Array, Array, Array]:
        """Of a point (3,) of a frame at coordinates (n,): its place (3,), m, the turn (3, 3) of its body, and
        the Jacobian (6, n) of its velocity and of the body's angular velocity, all in the base's axes.
        """
        body, inside = self._fixed(frame, point)
        self._data.qpos[:] = position
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
        turn = self._data.xmat[body].reshape(3, 3).copy()
        place = self._data.xpos[body] + turn @ inside
        linear, angular = np.zeros((2, 3, self.model.nv))
        mujoco.mj_jac(self.model, self._data, linear, angular, place, body)
        return place, turn, np.vstack([linear, angular])

    def _fixed(self, frame: str, point: Array) -> tuple[int, Array]:
        """The engine's number of the body that carries a frame, 0 the ground, and a point (3,) of the frame
        in the body's axes.
        """
        body, pose = self.mechanism.frame(frame, "points")
        number = 0 if body < 0 else int(self.model.body(self.mechanism.bodies[body].name).id)
        return number, pose[:3, :3] @ point + pose[:3, 3]


class Tangent:
    """Equations of motion of an arm, its bodies heavier by shares more (joints,), to first order; heavier:
    joints (from 0) whose bodies may be heavier beyond that.
    """

    def __init__(self, arm: MovingArm, more: Array, heavier: Index) -> None:
        self._drive, self.heavier = arm.drive, heavier
        self._model, self._more = arm.copies(1), [arm.copies(1) for _ in heavier]
        _load(self._model, more[None])
        for model, joint in zip(self._more, heavier, strict=True):
            _load(model, (more + np.eye(len(more))[joint])[None])
        self._data = mujoco.MjData(self._model)

    def at(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, ...]:
        """At a motion (n,) each: the mass matrix; rows of what a unit of each coordinate, and of its
        velocity, changes the forces by; mass matrix (heavier, n, n) and forces (heavier, n) without
        acceleration of what bodies behind joints have more, for a share of one.
        """
        data, size = self._data, self._model.nv
        data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, acceleration
        by_position, by_velocity, mass = np.zeros((3, size, size))
        mujoco.mjd_inverseFD(
            self._model, data, _DIFFERENCE, False, by_position, by_velocity, mass, None, None, None, None
        )
        mass[self._drive, self._drive] -= DRIVE_ARMATURE
        own = self._loads(self._model, position, velocity) if len(self._more) else None
        masses, weights = np.zeros((len(self._more), size, size)), np.zeros((len(self._more), size))
        for number, model in enumerate(self._more):
            heavy = self._loads(model, position, velocity)
            assert own is not None
            masses[number], weights[number] = heavy[0] - own[0], heavy[1] - own[1]
        return mass, by_position, by_velocity, masses, weights

    def _loads(self, model: mujoco.MjModel, position: Array, velocity: Array) -> tuple[Array, Array]:
        """Mass matrix of a model, rotors and all, and the forces that it takes without acceleration."""
        data, mass = self._data, np.zeros((model.nv, model.nv))
        data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, 0.0
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, mass)
        mujoco.mj_inverse(model, data)
        return mass, data.qfrc_inverse.copy()


def _load(model: mujoco.MjModel, more: Array) -> None:
    """Make bodies behind the joints of each copy heavier by shares (m, joints), inertia and all."""
    for lane, row in enumerate(more):
        for joint in np.flatnonzero(row):
            for name in (f"joint{joint + 1}", f"link{joint + 1}"):  # and its far half, where it bends
                body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, f"{lane}." * bool(lane) + name)
                if body >= 0:
                    model.body_mass[body] *= 1 + row[joint]
                    model.body_inertia[body] *= 1 + row[joint]
    mujoco.mj_setConst(model, mujoco.MjData(model))


@dataclass(frozen=True)
class Passive:
    """What hangs on the coordinates of each of m copies, (m, n): armature (kg m^2), stiffness (N m/rad, N/m),
    damping.
    """

    armature: Array
    stiffness: Array
    damping: Array


class Lanes:
    """Copies of an arm that move side by side, each with its own passive elements, from rest at position (m,
    n).

    more (m, joints): shares by which the bodies behind the joints are heavier.

    Leapfrog: position is at the time reached, velocity half a step before it.  Forces of velocity are those
    of the velocity extrapolated to the time reached, so that all is of second order but dampers, which are
    implicit: they act on the velocity after the step, and so hold however strong they are.  `force` (m, n) is
    for the step to come.
    """

    def __init__(
        self,
        arm: MovingArm,
        passive: Passive,
        position: Array,
        step_s: float,
        more: Array | None = None,
    ) -> None:
        self.step_s, self._passive = step_s, passive
        self.position, self.velocity = position.copy(), np.zeros_like(position)
        self.force = np.zeros_like(position)
        self._before: Array | None = None
        self._lost: Mask | None = None
        self._model = arm.copies(len(position))
        if more is not None and more.any():
            _load(self._model, more)
        self._model.opt.timestep = step_s
        self._model.dof_armature[:], self._model.jnt_stiffness[:] = (
            passive.armature.ravel(),
            passive.stiffness.ravel(),
        )
        self._data = mujoco.MjData(self._model)
        values = self._data.qpos, self._data.qvel, self._data.qfrc_applied, self._model.dof_damping
        self._values = tuple(one.reshape(position.shape) for one in values)
        """Position, velocity, force and damping (m, n) as the engine has them."""

    def advance(self, dampers: Callable[[Array], Array] | None = None) -> None:
        """One step; a lane that runs away is NaN from then on.

        dampers: further dampers (m, n) as a function of the velocities (m, n) that they act on, such as dry
        friction over velocity; they are found for the velocity after the step by as many passes as `_PASSES`.
        """
        before = self._rest() if self._before is None else self._before
        ahead = (self.velocity - before) / 2
        self._before = velocity = self.velocity
        for _ in range(1 if dampers is None else _PASSES):
            damping = self._passive.damping if dampers is None else self._passive.damping + dampers(velocity)
            # The engine damps the velocity it is given, which is the guess; it is to damp the one half a step
            # ago.
            position, guessed = self._stepped(
                self.position, self._before + ahead, self.force + damping * ahead, damping
            )
            velocity = guessed - ahead
        self.velocity, self.position = velocity, position - self.step_s * ahead
        inside = np.abs(self.velocity) < _RUNAWAY
        if self._lost is not None or not inside.all():
            self._lost = np.asarray(~inside.all(axis=1))  # what is NaN once stays so
            self.position[self._lost] = self.velocity[self._lost] = np.nan

    def _stepped(self, position: Array, velocity: Array, force: Array, damping: Array) -> tuple[Array, Array]:
        """The engine's step from given positions and velocities; lanes that are lost stand still."""
        own = self._values
        own[0][:], own[1][:], own[2][:], own[3][:] = position, velocity, force, damping
        if self._lost is not None:
            for target in own:
                target[self._lost[: len(position)]] = 0.0
        mujoco.mj_step(self._model, self._data)
        return self._values[0].copy(), self._values[1].copy()

    def _rest(self) -> Array:
        """Sets the velocity half a step before now, and returns that another step before, of a motion at rest
        now under its forces.
        """
        data = self._data
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = self.position.ravel(), 0.0, self.force.ravel()
        mujoco.mj_forward(self._model, data)
        self.velocity = -self.step_s / 2 * data.qacc.reshape(self.position.shape)
        return np.asarray(3 * self.velocity)

    def energy(self) -> float:
        """Kinetic and potential energy of all lanes, J, springs and rotors included: velocity of half a step
        ago, position of now.
        """
        self._data.qpos[:], self._data.qvel[:] = self.position.ravel(), self.velocity.ravel()
        mujoco.mj_fwdPosition(self._model, self._data)
        mujoco.mj_fwdVelocity(self._model, self._data)
        mujoco.mj_energyPos(self._model, self._data)
        mujoco.mj_energyVel(self._model, self._data)
        return float(self._data.energy.sum())
