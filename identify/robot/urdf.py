"""Read a serial arm from a URDF, xacro or MJCF file: kinematics, inertias, frames and what its links look
like; materials and plug-in elements are not looked at.

Links that a fixed joint holds are merged into the link that carries them and stay known as frames, as are
those of joints that are not part of the arm (`identify.robot.chain`).  Links without inertia between the root
and the base (`world`, `base_footprint`) become frames of the base.  Gravity is 9.81 m/s^2 against the z axis
of the file's root link.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.chain import Choice, one_chain
from identify.robot.description import Joint, Link, Robot, as_base, inertia_fault, merge
from identify.robot.pose import inverse, seen_from
from identify.robot.source import NO_ARGUMENTS, read_source
from identify.robot.units import ANGLES, SI, RobotUnits
from identify.robot.urdf_elements import UrdfJoint, UrdfLink, joints, links
from identify.robot.visual import visuals

Frames = dict[str, tuple[str, Array]]
Outgoing = dict[str, list[UrdfJoint]]
WHOLE = Choice()
GRAVITY = (0.0, 0.0, -9.81)
"""m/s^2, in the axes of the root link."""


def read_urdf(
    path: Path,
    *,
    unknown_bodies: bool = False,
    any_bodies: bool = False,
    gravity: Sequence[float] = GRAVITY,
    units: RobotUnits = SI,
    choice: Choice = WHOLE,
    arguments: Mapping[str, str] = NO_ARGUMENTS,
) -> Robot:
    """The arm in a URDF, xacro or MJCF file.

    A base without inertia, or of one that no body can have, gets mass 0.  Moving links without physical
    inertia are an InputError that names the file, the line and the element; unknown_bodies: masses and
    inertias of zero are allowed, of bodies that are not known; any_bodies: those that no body can have, too,
    and get mass 0; gravity: in the axes of the root link, m/s^2; units: those of the file; choice: which of
    its joints are the arm; arguments: of a xacro.
    """
    document = replace(read_source(path, arguments).document(), angle=ANGLES[units.angle])
    chain = one_chain(path.name, *_in_si(units, links(document), joints(document)), choice)
    named, outgoing = chain.links, _outgoing(chain.joints)
    children = {joint.child for joint in chain.joints}
    root = next(name for name in named if name not in children)
    notes = [*document.notes, *chain.notes]
    carrier, poses, leaving = _base(root, named, outgoing)
    body, frames, fault = _any_solid(carrier, poses, named)
    if fault:
        notes.append(f"the inertia of the base {carrier!r} is not used: {fault}")
    body = as_base(body)
    pull = poses[root][:3, :3] @ np.array(gravity)
    solids, moving = [body], []
    while leaving:
        joint = leaving[0]
        moving.append(_joint(joint, carrier, poses[joint.parent]))
        carrier = joint.child
        poses, leaving = _rigid(carrier, outgoing)
        if any_bodies:
            body, more, fault = _any_solid(carrier, poses, named)
            notes += [f"link {carrier!r}: {fault}"] if fault else []
        else:
            body, more = _solid(carrier, poses, named, unknown=unknown_bodies)
            _check(body, named[carrier], joint, unknown=unknown_bodies)
        solids.append(body)
        frames.update(more)
    return Robot(
        document.root.get("name", path.stem),
        tuple(solids),
        tuple(moving),
        frames,
        pull,
        visuals(document),
        notes=tuple(notes),
        largest_turn=document.largest_turn,
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


def _outgoing(jointed: list[UrdfJoint]) -> Outgoing:
    """The joints that leave each link."""
    outgoing: Outgoing = defaultdict(list)
    for joint in jointed:
        outgoing[joint.parent].append(joint)
    return outgoing


def _any_solid(carrier: str, poses: dict[str, Array], named: dict[str, UrdfLink]) -> tuple[Link, Frames, str]:
    """As `_solid`, but of a body that cannot be only mass and centre are kept, or nothing, and why."""
    try:
        body, frames = _solid(carrier, poses, named)
        fault = inertia_fault(body) if np.any(body.inertia) else None
        if fault is None:
            return body, frames, ""
    except InputError as error:
        fault = error.found
    parts = [(named[name].inertial, at) for name, at in poses.items()]
    points = [seen_from(replace(one, inertia=np.zeros((3, 3))), at) for one, at in parts if one is not None]
    nothing = np.zeros((3, 3))
    body = Link(carrier, 0.0, np.zeros(3), nothing)
    if all(point.mass > 0 and inertia_fault(replace(point, inertia=np.eye(3))) is None for point in points):
        for point in points:
            body = merge(body, point)
    return replace(body, inertia=nothing), _held(carrier, poses), fault


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
    return body, _held(carrier, poses)


def _held(carrier: str, poses: dict[str, Array]) -> Frames:
    """The frames that a link carries."""
    return {name: (carrier, at) for name, at in poses.items() if name != carrier}


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
            "add or correct <inertial> of this link, or let `identify init --mass-kg` make it of the meshes",
        )


def _joint(joint: UrdfJoint, carrier: str, parent_pose: Array) -> Joint:
    plain = Joint(
        joint.name, carrier, joint.child, joint.origin, joint.axis, lower=joint.lower, upper=joint.upper
    )
    return replace(plain, origin=parent_pose @ joint.origin)
