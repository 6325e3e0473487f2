"""The points of a study in the frames of their links: of its file, in whichever frame, or of the geometry of
the test, laid on the robot.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from identify.core.errors import InputError
from identify.measured.loaders import frf_files
from identify.measured.registration.geometry_file import geometry_of, has_nodes
from identify.measured.registration.place import Placing, placed, unplaced
from identify.measured.registration.settings import RegistrationSettings
from identify.robot.description import Robot
from identify.robot.points import Point, check_links, read_points
from identify.robot.points_frame import in_links
from identify.vibration.study import MeasurementSettings, Study, StudyFile


@dataclass(frozen=True)
class Source:
    """A file with the geometry of the test, and the joint angles at which it was measured, as stated."""

    path: Path
    posture_deg: list[float]


def points_of(file: StudyFile, robot: Robot) -> dict[int, Point]:
    """The points of a study, by node; none where it has neither points nor a geometry.

    InputErrors as `study_points`, and InputError as `placed`.
    """
    return points_and_placing(file, robot)[0]


def points_and_placing(file: StudyFile, robot: Robot) -> tuple[dict[int, Point], Placing | None]:
    """The same with what `placing_of` finds."""
    if file.study.points is not None:
        return study_points(file.study, file.resolve(file.study.points), robot), None
    found = placing_of(file, robot)
    return {} if found is None else dict(found.points or {}), found


def placing_of(file: StudyFile, robot: Robot) -> Placing | None:
    """The geometry of the test on the robot; None for a study with points, or without a geometry."""
    source = geometry_source(file)
    if source is None:
        return None
    if len(source.posture_deg) != len(robot.joints):
        expected = f"{len(robot.joints)}, one per joint of {robot.name!r}"
        raise InputError("registration.posture_deg", f"{len(source.posture_deg)} angles", expected)
    told = file.study.registration or RegistrationSettings()
    pairs = {} if told.pairs is None else read_points(file.resolve(told.pairs))
    angles = file.study.joint_angles.posture(source.posture_deg)
    geometry = geometry_of(source.path, told.length_unit)
    return _placing(pickle.dumps((robot, angles, geometry, pairs, told)))


@lru_cache(maxsize=2)
def _placing(told: bytes) -> Placing:
    """It takes seconds, and a command asks several times."""
    robot, angles, geometry, pairs, settings = pickle.loads(told)
    return placed(unplaced(robot, angles), geometry, pairs, settings)


def geometry_source(file: StudyFile) -> Source | None:
    """Where the points of a study without a file of them come from; InputError where its registration has
    nothing to lay.
    """
    study = file.study
    told = study.registration or RegistrationSettings()
    if study.points is not None:
        return None
    holding = ((path, one) for one in study.measurements for path in _files(file, one))
    if told.geometry is not None:
        there = file.resolve(told.geometry)
        if not has_nodes(there):
            found = "no nodes" if there.exists() else "no such file"
            raise InputError(
                f"registration.geometry: {told.geometry}", found, "a universal file or CSV of nodes"
            )
        own = next((one for path, one in holding if path == there), study.measurements[0])
        return Source(there, told.posture_deg or own.posture_deg)
    found_in = next(((path, one) for path, one in holding if has_nodes(path, one.format)), None)
    if found_in is None:
        if study.registration is None:
            return None
        expected = "nodes in a file of FRFs (datasets 15 or 2411), or `geometry`"
        raise InputError("registration", "no measurement has a geometry", expected)
    return Source(found_in[0], told.posture_deg or found_in[1].posture_deg)


def _files(file: StudyFile, measurement: MeasurementSettings) -> list[Path]:
    """The files of measured functions that are there."""
    if measurement.file is None:
        return []
    try:
        return [path for one in measurement.sources for path in frf_files(file.resolve(one))]
    except InputError:
        return []  # the loader says why


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


def off_robot(placing: Placing | None) -> frozenset[int]:
    """Nodes of the geometry that lie on no link."""
    return frozenset() if placing is None else frozenset(placing.nodes) - frozenset(placing.points or {})
