"""Torques that rigid links need for a recorded motion, and what a unit of mass, first moment or inertia adds
to them.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.robot.description import Link, Robot
from identify.robot.engine_motion import MovingArm

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Entries of an inertia tensor in the order of a regressor's last six columns."""


class RigidArm:
    """A rigid robot at a recorded motion: position, velocity, acceleration, each (samples, joints), rad,
    s.
    """

    def __init__(self, robot: Robot, position: Array, velocity: Array, acceleration: Array) -> None:
        self.robot = robot
        self._moving, self._motion = MovingArm(robot), (position, velocity, acceleration)
        self._regressors: dict[str, Array] = {}
        self.torque = self._moving.inverse_dynamics(*self._motion)
        """(samples, joints), N m at the joints."""

    def regressor(self, link: str) -> Array:
        """(samples, joints, 10): torque per kg of mass, kg m of first moment (x, y, z) and kg m^2 of inertia
        (xx, yy, zz, xy, xz, yz) about the frame's origin that a link has more.

        Inverse dynamics is linear in them (Atkeson, An and Hollerbach 1986): Newton's and Euler's equations
        about the origin of the link's frame, through its Jacobian.
        """
        if link not in self._regressors:
            turn, jacobian, moved = self._moving.frame_accelerations(*self._motion, link)
            inside = np.swapaxes(turn, 1, 2)
            lifted, omega, alpha = ((inside @ part[..., None])[..., 0] for part in np.split(moved, 3, axis=1))
            wrench = np.zeros((len(turn), 6, 10))
            wrench[:, :3, 0] = lifted
            spin = _cross(omega)
            wrench[:, :3, 1:4] = _cross(alpha) + spin @ spin
            wrench[:, 3:, 1:4] = -_cross(lifted)
            wrench[:, 3:, 4:] = _tensor_times(alpha) + spin @ _tensor_times(omega)
            own = np.concatenate([inside @ jacobian[:, :3], inside @ jacobian[:, 3:]], axis=1)
            self._regressors[link] = np.swapaxes(own, 1, 2) @ wrench
        return self._regressors[link]

    def added(self, link: str, body: Link) -> Array:
        """(samples, joints): torque that a body fixed to a link adds, N m; the body is in the link's frame
        and need not be a real one.
        """
        square = body.centre @ body.centre * np.eye(3) - np.outer(body.centre, body.centre)
        moments = _entries(body.inertia + body.mass * square)
        numbers = np.concatenate([[body.mass], body.mass * body.centre, moments])
        return np.asarray(self.regressor(link) @ numbers)

    def first_moment(self, link: str, direction: int) -> Array:
        """(samples, joints): torque per kg m of first moment along axis 0, 1 or 2 of the link's frame,
        without mass or inertia.
        """
        return self.regressor(link)[:, :, 1 + direction]

    def shifted(self, link: str, shift: Array) -> Array:
        """(samples, joints): torque that a small shift (3,), m, of a link's centre of mass adds, to first
        order; its inertia about the centre stays.
        """
        old = self.robot.link(link)
        cross = np.outer(old.centre, shift)
        carried = old.mass * (2 * (old.centre @ shift) * np.eye(3) - cross - cross.T)
        return np.asarray(
            self.regressor(link)[:, :, 1:] @ np.concatenate([old.mass * shift, _entries(carried)])
        )

    def inertia(self, link: str, axis: Array) -> Array:
        """(samples, joints): torque per kg m^2 about an axis (3,), unit, through the origin of the link's
        frame.
        """
        return np.asarray(self.regressor(link)[:, :, 4:] @ _entries(np.outer(axis, axis)))


def _entries(tensor: Array) -> Array:
    """(6,) of a symmetric (3, 3)."""
    return np.array([tensor[pair] for pair in _PAIRS])


def _cross(vectors: Array) -> Array:
    """(samples, 3, 3): what multiplies w to give v x w, for v (samples, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)


def _tensor_times(vectors: Array) -> Array:
    """(samples, 3, 6): what multiplies the entries of a symmetric tensor I to give I v, for v (samples,
    3).
    """
    found = np.zeros((len(vectors), 3, 6))
    for column, (i, j) in enumerate(_PAIRS):
        found[:, i, column] += vectors[:, j]
        if i != j:
            found[:, j, column] += vectors[:, i]
    return found
