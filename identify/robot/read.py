"""The robot that a config describes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.config_paths import robot_key
from identify.robot.chain import Choice
from identify.robot.description import Link, Robot
from identify.robot.dh import read_dh
from identify.robot.pose import pose, seen_from
from identify.robot.settings import RobotSettings
from identify.robot.urdf import GRAVITY, read_urdf


def settings_of(file: Path, choice: Choice, arguments: Mapping[str, str]) -> RobotSettings:
    """Settings of a robot that a file describes; arguments: of a xacro."""
    said = {"tip": choice.tip, "lock": dict(choice.lock), "arguments": dict(arguments)}
    given = {name: value for name, value in said.items() if value}
    return RobotSettings.model_validate({robot_key(file): file.resolve(), **given})


def read_robot(settings: RobotSettings, folder: Path, *, unknown_bodies: bool = False) -> Robot:
    """The robot of a config with its payloads; paths are relative to `folder`.

    unknown_bodies: links may have no mass or no inertia, because these are what is looked for.
    """
    more: dict[str, Any] = {} if settings.gravity_m_s2 is None else {"gravity": settings.gravity_m_s2}
    if settings.mounted_rpy_deg is not None:
        turn = pose(np.zeros(3), np.radians(settings.mounted_rpy_deg))[:3, :3]
        more["gravity"] = tuple(map(float, turn.T @ GRAVITY))
    more |= {"unknown_bodies": unknown_bodies, "units": settings.units}
    if settings.urdf:
        choice = Choice(settings.tip, settings.lock)
        robot = read_urdf(folder / settings.urdf, choice=choice, arguments=settings.arguments, **more)
    else:
        robot = read_dh(folder / (settings.dh or Path()), **more)
    return carrying(robot, settings)


def carrying(robot: Robot, settings: RobotSettings) -> Robot:
    """A robot as its file describes it, with the payloads of a config."""
    for number, payload in enumerate(settings.payload):
        xx, yy, zz, xy, xz, yz = payload.inertia_kg_m2
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        carrier, at = robot.carrier(payload.link)
        body = seen_from(Link("payload", payload.mass_kg, np.array(payload.centre_m), inertia), at)
        where = f"robot.payload.{number}.link"
        robot = robot.with_payload(carrier, body.mass, body.centre, body.inertia, where)
    return robot
