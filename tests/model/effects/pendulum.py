"""A rod of 3 kg hanging from a hinge above a base of 50 kg: small enough for textbook formulas."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.model.effects.base import parse_effect
from identify.model.system import System, assemble, build_site, list_parameters
from identify.robot.points import Point
from identify.robot.urdf import read_urdf
from tests.arms import initial
from tests.model.undamped import undamped_modes

PENDULUM = """<robot name="pendulum">
<link name="ground"><inertial><origin xyz="0 0 0"/><mass value="50"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="3"/>
<inertia ixx="0.2" iyy="0.2" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="ground"/><child link="rod"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint>
</robot>"""  # noqa: E501
DRIVE = {"kind": "joint-compliance", "stiffness": {"initial": 400.0}, "damping": {"initial": 1.0}}


def pendulum(
    folder: Path, effects: list[dict[str, object]], points: dict[int, Point] | None = None
) -> tuple[System, np.ndarray]:
    """The pendulum with effects, hanging, and the start values of its parameters."""
    path = folder / "pendulum.urdf"
    path.write_text(PENDULUM)
    robot, parsed = read_urdf(path), [parse_effect(effect) for effect in effects]
    site = build_site(robot, np.zeros(1), parsed, points=points)
    return assemble(robot, site, parsed), initial(list_parameters(robot, site, parsed))


def frequency(
    folder: Path, effects: list[dict[str, object]], points: dict[int, Point] | None = None
) -> np.ndarray:
    model, values = pendulum(folder, effects, points)
    mass, _, stiffness = model.matrices(values)
    return undamped_modes(mass, stiffness)[0]
