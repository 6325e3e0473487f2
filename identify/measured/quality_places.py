"""Places that cannot be on a robot: of points, payloads, tools and effects, by how far its links reach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeVar

import numpy as np

from identify.core.arrays import Array
from identify.measured.finding import Finding, listing
from identify.robot.description import Link, Robot, merge
from identify.robot.points import Point

_BEYOND, _TOOL = 2.0, 0.1
"""A point farther from its link than this many times the link's own extent, plus this share of the arm's, as
of a bracket or tool, is doubtful; one farther than the whole arm is long cannot be right."""
Key = TypeVar("Key", int, str)


def far_points(robot: Robot, points: Mapping[int, Point]) -> Iterator[Finding]:
    """Points that are not on their link, such as those given in mm."""
    impossible, doubtful = _far(robot, {n: (one.link, one.position) for n, one in points.items()})
    if impossible:
        farthest = max(impossible.values())
        sentence = (
            f"Point {listing(list(impossible))} lies up to {farthest:.4g} m from its link, but the whole"
            f" robot is only {_reach(robot):.3g} m long: are the positions in mm?"
        )
        yield Finding("fail", "far-point", (), sentence, farthest)
    if doubtful:
        farthest = max(doubtful.values())
        sentence = (
            f"Point {listing(list(doubtful))} lies up to {farthest:.3g} m from the frame of its link, far"
            " outside of the link: is it the right link, and its frame?"
        )
        yield Finding("warn", "far-point", (), sentence, farthest)


def far_places(robot: Robot, places: Mapping[str, tuple[str, Array]]) -> Iterator[Finding]:
    """What else is said to be somewhere on a link, by its key (link, position (3,), m), and cannot be."""
    for key, distance in _far(robot, places)[0].items():
        sentence = (
            f"`{key}` lies {distance:.4g} m from its link, but the whole robot is only"
            f" {_reach(robot):.3g} m long: is it in mm?"
        )
        yield Finding("fail", "far-place", (), sentence, distance)


def far_payloads(robot: Robot) -> Iterator[Finding]:
    """Payloads whose centre is not on the robot."""
    for link, body in robot.payloads:
        yield from far_places(robot, {"robot.payload.centre_m": (link, body.centre)})


def _far(robot: Robot, places: Mapping[Key, tuple[str, Array]]) -> tuple[dict[Key, float], dict[Key, float]]:
    """How far from their link, m, places are that cannot be on the robot, and that are doubtful."""
    extent = _extents(robot)
    reach = sum(extent.values())
    impossible, doubtful = dict[Key, float](), dict[Key, float]()
    for name, (frame, position) in places.items():
        link, pose = robot.carrier(frame)
        distance = float(np.linalg.norm(pose[:3, :3] @ position + pose[:3, 3]))
        if distance > reach > 0:
            impossible[name] = distance
        elif distance > _BEYOND * extent.get(link, reach) + _TOOL * reach:
            doubtful[name] = distance
    return impossible, doubtful


def _reach(robot: Robot) -> float:
    return sum(_extents(robot).values())


def _extents(robot: Robot) -> dict[str, float]:
    """How far each link reaches from its frame, m: to the next joint, and to the edge of a body of its
    inertia, without payloads.
    """
    extents = {}
    for number, one in enumerate(robot.links):
        link, reach = _without_payloads(robot, one), [0.0]
        if link.mass > 0:
            gyration = np.sqrt(max(float(np.trace(link.inertia)), 0.0) / (2 * link.mass))
            reach.append(float(np.linalg.norm(link.centre)) + 2 * gyration)
        if number < len(robot.joints):
            reach.append(float(np.linalg.norm(robot.joints[number].origin[:3, 3])))
        if number:
            reach.append(float(np.linalg.norm(robot.joints[number - 1].mount[:3, 3])))
        extents[link.name] = max(reach)
    return extents


def _without_payloads(robot: Robot, link: Link) -> Link:
    for carrier, body in robot.payloads:
        if carrier == link.name:
            link = merge(link, Link(body.name, -body.mass, body.centre, -body.inertia))
    return link
