"""The points of a study in the frames of their links, whichever frame its file has them in."""

from __future__ import annotations

from pathlib import Path

from identify.core.errors import InputError
from identify.robot.description import Robot
from identify.robot.points import Point, check_links, read_points
from identify.robot.points_frame import in_links
from identify.vibration.study import Study


def study_points(study: Study, path: Path, robot: Robot) -> dict[int, Point]:
    """The points in a file of a study; InputErrors as `read_points`, and for points on no link or a posture
    of another number of joints.
    """
    points = read_points(path)
    check_links(points, robot)
    stated = study.points_posture_deg
    if stated is None:
        return points
    if len(stated) != len(robot.joints):
        expected = f"{len(robot.joints)}, one per joint of {robot.name!r}"
        raise InputError("points_posture_deg", f"{len(stated)} angles", expected)
    return in_links(points, robot, study.joint_angles.posture(stated))
