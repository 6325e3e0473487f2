"""A robot at a posture: rigid bodies in a tree, each held to its parent by six small elastic coordinates.

The six coordinates of a body are `tx ty tz rx ry rz` in its joint frame, whose z axis is the joint's own axis
whatever the description's axis is.  They act in that order, translations first; the frame turns with the
joint angle. Coordinates are named `base.tx` .. `joint6.rz`; effects may add bodies of their own (a resonator,
half a link). A base whose inertia is not known stands on the ground for good: it is body -1, the ground, and
has no coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.description import Link, Robot, merge
from identify.robot.pose import turned

AXES = ("tx", "ty", "tz", "rx", "ry", "rz")


@dataclass(frozen=True)
class Body:
    """A rigid body: pose (4, 4) of its joint frame in the parent body's joint frame; mass, centre (3,) and
    inertia (3, 3) in its own.
    """

    name: str
    parent: int
    pose: Array
    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class Mechanism:
    """Bodies in tree order (a parent before its children).

    frames maps the name of a link or frame to its body and its pose (4, 4) in that body's joint frame.
    """

    bodies: tuple[Body, ...]
    frames: dict[str, tuple[int, Array]]
    gravity: Array

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of all elastic coordinates, six a body."""
        return tuple(f"{body.name}.{axis}" for body in self.bodies for axis in AXES)

    def frame(self, name: str, where: str) -> tuple[int, Array]:
        """Body and pose of a link or frame; an unknown name is an InputError with the known ones."""
        if name not in self.frames:
            raise InputError(where, f"unknown link {name!r}", "one of " + ", ".join(self.frames))
        return self.frames[name]

    def coordinate(self, name: str, where: str) -> int:
        """Number of the elastic coordinate of that name; an unknown name, or one of a base without inertia,
        is an InputError.
        """
        names = self.coordinates
        if name in names:
            return names.index(name)
        if name.startswith("base."):
            raise InputError(
                where,
                f"coordinate {name!r} moves the base, which has no inertia",
                fix="give the base link its mass and inertia in the robot file",
            )
        raise InputError(
            where,
            f"unknown coordinate {name!r}",
            f"BODY.AXIS, BODY one of {', '.join(body.name for body in self.bodies)}, AXIS one of"
            f" {', '.join(AXES)}",
        )


def at_posture(robot: Robot, posture: Array) -> Mechanism:
    """The robot with its joints at `posture` (joints,), rad; a posture of another length or with NaN is an
    InputError.
    """
    if posture.shape != (len(robot.joints),):
        raise InputError(
            "posture_deg",
            f"{posture.size} angles",
            f"{len(robot.joints)}, one per joint of robot {robot.name!r}",
        )
    if not np.all(np.isfinite(posture)):
        raise InputError("posture_deg", f"angles {np.degrees(posture).tolist()}", "finite numbers")
    base = robot.links[0]
    bodies = [] if base.mass == 0 else [Body("base", -1, np.eye(4), base.mass, base.centre, base.inertia)]
    frames = {base.name: (len(bodies) - 1, np.eye(4))}
    link_in_body = np.eye(4)  # pose of the parent link's frame in the parent body's joint frame
    for number, (joint, link, angle) in enumerate(
        zip(robot.joints, robot.links[1:], posture, strict=True), start=1
    ):
        align = z_to(joint.axis)
        pose = link_in_body @ joint.origin @ turned(angle * joint.axis) @ align
        link_in_body = align.T @ joint.mount
        bodies.append(_body(f"joint{number}", len(bodies) - 1, pose, link, link_in_body))
        frames[link.name] = (len(bodies) - 1, link_in_body)
    for name, (link_name, pose) in robot.frames.items():
        body, link_pose = frames[link_name]
        frames[name] = (body, link_pose @ pose)
    return Mechanism(tuple(bodies), frames, robot.gravity)


def hinged(mechanism: Mechanism, link: str, far: Body) -> Mechanism:
    """A mechanism with a part of a link as a body of its own, which carries what the link carries but its
    frames; far: that part, its pose in the link's frame.
    """
    root, frame = mechanism.frame(link, "effects")
    at, bodies = frame @ far.pose, list[Body]()
    for number, body in enumerate(mechanism.bodies):
        carried = body.parent == root
        pose = np.linalg.inv(at) @ body.pose if carried else body.pose
        moved = replace(body, parent=body.parent + (body.parent >= root), pose=pose)
        cut = replace(far, parent=root, pose=at)
        bodies += [_less(moved, cut), cut] if number == root else [moved]
    frames = {name: (body + (body > root), own) for name, (body, own) in mechanism.frames.items()}
    return replace(mechanism, bodies=tuple(bodies), frames=frames)


def _less(body: Body, part: Body) -> Body:
    """A body without a part of it, whose pose is in its own frame."""
    turn, whole = part.pose[:3, :3], Link(body.name, body.mass, body.centre, body.inertia)
    centre = turn @ part.centre + part.pose[:3, 3]
    left = merge(whole, Link(part.name, -part.mass, centre, -(turn @ part.inertia @ turn.T)))
    return replace(body, mass=left.mass, centre=left.centre, inertia=left.inertia)


def _body(name: str, parent: int, pose: Array, link: Link, link_in_body: Array) -> Body:
    turn, shift = link_in_body[:3, :3], link_in_body[:3, 3]
    return Body(name, parent, pose, link.mass, turn @ link.centre + shift, turn @ link.inertia @ turn.T)


def z_to(axis: Array) -> Array:
    """(4, 4), the shortest rotation that takes the z axis to `axis`."""
    return _z_to(*axis.tolist())


@cache
def _z_to(x: float, y: float, z: float) -> Array:
    sine = float(np.hypot(x, y))
    if sine < 1e-12:
        found = np.eye(4) if z > 0 else turned([np.pi, 0.0, 0.0])
    else:
        found = turned(np.array([-y, x, 0.0]) / sine * np.arctan2(sine, z))
    found.setflags(write=False)  # it is handed out again
    return found
