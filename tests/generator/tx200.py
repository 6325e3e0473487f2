"""A hammer test of the TX200 of UMONS (ICSV25, 2018) with what it suspects built in: python -m
tests.generator.tx200 data/umons_open.

Geometry, masses and gripper are those of data/umons_tx200; the drives are about those of the paper.  Joint 2
tilts about axes orthogonal to its motion (paper, page 8), and on the arm sits a local mode near 22 Hz across
the robot's plane (page 4).
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from tests.generator.arm import Arm, Joint, Link, Point
from tests.generator.generate import generate
from tests.generator.rigid import Array, Inertia, to_rpy, turn
from tests.generator.spec import TestSpec
from tests.generator.structure import AppendedResonator, JointCompliance

SOURCE = Path(__file__).parents[2] / "data" / "umons_tx200"
NODES = (9, 13, 15, 19, 24, 1)
"""Shoulder, arm middle and top, forearm, gripper; the wrist, which is struck, last."""
POSTURES_DEG = (
    (-90.0, 28.47, 127.53, 0.0, -66.06, 0.0),
    (-60.0, 5.0, 105.0, 25.0, -40.0, 30.0),
    (-110.0, 45.0, 95.0, -20.0, -80.0, -40.0),
)
"""The paper's Table 1, then two of ours."""
STIFFNESS = (3.0e6, 2.3e6, 0.95e6, 1.559e6, 0.377e6, 1.56e6)
"""N m/rad: joints 4 to 6 from the paper's Table 2, 1 to 3 such that with our inertias and the tilt the first
modes are near its own.
"""
DAMPING = (2371.92, 2918.17, 670.37, 316.03, 77.51, 5.89)
"""N m s/rad, Table 2."""
TILT = JointCompliance(2, "tilt", (1.2e6, 1.6e6), (900.0, 2500.0))
LOCAL = AppendedResonator("arm", "z", (0.60, 0.05, -0.16), 12.0, 22.0, 0.03)


def tx200(seed: int = 1) -> Arm:
    """The robot with its gripper; the seed changes nothing."""
    robot, gripper = (YAML(typ="safe").load(SOURCE / name) for name in ("robot.yaml", "gripper.yaml"))
    bodies = [(body["name"], _inertia(body)) for body in (robot["base"], *robot["links"])]
    links = tuple(
        Link(name, inertia + _inertia(gripper) if name == gripper["link"] else inertia)
        for name, inertia in bodies
    )
    joints = tuple(_joint(row) for row in robot["joints"])
    return Arm(
        "tx200", links, joints, _points(), np.array(POSTURES_DEG[0]), np.array(STIFFNESS), np.array(DAMPING)
    )


def _joint(row: dict[str, Any]) -> Joint:
    """A row of the modified Denavit-Hartenberg table: turn and shift along x, then turn and shift along z."""
    twist = turn([1, 0, 0], np.radians(row["alpha_deg"]))
    shift = np.array([row["a_m"], 0.0, 0.0]) + twist @ [0.0, 0.0, row["d_m"]]
    rotation = twist @ turn([0, 0, 1], np.radians(row["theta_offset_deg"]))
    return Joint(
        row["name"],
        np.round(shift, 12),
        np.asarray(to_rpy(np.round(rotation, 12))),
        np.array([0.0, 0.0, 1.0]),
    )


def _inertia(body: dict[str, Any]) -> Inertia:
    xx, yy, zz, xy, xz, yz = body["inertia_kg_m2"]
    tensor: Array = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Inertia(body["mass_kg"], np.array(body["centre_m"], dtype=float), tensor)


def _points() -> tuple[Point, ...]:
    """Those of the study, measuring along the axes of their links: Z of the wrist is x of the paper, X its z
    and -Y its y.
    """
    rows = [line.split(",") for line in (SOURCE / "points.csv").read_text(encoding="utf-8").splitlines()[1:]]
    named = {int(row[0]): Point(int(row[0]), row[1], row[2], np.array(row[3:6], dtype=float)) for row in rows}
    return tuple(named[node] for node in NODES)


def spec() -> TestSpec:
    """The test: as the paper's where it says (four averages, lines of 0.625 Hz up to 80 Hz), but the hammer
    at the wrist (reciprocity).
    """
    return TestSpec(tx200(), (TILT, LOCAL), seed=200, case="tilt_j2+absorber_l2", binary=True)


def main() -> None:
    """Write the study's data; the robot is in data/umons_tx200."""
    parser = argparse.ArgumentParser(prog="python -m tests.generator.tx200", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write")
    out = parser.parse_args().out
    generate(spec(), out, out / "truth.json", np.array(POSTURES_DEG))
    (out / "robot.urdf").unlink()


if __name__ == "__main__":
    main()
