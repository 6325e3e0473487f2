"""Torques that rigid links need for a recorded motion, and what a unit of mass, first moment or inertia adds
to them.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from identify.core.arrays import Array
from identify.robot.description import Link, Robot
from identify.robot.engine_motion import MovingArm
from identify.robot.pose import seen_from
from identify.robot.regressor import PAIRS, link_columns


class RigidArm:
    """A rigid robot at a recorded motion: position, velocity, acceleration, each (samples, joints), rad,
    s.
    """

    def __init__(self, robot: Robot, position: Array, velocity: Array, acceleration: Array) -> None:
        self.robot, self._motion = robot, (position, velocity, acceleration)
        self.torque = MovingArm(robot).inverse_dynamics(*self._motion)
        """(samples, joints), N m at the joints."""

    @cached_property
    def _columns(self) -> Array:
        """(samples, joints, links, 10) of all links, the base's first."""
        moved = link_columns(self.robot, *self._motion)
        return np.concatenate([np.zeros_like(moved[:, :, :1]), moved], axis=2)

    def _per_unit(self, link: str) -> Array:
        """(samples, joints, 10): torque per unit of each parameter, in the order of `regressor.NAMES`, that a
        link has more.
        """
        return self._columns[:, :, [one.name for one in self.robot.links].index(link)]

    def added(self, link: str, body: Link) -> Array:
        """(samples, joints): torque that a body fixed to a link, or to a frame on one, adds, N m; the body is
        in the axes of that and need not be a real one.
        """
        carrier, pose = self.robot.carrier(link)
        own = seen_from(body, pose)
        square = own.centre @ own.centre * np.eye(3) - np.outer(own.centre, own.centre)
        moments = _entries(own.inertia + own.mass * square)
        return np.asarray(self._per_unit(carrier) @ [*moments, *(own.mass * own.centre), own.mass])

    def first_moment(self, link: str, direction: int) -> Array:
        """(samples, joints): torque per kg m of first moment along axis 0, 1 or 2 of the link's frame,
        without mass or inertia.
        """
        return self._per_unit(link)[:, :, len(PAIRS) + direction]

    def shifted(self, link: str, shift: Array) -> Array:
        """(samples, joints): torque that a small shift (3,), m, of a link's centre of mass adds, to first
        order; its inertia about the centre stays.
        """
        old = self.robot.link(link)
        cross = np.outer(old.centre, shift)
        carried = old.mass * (2 * (old.centre @ shift) * np.eye(3) - cross - cross.T)
        return np.asarray(self._per_unit(link)[:, :, :-1] @ [*_entries(carried), *(old.mass * shift)])

    def inertia(self, link: str, axis: Array) -> Array:
        """(samples, joints): torque per kg m^2 about an axis (3,), unit, through the origin of the link's
        frame.
        """
        return np.asarray(self._per_unit(link)[:, :, : len(PAIRS)] @ _entries(np.outer(axis, axis)))


def _entries(tensor: Array) -> Array:
    """(6,) of a symmetric (3, 3)."""
    return np.array([tensor[pair] for pair in PAIRS.values()])
