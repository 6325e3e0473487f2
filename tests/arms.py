"""Small systems for tests: random arms with effects, assembled at a random posture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from identify.core.parameters import Parameter
from identify.model.effects.base import Effect, parse_effect
from identify.model.system import System, assemble, build_site, list_parameters
from identify.robot.description import Robot
from identify.robot.urdf import read_urdf
from tests.robot.random_arm import industrial_arm, random_posture, write

ALL_EFFECTS: list[dict[str, Any]] = [
    {"kind": "joint-compliance", "joints": "all", "axes": ["rz", "rx", "ty"]},
    {"kind": "base-compliance", "axes": ["rx", "tz"]},
    {
        "kind": "added-mass",
        "link": "link4",
        "at_m": [0.1, 0.0, 0.2],
        "mass": {"initial": 7.0, "bounds": [0.0, 50.0]},
    },
    {
        "kind": "rotor-inertia",
        "joints": [2, 3],
        "gear_ratio": [100, 80],
        "inertia": {"initial": 1e-3, "bounds": [1e-5, 1e-1]},
    },
    {
        "kind": "rotor-inertia",
        "joints": [1],
        "gear_ratio": [120],
        "inertia": {"initial": 2e-3, "bounds": [1e-5, 1e-1]},
        "holding_stiffness": {"initial": 3e6},
    },
]


def arm(folder: Path, seed: int = 1) -> Robot:
    """A random industrial arm."""
    return read_urdf(write(folder, industrial_arm(seed)))


def system(
    robot: Robot, effects: list[dict[str, Any]], seed: int = 1
) -> tuple[System, list[Parameter], list[Effect]]:
    """The arm with effects at a random posture."""
    parsed = [parse_effect(effect) for effect in effects]
    site = build_site(robot, random_posture(seed), parsed)
    return assemble(robot, site, parsed), list_parameters(robot, site, parsed), parsed


def initial(parameters: list[Parameter]) -> np.ndarray:
    """Start values of all parameters."""
    return np.array([parameter.initial for parameter in parameters])
