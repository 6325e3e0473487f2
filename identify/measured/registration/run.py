"""`identify points`: from a robot, its posture and the files of a test to where each node is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from identify.core.errors import InputError
from identify.measured.frf_records import FrfFileOptions
from identify.measured.loaders import load_of_any_unit
from identify.measured.registration.geometry_file import geometry_of, has_nodes, nodes_alone
from identify.measured.registration.place import Placing, placed, unplaced
from identify.measured.registration.settings import RegistrationSettings
from identify.robot.chain import Choice
from identify.robot.points import read_points
from identify.robot.read import read_robot, settings_of


@dataclass(frozen=True)
class Asked:
    """posture_deg: stated angles, none for all 0; registration: how the geometry lies on the robot; choice,
    arguments: which part of the description is the arm, and of a xacro.
    """

    posture_deg: Sequence[float] = ()
    registration: RegistrationSettings = field(default_factory=RegistrationSettings)
    choice: Choice = field(default_factory=Choice)
    arguments: Mapping[str, str] = field(default_factory=dict)


def place_points(robot_file: Path, data: Sequence[Path], asked: Asked) -> Placing:
    """The nodes of files on a robot; without a geometry in them, their numbers alone.

    InputError for a file that cannot be read, or nodes that fit nowhere.
    """
    settings = settings_of(robot_file, asked.choice, asked.arguments)
    robot = read_robot(settings, Path(), unknown_bodies=True)
    stated = np.radians(asked.posture_deg or [0.0] * len(robot.joints))
    if len(stated) != len(robot.joints):
        expected = f"{len(robot.joints)}, one per joint ({', '.join(j.name for j in robot.joints)})"
        raise InputError("--posture", f"{len(stated)} angles", expected)
    channels, told = _channels(data), asked.registration
    plain = unplaced(robot, stated, tuple(sorted(channels)))
    source = next((path for path in data if has_nodes(path)), None)
    if source is None:
        for option, value in (("--pairs", told.pairs), ("--length-unit", told.length_unit)):
            if value is not None:
                found = f"{value}, and no geometry in the data"
                raise InputError(option, found, "a universal file or CSV with the nodes of the test")
        return replace(plain, notes=plain.shown.missing)
    if not asked.posture_deg:
        joints = ", ".join(joint.name for joint in robot.joints)
        found = f"the geometry of {source.name}, and no posture"
        raise InputError("--posture", found, f"the angles of {joints} in degrees, such as 0,30,-60,0,45,0")
    pairs = {} if told.pairs is None else read_points(told.pairs)
    return replace(placed(plain, geometry_of(source, told.length_unit), pairs, told), axes=channels)


def _channels(data: Sequence[Path]) -> dict[int, set[int]]:
    """Of the nodes of measured FRFs: their axes, 1 to 3."""
    found: dict[int, set[int]] = {}
    for path in data:
        if nodes_alone(path):
            continue
        frfs, _ = load_of_any_unit([path], FrfFileOptions())
        for channel in (*frfs.outputs, *frfs.inputs):
            found.setdefault(channel.node, set()).add(abs(channel.direction))
    return found
