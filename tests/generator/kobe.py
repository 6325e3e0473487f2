"""The two hammer tests of the Kobe study, simulated in the time domain: python -m tests.generator.kobe
data/kobe_36dof.

First the arm without J4 to J6, then the whole of it; servos on.  Base and first link are elastic, which the
user of the data is not told. Five hits along Y; every point is recorded with each, with noise of its own on
force and response, as if it had been struck anew.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tests.generator.chain import Chain
from tests.generator.estimate import Estimate, h1
from tests.generator.hammer import swing
from tests.generator.kobe_arm import AXES, POSTURE_DEG, Kobe, joint_frame, kobe
from tests.generator.linear import linearise
from tests.generator.rigid import ball
from tests.generator.servo import Loop, ServoPlant
from tests.generator.structure import BaseCompliance, LinkFlexibility
from tests.generator.tree import Dof, Tree, at_posture

HITS, PEAK_N = 5, 150.0
CHAIN = Chain(
    rate=512.0, duration=2.0, oversampling=32, noise_force=0.1, noise_response=8e-3, window_decay=2.0
)
BAND_HZ = (4.0, 100.0)
BASE = BaseCompliance(("rx", "ry"), (4.0e6, 4.0e6), (1500.0, 1500.0))
_BENDING, _HINGES = 1.2e6, 2
_NO_MASS = 1e-6
"""kg: an engine's body cannot be without."""
TESTS = {"detached": 3, "whole": 6}
"""Joints that are there."""


def tree_of(robot: Kobe, joints: int) -> Tree:
    """The arm at its posture with its first `joints` joints, all six coordinates of each, a rotor before each
    gear, and what is hidden.
    """
    tree = at_posture(robot.arm, POSTURE_DEG)
    tree.parts = tree.parts[: joints + 1]
    tree.sensors = [sensor for sensor in tree.sensors if sensor.part <= joints]
    for joint in range(1, joints + 1):
        part, frame, drive = tree.parts[joint], joint_frame(robot.arm, joint), robot.drives[joint - 1]
        part.dofs = []
        for row in (0, 1, 2, 5, 3, 4):
            stiffness, damping = float(robot.stiffness[joint - 1, row]), float(robot.damping[joint - 1, row])
            part.dofs.append(Dof(f"joint{joint}.{AXES[row]}", row < 3, frame[:, row % 3], stiffness, damping))
        turns = Dof(
            f"joint{joint}.rotor", False, frame[:, 2], 0.0, 0.0, drive.rotor_inertia * drive.gear_ratio**2
        )
        rotor = replace(
            part, name=f"{part.name}.rotor", inertia=ball(_NO_MASS, np.zeros(3), 0.01), dofs=[turns]
        )
        tree.parts.append(rotor)
        part.parent, part.position, part.rotation = len(tree.parts) - 1, np.zeros(3), np.eye(3)
    BASE.build(tree)
    first_link(robot).build(tree)
    return tree


def first_link(robot: Kobe) -> LinkFlexibility:
    """Bending and torsion of link 1 between its joints, each _BENDING N m^2, damped by 1 % at 60 Hz."""
    along = robot.arm.joints[1].xyz
    hinge = _HINGES * _BENDING / float(np.linalg.norm(along))
    loss = 0.02 * hinge / (2 * np.pi * 60.0)
    return LinkFlexibility("link1", (along[0], along[1], along[2]), hinge, hinge, loss, loss, _HINGES)


def plant(robot: Kobe, joints: int) -> ServoPlant:
    """The arm with its controllers."""
    squares = [drive.gear_ratio**2 for drive in robot.drives]
    loops = [
        Loop(
            f"joint{n}.rotor",
            square * drive.velocity_gain,
            drive.position_gain,
            drive.integral_time,
            drive.current_hz,
        )
        for n, (drive, square) in enumerate(
            zip(robot.drives[:joints], squares[:joints], strict=True), start=1
        )
    ]
    return ServoPlant(tree_of(robot, joints), loops)


def hammer_test(held: ServoPlant, seed: int) -> Estimate:
    """FRFs of all channels (lines, outputs) from hits along Y of the last point."""
    rng = np.random.default_rng([seed, 0x4B])
    hits = [swing(rng, 1, PEAK_N, 0.0, CHAIN.step) for _ in range(HITS)]
    times, window, points = CHAIN.step * np.arange(CHAIN.steps), CHAIN.window(), len(held.sensors)
    forces, responses = np.empty((points, HITS, CHAIN.samples)), np.empty((points, HITS, CHAIN.samples, 3))
    for number, hit in enumerate(hits):
        motion = held.respond(held.sensors[-1], hit.force, hit.end, CHAIN.step, CHAIN.steps)
        recorded = window[:, None, None] * CHAIN.responses(motion, held.sensors, rng)
        responses[:, number] = np.moveaxis(recorded, 1, 0)
        for point in range(points):
            forces[point, number] = window * CHAIN.force(hit.reading(times), rng)
    each = [h1(forces[point], responses[point], CHAIN.rate).band(*BAND_HZ) for point in range(points)]
    return Estimate(
        each[0].frequency_hz, np.hstack([one.h1 for one in each]), np.hstack([one.coherence for one in each])
    )


def write(path: Path, estimate: Estimate, nodes: list[int]) -> None:
    """FRFs and coherences in HDF5, single precision; outputs x, y, z of each node, the input Y of the
    last.
    """
    with h5py.File(path, "w") as file:
        file["frequency_hz"] = estimate.frequency_hz
        for name, values in (
            ("frf", estimate.h1.astype(np.complex64)),
            ("coherence", estimate.coherence.astype(np.float32)),
        ):
            file.create_dataset(
                name, data=values[:, :, None], compression="gzip", compression_opts=9, shuffle=True
            )
        file["outputs"] = [f"{node}:+{axis}" for node in nodes for axis in "XYZ"]
        file["inputs"] = [f"{nodes[-1]}:+Y"]
        file.attrs.update(
            quantity="accelerance", unit="(m/s^2)/N", averages=HITS, window_decay_per_s=CHAIN.window_decay
        )


def truth(robot: Kobe) -> dict[str, Any]:
    """Everything that the user of the data is not told."""
    return {
        "hidden": [BASE.sentence, first_link(robot).sentence],
        "effects": [BASE.truth(), first_link(robot).truth()],
        "axes": list(AXES),
        "stiffness": robot.stiffness.tolist(),
        "damping": robot.damping.tolist(),
        "drives": [asdict(drive) for drive in robot.drives],
    }


def generate(folder: Path, seed: int = 36) -> None:
    """All files of the study."""
    folder.mkdir(parents=True, exist_ok=True)
    robot = kobe()
    for name, joints in TESTS.items():
        held = plant(robot, joints)
        nodes = [point.node for point in robot.arm.points if point.name in held.sensors]
        write(folder / f"{name}.h5", hammer_test(held, seed + joints), nodes)
    (folder / "robot.urdf").write_text(robot.arm.urdf(), encoding="utf-8")
    (folder / "points.csv").write_text(robot.arm.points_csv(), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(truth(robot), indent=1) + "\n", encoding="utf-8")


def fastest(held: ServoPlant) -> float:
    """Largest modulus of the poles with the controllers off, 1/s: times the step it must stay below 1.5."""
    return linearise(held, held.sensors[-1]).fastest


def main() -> None:
    """Write the study's data."""
    parser = argparse.ArgumentParser(prog="python -m tests.generator.kobe", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write")
    generate(parser.parse_args().out)


if __name__ == "__main__":
    main()
