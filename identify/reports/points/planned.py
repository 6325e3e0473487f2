"""The page of points of a planned test: its sensors and impacts on the robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.core.text import listed
from identify.measured.channel import Channel
from identify.measured.registration.place import unplaced
from identify.reports.points.page import points_page
from identify.results.plan import PlanResult
from identify.robot.description import Robot
from identify.robot.points import Point


def planned_page(result: PlanResult, robot: Robot, points: Mapping[int, Point]) -> str:
    """The robot in the first posture of a plan; points: all that could be hit and measured."""
    hit = dict[int, list[str]]()
    for impact in map(Channel.parse, result.impacts):
        hit.setdefault(impact.node, []).append(str(impact).partition(":")[2])
    sensors = {int(node) for node in result.sensors}
    said = {
        node: " and ".join(
            [
                *(["sensor"] if node in sensors else []),
                *([f"impacts along {listed(hit[node])}"] if node in hit else []),
            ]
        )
        for node in sorted({*sensors, *hit})
    }
    postures = "; ".join(", ".join(f"{angle:.1f}" for angle in one + 0.0) for one in result.posture_deg)
    places = {node: points[node] for node in said}
    placing = unplaced(robot, np.deg2rad(result.posture_deg[0]), tuple(said))
    note = f"postures of the test: {postures} degrees; drawn is the first, with the same points in all"
    return points_page(replace(placing, points=places, said=said, notes=(note, *placing.notes)))
