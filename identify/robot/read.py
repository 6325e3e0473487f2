"""The robot that a config describes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from identify.robot.description import Robot
from identify.robot.dh import read_dh
from identify.robot.settings import RobotSettings
from identify.robot.urdf import read_urdf


def read_robot(settings: RobotSettings, folder: Path, *, unknown_bodies: bool = False) -> Robot:
    """The robot of a config with its payloads; paths are relative to `folder`.

    unknown_bodies: links may have no mass or no inertia, because these are what is looked for.
    """
    path = settings.urdf or settings.dh or Path()
    pull: dict[str, Any] = {} if settings.gravity_m_s2 is None else {"gravity": settings.gravity_m_s2}
    read = read_urdf if settings.urdf else read_dh
    robot = read(folder / path, unknown_bodies=unknown_bodies, units=settings.units, **pull)
    for number, payload in enumerate(settings.payload):
        xx, yy, zz, xy, xz, yz = payload.inertia_kg_m2
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        robot = robot.with_payload(
            payload.link, payload.mass_kg, np.array(payload.centre_m), inertia, f"robot.payload.{number}.link"
        )
    return robot
