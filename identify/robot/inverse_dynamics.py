"""Torques that rigid links need for a recorded motion, and what a unit of mass, first moment or inertia adds
to them.

Torque per unit of each link's inertial parameters, in closed form for all samples at once.

Newton-Euler equations of a chain are linear in mass, first moments and inertia about the link frame's origin
(Atkeson, An and Hollerbach, Int. J. Robotics Research 5-3, 1986, Eqs. 15 to 20).  The engine gives torques,
not these columns; it is what tests compare them with.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from identify.core.arrays import Array, cross_matrix
from identify.robot.description import Joint, Link, Robot
from identify.robot.engine_motion import MovingArm
from identify.robot.pose import seen_from


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


PAIRS = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}
NAMES = (*PAIRS, "mx", "my", "mz", "m")
"""Of a link's parameters in the order of the columns; inertias as entries of the tensor."""


@dataclass(frozen=True)
class _Moved:
    """A link in motion, in the base's axes, each (samples, ...): turn (3, 3) of its frame, place, and its
    angular velocity, angular acceleration, and acceleration of the frame's origin less gravity, (3,).
    """

    turn: Array
    place: Array
    rate: Array
    change: Array
    pull: Array

    def at(self, place: Array) -> Array:
        """Acceleration, less gravity, of its point at a place (samples, 3)."""
        off = place - self.place
        return np.asarray(
            self.pull + np.cross(self.change, off) + np.cross(self.rate, np.cross(self.rate, off))
        )


def link_columns(robot: Robot, position: Array, velocity: Array, acceleration: Array) -> Array:
    """(samples, joints, links, 10): torque at each joint, N m, per unit of each parameter of each moving
    link, in the order of `NAMES`; position, velocity, acceleration (samples, joints), rad, s.
    """
    samples, count = position.shape
    found, zero = np.zeros((samples, count, count, len(NAMES))), np.zeros((samples, 3))
    moved = _Moved(np.tile(np.eye(3), (samples, 1, 1)), zero, zero, zero, zero - robot.gravity)
    axes: list[tuple[Array, Array]] = []
    for n, joint in enumerate(robot.joints):
        moved, axis, hinge = _next(moved, joint, position[:, n], velocity[:, n], acceleration[:, n])
        axes.append((axis, hinge))
        force, moment = _wrenches(moved)
        for k, (along, centre) in enumerate(axes):
            lever = np.cross(along, moved.place - centre)
            found[:, k, n] = np.einsum("si,sip->sp", along, moment) + np.einsum("si,sip->sp", lever, force)
    return found


def _next(
    parent: _Moved, joint: Joint, angle: Array, rate: Array, change: Array
) -> tuple[_Moved, Array, Array]:
    """The link that a joint moves, the joint's axis and its place, (samples, 3)."""
    turn = parent.turn @ joint.origin[:3, :3] @ _turns(joint.axis, angle)
    hinge = parent.place + parent.turn @ joint.origin[:3, 3]
    axis = turn @ joint.axis
    spin = axis * rate[:, None]
    child = _Moved(
        turn,
        hinge,
        parent.rate + spin,
        parent.change + axis * change[:, None] + np.cross(parent.rate, spin),
        parent.at(hinge),
    )
    place = hinge + turn @ joint.mount[:3, 3]
    return _Moved(turn @ joint.mount[:3, :3], place, child.rate, child.change, child.at(place)), axis, hinge


def _turns(axis: Array, angle: Array) -> Array:
    """(samples, 3, 3): rotations about an axis (3,)."""
    turns = scipy.spatial.transform.Rotation.from_rotvec(angle[:, None] * axis)
    return np.asarray(turns.as_matrix())


def _wrenches(link: _Moved) -> tuple[Array, Array]:
    """Force and moment about the frame's origin (samples, 3, 10) per unit of each parameter, in the base's
    axes.
    """
    own = [np.einsum("sji,sj->si", link.turn, vector) for vector in (link.rate, link.change, link.pull)]
    rate, change, pull = own
    spun, turned = cross_matrix(rate), cross_matrix(change)
    force, moment = np.zeros((2, len(rate), 3, len(NAMES)))
    for column, (a, b) in enumerate(PAIRS.values()):
        momentum, growth = np.zeros((2, len(rate), 3))
        momentum[:, a], growth[:, a] = rate[:, b], change[:, b]
        momentum[:, b], growth[:, b] = rate[:, a], change[:, a]
        moment[:, :, column] = growth + np.cross(rate, momentum)
    force[:, :, 6:9] = turned + spun @ spun
    force[:, :, 9] = pull
    moment[:, :, 6:9] = -cross_matrix(pull)
    return link.turn @ force, link.turn @ moment
