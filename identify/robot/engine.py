"""What knows the dynamics engine (MuJoCo): mass matrix, gravity stiffness and point Jacobians of a mechanism.

Its sibling `engine_motion` has the same mechanism in motion; nothing else in identify knows the engine.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache

import mujoco
import numpy as np

from identify.core.arrays import Array, Mask, cross
from identify.robot.posture import AXES, Mechanism

mujoco.set_mju_user_warning(lambda text: None)
"""The engine would write its warnings into MUJOCO_LOG.TXT wherever the user is; a motion that runs away,
of which it warns, is looked for (`engine_motion`).
"""

_TURN = 1e-4
"""Angle, rad, for the differences of mass matrices and motions: truncation 1e-9."""

DRIVE_ARMATURE = 1.0
"""Inertia, kg m^2, of the rotor on a `drive`: without any, drive and rz could not both be moved."""


_MOST = 6
"""Coordinates that the engine lets one body have."""

_KEPT = 16
"""Compiled models that are remembered."""


class Engine:
    """A mechanism compiled for the dynamics engine; everything is evaluated at zero elastic displacement, and
    motions and stiffnesses are remembered, because many models are made of one engine.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self._model = _at_poses(mechanism)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_fwdPosition(self._model, self._data)
        self._jacobians: dict[tuple[str, bytes], Array] = {}
        self._weights: dict[tuple[str, bytes], Array] = {}

    def mass_matrix(self) -> Array:
        """M (n, n), kg, kg m, kg m^2, over all 6 x bodies coordinates."""
        mass = np.zeros((self._model.nv, self._model.nv))
        mujoco.mj_fullM(self._model, self._data, mass)
        return mass

    def jacobian(self, frame: str, point: Array, where: str = "points") -> Array:
        """(6, n): velocity (3) and angular velocity (3) of a point fixed to a frame, in that frame's axes,
        per coordinate velocity.

        point (3,), m, in the frame's own axes.
        """
        key = frame, np.asarray(point, dtype=float).tobytes()
        if key not in self._jacobians:
            self._jacobians[key] = _fixed(self._jacobian(frame, point, where))
        return self._jacobians[key]

    def _jacobian(self, frame: str, point: Array, where: str) -> Array:
        body, pose = self.mechanism.frame(frame, where)  # body -1, the ground, is the engine's body 0
        turn = self._data.xmat[body + 1].reshape(3, 3)
        world = self._data.xpos[body + 1] + turn @ (pose[:3, :3] @ point + pose[:3, 3])
        linear, angular = np.zeros((2, 3, self._model.nv))
        mujoco.mj_jac(self._model, self._data, linear, angular, world, body + 1)
        axes = (turn @ pose[:3, :3]).T
        return np.vstack([axes @ linear, axes @ angular])

    def axes(self, frame: str) -> Array:
        """(3, 3): the axes of a frame, as columns in the base's axes."""
        body, pose = self.mechanism.frame(frame, "points")
        return np.asarray(self._data.xmat[body + 1].reshape(3, 3) @ pose[:3, :3])

    def position(self, frame: str, point: Array) -> Array:
        """Where a point (3,) fixed to a frame is, in the base's axes, m."""
        body, pose = self.mechanism.frame(frame, "points")
        inside = pose[:3, :3] @ point + pose[:3, 3]
        return np.asarray(self._data.xpos[body + 1] + self._data.xmat[body + 1].reshape(3, 3) @ inside)

    def gravity_forces(self) -> Array:
        """(n,): generalised forces that hold the mechanism against gravity at zero displacement, N, N m."""
        return np.asarray(-self._moments @ self.mechanism.gravity)

    def gravity_stiffness(self) -> Array:
        """K_g (n, n): derivative of the generalised gravity forces, symmetric, N/m, N, N m/rad."""
        return self._gravity_stiffness

    @cached_property
    def _gravity_stiffness(self) -> Array:
        return _fixed(self._stiffness_of(self._moments))

    @cached_property
    def _moments(self) -> Array:
        """(n, 3): by what each coordinate moves the first moment m x of all that it carries, along the base's
        axes.
        """
        body = self._model.jnt_bodyid
        arm = np.where(self._turns[:, None], self._data.subtree_com[body] - self._data.xanchor, 0.0)
        moved = np.where(self._turns[:, None], cross(self._data.xaxis, arm), self._data.xaxis)
        return np.asarray(self._model.body_subtreemass[body, None] * moved)

    @cached_property
    def _turns(self) -> Mask:
        """(n,): which coordinates are angles."""
        return np.asarray(self._model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)

    @cached_property
    def _above(self) -> Mask:
        """(n, n): whether a coordinate, the row, moves what another, the column, moves."""
        above = np.eye(self._model.nv, dtype=bool)
        for number, parent in enumerate(self._model.dof_parentid.tolist()):
            if parent >= 0:
                above[:, number] |= above[:, parent]
        return above

    def _stiffness_of(self, moved: Array) -> Array:
        """(n, n): second derivative of the potential of weights whose first moment m x moves by (n, 3) per
        coordinate, along the base's axes: a coordinate that turns about an axis turns what lies behind it.
        """
        turned = np.where(self._turns[:, None], cross(self.mechanism.gravity, self._data.xaxis), 0.0)
        upper = np.where(self._above, -turned @ moved.T, 0.0)
        return np.asarray(upper + upper.T - np.diag(np.diag(upper)))

    def coriolis(self, rates: Array) -> Array:
        """(n, n), N s/m, N m s/rad: derivative of the Coriolis and centrifugal forces by the rates of all
        coordinates, at rates (n,).

        They are quadratic in the rates, so that central differences are exact.
        """
        data, columns = mujoco.MjData(self._model), []
        for coordinate in range(self._model.nv):
            difference = np.zeros(self._model.nv)
            for sign in (1.0, -1.0):
                data.qvel[:] = rates
                data.qvel[coordinate] += sign
                mujoco.mj_forward(self._model, data)
                difference += sign * data.qfrc_bias
            columns.append(difference / 2)
        return np.array(columns).T

    def turning(self, joint: int, frame: str, point: Array) -> tuple[Array, Array]:
        """Derivatives by the angle of a joint (from 1), per rad: of M (n, n), and of the motion (3, n) of a
        point (3,) of a frame along the base's axes.

        The joint's coordinates turn with it, as at another posture.
        """
        names = self.mechanism.coordinates
        first = names.index(f"joint{joint}.{AXES[0]}")
        data = mujoco.MjData(self._model)
        body, pose = self.mechanism.frame(frame, "points")
        inside = pose[:3, :3] @ point + pose[:3, 3]

        def state(angle: float) -> tuple[Array, Array]:
            data.qpos[first + AXES.index("rz")] = angle
            mujoco.mj_fwdPosition(self._model, data)
            world = data.xpos[body + 1] + data.xmat[body + 1].reshape(3, 3) @ inside
            mass, linear = np.zeros((self._model.nv, self._model.nv)), np.zeros((3, self._model.nv))
            mujoco.mj_fullM(self._model, data, mass)
            mujoco.mj_jac(self._model, data, linear, None, world, body + 1)
            return mass, linear

        up, down, here = state(_TURN), state(-_TURN), state(0.0)
        mass, motion = ((one - other) / (2 * _TURN) for one, other in zip(up, down, strict=True))
        # the coordinates across the axis turn too: tx with ty, rx with ry
        turn = np.zeros((len(names), len(names)))
        for x in (first, first + AXES.index("rx")):
            turn[x, x + 1], turn[x + 1, x] = -1.0, 1.0
        return mass + turn.T @ here[0] + here[0] @ turn, motion + here[1] @ turn

    def weight_stiffness(self, frame: str, point: Array, where: str = "points") -> Array:
        """(n, n) per kg: the gravity stiffness of a point mass at a point (3,), m, of a frame, in the frame's
        axes.
        """
        [found] = self.weight_stiffnesses(frame, np.asarray(point, dtype=float)[None], where)
        return found

    def weight_stiffnesses(self, frame: str, points: Array, where: str = "points") -> list[Array]:
        """The same of several points (points, 3) of one frame."""
        keys = [(frame, point.tobytes()) for point in points]
        new = [number for number, key in enumerate(keys) if key not in self._weights]
        if new:
            found = self._weight_stiffnesses(frame, points[new], where)
            self._weights |= {keys[number]: _fixed(one) for number, one in zip(new, found, strict=True)}
        return [self._weights[key] for key in keys]

    def _weight_stiffnesses(self, frame: str, points: Array, where: str) -> Array:
        body, pose = self.mechanism.frame(frame, where)
        place, turn = self._data.xpos[body + 1], self._data.xmat[body + 1].reshape(3, 3)
        found, linear = [], np.zeros((3, self._model.nv))
        for point in points:
            world = place + turn @ (pose[:3, :3] @ point + pose[:3, 3])
            mujoco.mj_jac(self._model, self._data, linear, None, world, body + 1)
            found.append(self._stiffness_of(linear.T))
        return np.array(found)


