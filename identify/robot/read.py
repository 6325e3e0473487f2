"""The robot that a config describes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from identify.robot.chain import Choice
from identify.robot.description import Robot
from identify.robot.dh import read_dh
from identify.robot.settings import RobotSettings
from identify.robot.urdf import read_urdf


def read_robot(settings: RobotSettings, folder: Path, *, unknown_bodies: bool = False) -> Robot:
    """The robot of a config with its payloads; paths are relative to `folder`.

    unknown_bodies: links may have no mass or no inertia, because these are what is looked for.
    """
    more: dict[str, Any] = {} if settings.gravity_m_s2 is None else {"gravity": settings.gravity_m_s2}
    more |= {"unknown_bodies": unknown_bodies, "units": settings.units}
    if settings.urdf:
        choice = Choice(settings.tip, settings.lock)
        robot = read_urdf(folder / settings.urdf, choice=choice, arguments=settings.arguments, **more)
    else:
        robot = read_dh(folder / (settings.dh or Path()), **more)
    for number, payload in enumerate(settings.payload):
        xx, yy, zz, xy, xz, yz = payload.inertia_kg_m2
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        robot = robot.with_payload(
            payload.link, payload.mass_kg, np.array(payload.centre_m), inertia, f"robot.payload.{number}.link"
        )
    return robot
