"""Torques that rigid links need for a recorded motion, and what a unit of mass, first moment or inertia adds
to them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.robot.description import Link, Robot, merge
from identify.robot.engine_motion import MovingArm

_SMALL = 0.01
"""Part of a shift that is tried, so that what it leaves is still a body."""


class RigidArm:
    """A rigid robot at a recorded motion: position, velocity, acceleration, each (samples, joints), rad,
    s.
    """

    def __init__(self, robot: Robot, position: Array, velocity: Array, acceleration: Array) -> None:
        self.robot = robot
        self._motion = position, velocity, acceleration
        self.torque = MovingArm(robot).inverse_dynamics(*self._motion)
        """(samples, joints), N m at the joints."""

    def added(self, link: str, body: Link) -> Array:
        """(samples, joints): torque that a body fixed to a link adds, N m; the body is in the link's frame
        and need not be a real one.

        Inverse dynamics is linear in mass, first moment and inertia about the frame's origin (Atkeson, An and
        Hollerbach 1986).
        """
        old = self.robot.link(link)
        links = tuple(merge(old, body) if other is old else other for other in self.robot.links)
        return MovingArm(replace(self.robot, links=links)).inverse_dynamics(*self._motion) - self.torque

    def first_moment(self, link: str, direction: int) -> Array:
        """(samples, joints): torque per kg m of first moment along axis 0, 1 or 2 of the link's frame,
        without mass or inertia.
        """
        return self.added(link, _moment(direction, 1.0)) / 2 - self.added(link, _moment(direction, -1.0)) / 2

    def shifted(self, link: str, shift: Array) -> Array:
        """(samples, joints): torque that a small shift (3,), m, of a link's centre of mass adds, to first
        order; its inertia about the centre stays.
        """
        old = self.robot.link(link)
        cross = np.outer(old.centre, shift)
        carried = old.mass * (2 * (old.centre @ shift) * np.eye(3) - cross - cross.T)
        there, back = (
            self.added(link, Link("shift", old.mass, part * shift, part * carried))
            for part in (_SMALL, -_SMALL)
        )
        return np.asarray((there - back) / (2 * _SMALL))

    def inertia(self, link: str, axis: Array) -> Array:
        """(samples, joints): torque per kg m^2 about an axis (3,), unit, through the origin of the link's
        frame.
        """
        return self.added(link, Link("inertia", 0.0, np.zeros(3), np.outer(axis, axis)))


def _moment(direction: int, side: float) -> Link:
    """A kilogram a metre off the origin; the half difference of both sides is a pure first moment, as inertia
    does not know sides.
    """
    centre = np.zeros(3)
    centre[direction] = side
    return Link("moment", 1.0, centre, np.zeros((3, 3)))