def _fixed(array: Array) -> Array:
    """The array, not to be written to: it is handed out again."""
    array.setflags(write=False)
    return array


def _at_poses(mechanism: Mechanism) -> mujoco.MjModel:
    """The engine's model with all coordinates, at the poses of the bodies: compiled once for all postures."""
    bodies = mechanism.bodies
    model = copy.copy(_compiled(_Inertias(mechanism)))
    model.body_pos[1:] = [body.pose[:3, 3] for body in bodies]
    model.body_quat[1:] = [_quaternion(body.pose[:3, :3]) for body in bodies]
    return model


class _Inertias:
    """A mechanism that equals others with the same bodies at other poses."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        numbers = [
            (one.name, one.parent, one.mass, *one.centre, *one.inertia.ravel()) for one in mechanism.bodies
        ]
        self._all = (*mechanism.gravity, *numbers)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Inertias) and self._all == other._all

    def __hash__(self) -> int:
        return hash(self._all)


@lru_cache(maxsize=_KEPT)
def _compiled(given: _Inertias) -> mujoco.MjModel:
    mechanism = given.mechanism
    return compile_mechanism(mechanism, {body.name: AXES for body in mechanism.bodies})


def compile_mechanism(
    mechanism: Mechanism, axes: Mapping[str, Sequence[str]], copies: int = 1
) -> mujoco.MjModel:
    """The engine's model with, for each body by name, coordinates along `axes` in their order; `drive` is a
    turn about z as `rz` is, of a rotor of DRIVE_ARMATURE.  Copies stand in the same place and do not feel
    each other; their coordinates follow each other.
    """
    spec = mujoco.MjSpec()
    spec.option.gravity = mechanism.gravity
    off = mujoco.mjtDisableBit
    spec.option.disableflags |= (
        off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT | off.mjDSBL_AUTORESET | off.mjDSBL_ISLAND
    )
    inertias = [
        inertia
        for copy in range(copies)
        for inertia in _add_arm(spec, mechanism, axes, f"{copy}." if copy else "")
    ]
    with warnings.catch_warnings():  # of what the compiler's stand-in bodies weigh, which is no one's affair
        warnings.simplefilter("ignore", UserWarning)
        model = spec.compile()
    # The compiler refuses, or replaces by their average, moments that rounding took past the triangle
    # inequality (a plate), and bodies
    # without mass, so the true ones go in afterwards; the description has checked them.
    model.body_mass[1:], model.body_inertia[1:] = zip(*inertias, strict=True)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _add_arm(
    spec: mujoco.MjSpec, mechanism: Mechanism, axes: Mapping[str, Sequence[str]], prefix: str
) -> list[tuple[float, Array]]:
    """Add the bodies of a mechanism; of each its mass and principal moments of inertia (3,)."""
    added: list[mujoco.MjsBody] = []
    inertias: list[tuple[float, Array]] = []
    for body in mechanism.bodies:
        parent, own, name = (
            spec.worldbody if body.parent < 0 else added[body.parent],
            list(axes.get(body.name, ())),
            prefix + body.name,
        )
        node = parent.add_body(name=name, pos=body.pose[:3, 3], quat=_quaternion(body.pose[:3, :3]))
        node.explicitinertial = True
        if len(own) > _MOST:  # the rotor has a body of its own, which weighs nothing
            node.name, node.mass, node.inertia = f"{name}.rotor", 1.0, np.ones(3)
            _add_joint(node, name, own.pop(0))
            inertias.append((0.0, np.zeros(3)))
            node = node.add_body(name=name)
            node.explicitinertial = True
        moments, turned = np.linalg.eigh(body.inertia)
        turned *= np.sign(np.linalg.det(turned))
        node.mass, node.ipos = body.mass, body.centre
        node.inertia, node.iquat = np.full(3, moments[2]), _quaternion(turned)
        inertias.append((body.mass, moments))
        for axis in own:
            _add_joint(node, name, axis)
        added.append(node)
    return inertias


def _add_joint(node: mujoco.MjsBody, name: str, axis: str) -> None:
    number = AXES.index("rz" if axis == "drive" else axis)
    kind = mujoco.mjtJoint.mjJNT_SLIDE if number < 3 else mujoco.mjtJoint.mjJNT_HINGE
    node.add_joint(
        name=f"{name}.{axis}",
        type=kind,
        axis=np.eye(3)[number % 3],
        armature=DRIVE_ARMATURE if axis == "drive" else 0.0,
    )


def _quaternion(rotation: Array) -> Array:
    result = np.empty(4)
    mujoco.mju_mat2Quat(result, rotation.ravel())
    return result
