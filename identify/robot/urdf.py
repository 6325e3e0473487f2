"""Read a serial arm from a URDF file: kinematics, inertias, frames and what its links look like; materials
and plug-in elements are not looked at.

Links that a fixed joint holds are merged into the link that carries them and stay known as frames.  Links
without inertia between the root and the base (`world`, `base_footprint`) become frames of the base.  Gravity
is 9.81 m/s^2 against the z axis of the file's root link.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.description import Joint, Link, Robot, as_base, inertia_fault, merge
from identify.robot.pose import inverse, seen_from
from identify.robot.units import SI, RobotUnits
from identify.robot.urdf_elements import MOVING, UrdfJoint, UrdfLink, joints, links, parse
from identify.robot.visual import visuals

Frames = dict[str, tuple[str, Array]]
Outgoing = dict[str, list[UrdfJoint]]
GRAVITY = (0.0, 0.0, -9.81)
"""m/s^2, in the axes of the root link."""


def read_urdf(
    path: Path,
    *,
    unknown_bodies: bool = False,
    gravity: Sequence[float] = GRAVITY,
    units: RobotUnits = SI,
) -> Robot:
    """The arm in a URDF file.

    A base without inertia, or of zero inertia, gets mass 0.  Everything that is not one chain of revolute or
    continuous joints with physical inertias is an InputError that names the file, the line and the element;
    unknown_bodies: masses and inertias of zero are allowed, of bodies that are not known; gravity: in the
    axes of the root link, m/s^2; units: those of the file.
    """
    document = parse(path)
    named, jointed = _in_si(units, links(document), joints(document))
    outgoing = _tree(path, named, jointed)
    children = {joint.child for joint in jointed}
    root = next(name for name in named if name not in children)
    carrier, poses, leaving = _base(root, named, outgoing)
    body, frames = _solid(carrier, poses, named)
    body = as_base(body)
    pull = poses[root][:3, :3] @ np.array(gravity)
    if body.mass > 0:
        _check(body, named[carrier])
    solids, moving = [body], []
    while leaving:
        joint = _only(leaving)
        moving.append(_joint(joint, carrier, poses[joint.parent]))
        carrier = joint.child
        poses, leaving = _rigid(carrier, outgoing)
        body, more = _solid(carrier, poses, named, unknown=unknown_bodies)
        _check(body, named[carrier], joint, unknown=unknown_bodies)
        solids.append(body)
        frames.update(more)
    if not moving:
        raise InputError(path.name, "no moving joint", f"a chain of {' or '.join(MOVING)} joints")
    return Robot(
        document.root.get("name", path.stem), tuple(solids), tuple(moving), frames, pull, visuals(document)
    )


def _in_si(
    units: RobotUnits, named: dict[str, UrdfLink], jointed: list[UrdfJoint]
) -> tuple[dict[str, UrdfLink], list[UrdfJoint]]:
    """What the file says, before any bodies are merged."""
    if units.si:
        return named, jointed
    bodies = {
        name: replace(link, inertial=None if link.inertial is None else units.link(link.inertial))
        for name, link in named.items()
    }
    return bodies, [replace(joint, origin=units.pose(joint.origin)) for joint in jointed]


def _tree(path: Path, named: dict[str, UrdfLink], jointed: list[UrdfJoint]) -> Outgoing:
    """The joints that leave each link, once it is sure that links and joints form one tree."""
    outgoing: Outgoing = defaultdict(list)
    parent_of: dict[str, UrdfJoint] = {}
    for joint in jointed:
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in named:
                raise InputError(joint.where, f"unknown {role} link {link!r}", "one of " + ", ".join(named))
        if joint.child in parent_of:
            found = f"link {joint.child!r} is the child of joint {parent_of[joint.child].name!r} already"
            raise InputError(joint.where, found, "a tree (closed loops are not supported)")
        parent_of[joint.child] = joint
        outgoing[joint.parent].append(joint)
    roots = [name for name in named if name not in parent_of]
    if len(roots) > 1:
        raise InputError(
            path.name,
            f"{len(roots)} links have no parent ({', '.join(roots)})",
            "one root link",
            "join them by joints",
        )
    reached = _reach(roots[0], outgoing) if roots else set()
    for name, written in named.items():
        if name not in reached:
            raise InputError(
                written.where,
                f"link {name!r} is part of a loop of joints",
                "a tree (closed loops are not supported)",
            )
    if not roots:
        raise InputError(path.name, "no link", "a robot with links and joints")
    return outgoing


def _reach(root: str, outgoing: Outgoing) -> set[str]:
    reached, ahead = set(), [root]
    while ahead:
        reached.add(ahead[-1])
        ahead.extend(joint.child for joint in outgoing[ahead.pop()])
    return reached


def _rigid(carrier: str, outgoing: Outgoing) -> tuple[dict[str, Array], list[UrdfJoint]]:
    """Poses of all links that fixed joints hold to `carrier`, in its frame, and the moving joints that leave
    them.
    """
    poses, ahead, leaving = {carrier: np.eye(4)}, [carrier], []
    while ahead:
        link = ahead.pop()
        for joint in outgoing[link]:
            if joint.kind == "fixed":
                poses[joint.child] = poses[link] @ joint.origin
                ahead.append(joint.child)
            else:
                leaving.append(joint)
    return poses, leaving


def _base(
    root: str, named: dict[str, UrdfLink], outgoing: Outgoing
) -> tuple[str, dict[str, Array], list[UrdfJoint]]:
    """The base link, the poses of what is fixed to it in its frame, and the moving joints that leave it.

    On the way from the root to the first moving joint the base is the first link with inertia, or the last
    link where none has any.
    """
    poses, leaving = _rigid(root, outgoing)
    above = {joint.child: joint.parent for held in outgoing.values() for joint in held}
    base = leaving[0].parent if leaving else root
    way = [base]
    while way[-1] != root:
        way.append(above[way[-1]])
    base = next((name for name in reversed(way) if named[name].inertial is not None), base)
    back = inverse(poses[base])
    return base, {name: back @ at for name, at in poses.items()}, leaving


def _solid(
    carrier: str, poses: dict[str, Array], named: dict[str, UrdfLink], *, unknown: bool = False
) -> tuple[Link, Frames]:
    """The carrier with everything that is fixed to it merged in, and the frames it carries."""
    body = Link(carrier, 0.0, np.zeros(3), np.zeros((3, 3)))
    for name, at in poses.items():
        inertial = named[name].inertial
        if inertial is None:
            continue
        _check_part(inertial, named[name], unknown=unknown)
        body = merge(body, seen_from(inertial, at))
    return body, {name: (carrier, at) for name, at in poses.items() if name != carrier}


def _check_part(part: Link, written: UrdfLink, *, unknown: bool = False) -> None:
    """A part may have no mass at all (a frame) or no extent (a point mass); the body it belongs to is checked
    when it is whole.
    """
    if part.mass == 0 and not np.any(part.inertia):
        return
    fault = inertia_fault(part, unknown=unknown)
    if fault and (part.mass <= 0 or np.any(part.inertia)):
        raise InputError(
            written.where,
            fault,
            "a mass and inertia that a rigid body can have",
            "correct <inertial> of this link",
        )


def _check(body: Link, written: UrdfLink, joint: UrdfJoint | None = None, *, unknown: bool = False) -> None:
    fault = inertia_fault(body, unknown=unknown)
    if joint and body.mass == 0 and not unknown:
        fault = (
            f"link {body.name!r} is moved by joint {joint.name!r} but has no mass or inertia, nor has"
            " anything fixed to it"
        )
    if fault:
        raise InputError(
            written.where,
            fault,
            "a mass and inertia that a rigid body can have",
            "add or correct <inertial> of this link",
        )


def _only(leaving: list[UrdfJoint]) -> UrdfJoint:
    if len(leaving) > 1:
        names = ", ".join(repr(joint.name) for joint in leaving)
        raise InputError(
            leaving[1].where,
            f"the arm branches into the joints {names}",
            "a serial arm",
            'write type="fixed" for joints that are locked',
        )
    return leaving[0]


def _joint(joint: UrdfJoint, carrier: str, parent_pose: Array) -> Joint:
    plain = Joint(
        joint.name, carrier, joint.child, joint.origin, joint.axis, lower=joint.lower, upper=joint.upper
    )
    return replace(plain, origin=parent_pose @ joint.origin)
