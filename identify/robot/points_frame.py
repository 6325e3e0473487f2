"""Points in the frames of their links, or in that of the base at a posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.points import Point
from identify.robot.posture import at_posture


def in_links(points: Mapping[int, Point], robot: Robot, posture: Array) -> dict[int, Point]:
    """Points whose positions and axes are in the base's frame with the joints at `posture` (joints,), rad, in
    the frames of their links.
    """
    engine = Engine(at_posture(robot, posture))
    found = {}
    for node, point in points.items():
        turn, origin = engine.axes(point.link), engine.position(point.link, np.zeros(3))
        found[node] = replace(point, position=turn.T @ (point.position - origin), axes=point.axes @ turn)
    return found


def on_link(point: Point, link: str, robot: Robot, posture: Array) -> Point:
    """The point on another link, at the same place and looking the same way at `posture` (joints,), rad."""
    engine = Engine(at_posture(robot, posture))
    place, axes = engine.position(point.link, point.position), point.axes @ engine.axes(point.link).T
    return in_links({0: replace(point, link=link, position=place, axes=axes)}, robot, posture)[0]
