"""Small arms and studies of motion, written as files and read as a user's would be."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study

MASS, LENGTH, INERTIA = 10.0, 0.4, 0.5
"""Of the one-link arm: mass, distance of its centre from the joint, and inertia about the centre."""
ABOUT_JOINT = INERTIA + MASS * LENGTH**2


def one_link(gravity: float) -> dict[str, Any]:
    """An arm of one link that turns about the ground's z, with gravity along -y: it hangs at -90 degrees."""
    return {
        "name": "pendulum",
        "convention": "standard",
        "joints": [{"name": "joint1", "d_m": 0.0, "a_m": 2 * LENGTH, "alpha_deg": 0.0}],
        "links": [
            {
                "name": "arm",
                "mass_kg": MASS,
                "centre_m": [-LENGTH, 0, 0],
                "inertia_kg_m2": [INERTIA, INERTIA, INERTIA, 0, 0, 0],
            }
        ],
        "gravity_m_s2": [0, -gravity, 0],
    }


def three_links() -> dict[str, Any]:
    """A column, an upper arm and a forearm."""

    def link(name: str, mass: float, centre: list[float]) -> dict[str, Any]:
        return {
            "name": name,
            "mass_kg": mass,
            "centre_m": centre,
            "inertia_kg_m2": [0.8, 1.1, 1.3, 0.02, -0.01, 0.03],
        }

    return {
        "name": "three",
        "convention": "standard",
        "joints": [
            {"name": "a", "d_m": 0.5, "a_m": 0.1, "alpha_deg": -90},
            {"name": "b", "d_m": 0, "a_m": 0.7, "alpha_deg": 0, "theta_offset_deg": -90},
            {"name": "c", "d_m": 0.05, "a_m": 0.6, "alpha_deg": 20},
        ],
        "links": [
            link("column", 40, [0, 0.1, 0.02]),
            link("upper", 25, [-0.3, 0.01, 0.03]),
            link("fore", 18, [-0.25, 0.02, 0]),
        ],
    }


PLAIN_MOTOR = {"kind": "torque", "rotor_inertia": 0.001}
CASCADE = {
    "kind": "cascade",
    "position_gain": 8.0,
    "velocity_gain": 60.0,
    "velocity_integral": 4.0,
    "velocity_feedforward": 1.0,
}


def study(folder: Path, robot: dict[str, Any], **keys: Any) -> MotionProblem:
    """A problem of motion from a robot and the keys of a study; one record that stands still for a second
    unless given.
    """
    data = {
        "schema": "identify-motion/1",
        "robot": {"dh": "robot.yaml"},
        "motor": PLAIN_MOTOR,
        "gear": {"ratio": 50.0},
        "servo": CASCADE,
        "records": [{"name": "still", "start_deg": [0.0] * len(robot["joints"]), "duration_s": 1.0}],
        **keys,
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.yaml").write_text(json.dumps(robot))
    (folder / "motion.yaml").write_text(json.dumps(data))
    return load_motion(read_motion_study(folder / "motion.yaml"))


def move(joint: int, by_deg: float, speed_deg_s: float, start_s: float = 0.1, **more: Any) -> dict[str, Any]:
    """One joint move."""
    return {
        "joint": joint,
        "start_s": start_s,
        "by_deg": by_deg,
        "speed_deg_s": speed_deg_s,
        "acceleration_deg_s2": 400.0,
        **more,
    }
