"""Fast-chirp tests and a hammer test, simulated in the time domain: python -m tests.generator.chirp
data/fast_chirp_rx160.

An offset mass on the spindle sweeps from rest to 40 Hz in 4 s while the tool moves at 10 mm/s through a zone;
its force acts on a spindle that hangs on the robot by a load cell of finite stiffness.  The hammer test of
the fifth zone is made with a solid spacer in the load cell's place.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import butter, sosfiltfilt

from tests.generator.chirp_arm import CELL_M, SPEED_M_PER_S, ZONES_DEG, Machine, machine
from tests.generator.estimate import h1
from tests.generator.hammer import swing
from tests.generator.moving import MovingPlant, Ride
from tests.generator.rigid import Array, ball
from tests.generator.servo import Loop
from tests.generator.tree import Dof, Part, Sensor, Tree, at_posture
from tests.generator.universal import Function, Record, dataset, time_dataset

RATE, STEP, OVERSAMPLING = 256.0, 1 / 4096, 16
SECONDS, SWEEP_S, END_HZ = 6.0, 4.0, 40.0
OFFSET_KG, RADIUS_M = 0.16, 0.02
PASSES, HITS = 3, 3
_VARIES = {"stiffness": 0.005, "damping": 0.03, "friction": 0.1, "posture_deg": 0.1}
"""Standard deviations from pass to pass, relative but for the posture: temperature, lubrication, where the
path began.
"""
NOISE = {"acceleration": 4e-3, "force": 0.15, "angle": 2e-4}
_HAMMER_S = 4.0
_NO_MASS = 1e-6
_CELL = ("tx", "ty", "tz")


@dataclass(frozen=True)
class Sweep:
    """An offset mass (kg) at a radius (m) whose speed rises evenly from rest to `end_hz` in `seconds` and
    falls again in `brake_s`.
    """

    offset_kg: float = OFFSET_KG
    radius_m: float = RADIUS_M
    end_hz: float = END_HZ
    seconds: float = SWEEP_S
    brake_s: float = 1.0

    def turning(self, time: Array | float) -> tuple[Array, Array, Array]:
        """Angle (rad), speed (rad/s) and acceleration (rad/s^2) at any times (s)."""
        top, time = 2 * np.pi * self.end_hz, np.asarray(time, dtype=float)
        rise, fall = np.clip(time, 0.0, self.seconds), np.clip(time - self.seconds, 0.0, self.brake_s)
        up, down = top / self.seconds, top / self.brake_s
        angle = up * rise**2 / 2 + top * fall - down * fall**2 / 2
        acceleration = np.where(
            time < self.seconds, up, np.where(time < self.seconds + self.brake_s, -down, 0.0)
        )
        return angle, up * rise - down * fall, acceleration

    def force(self, time: float) -> Array:
        """(3,), N: what the mass does to the spindle, by its acceleration along and across the radius."""
        angle, speed, acceleration = (float(value) for value in self.turning(time))
        out, along = (
            np.array([np.sin(angle), -np.cos(angle), 0.0]),
            np.array([np.cos(angle), np.sin(angle), 0.0]),
        )
        return np.asarray(self.offset_kg * self.radius_m * (speed**2 * out - acceleration * along))


def tree_of(robot: Machine, posture_deg: ArrayLike, spacer: bool = False) -> Tree:
    """The robot in the middle of its path: base, tri-axial joints, rotors, and the spindle on its load cell
    or on a solid spacer.
    """
    tree = at_posture(robot.known if spacer else robot.bare, posture_deg)
    tree.parts[0].dofs = [
        Dof(f"base.r{axis}", False, np.eye(3)[n], *robot.base[:, n].tolist()) for n, axis in enumerate("xyz")
    ]
    for joint in range(1, 7):
        part, drive = tree.parts[joint], robot.drives[joint - 1]
        springs = zip((2, 0, 1), "zxy", strict=True)
        stiffness, damping = robot.stiffness[joint - 1], robot.damping[joint - 1]
        part.dofs = [
            Dof(f"joint{joint}.r{axis}", False, np.eye(3)[n], float(stiffness[n]), float(damping[n]))
            for n, axis in springs
        ]
        turns = Dof(
            f"joint{joint}.rotor", False, np.eye(3)[2], 0.0, 0.0, drive.rotor_inertia * drive.gear_ratio**2
        )
        tree.parts.append(
            replace(part, name=f"{part.name}.rotor", inertia=ball(_NO_MASS, np.zeros(3), 0.01), dofs=[turns])
        )
        part.parent, part.position, part.rotation = len(tree.parts) - 1, np.zeros(3), np.eye(3)
    if not spacer:
        slides = [
            Dof(f"cell.{name}", True, np.eye(3)[n], *robot.cell[:, n].tolist())
            for n, name in enumerate(_CELL)
        ]
        tree.parts.append(Part("spindle", 6, np.zeros(3), np.eye(3), robot.spindle, slides))
        tool = tree.sensor("tool")
        tree.sensors[tree.sensors.index(tool)] = Sensor("tool", tool.node, len(tree.parts) - 1, tool.position)
    return tree


def plant(robot: Machine, posture_deg: ArrayLike, spacer: bool = False) -> MovingPlant:
    """The robot with its controllers and friction."""
    loops = [
        Loop(
            f"joint{n}.rotor",
            d.gear_ratio**2 * d.velocity_gain,
            d.position_gain,
            d.integral_time,
            d.current_hz,
        )
        for n, d in enumerate(robot.drives, start=1)
    ]
    return MovingPlant(tree_of(robot, posture_deg, spacer), loops, robot.friction.tolist())


def path_rates(robot: Machine, zone: str) -> Array:
    """Joint rates (6,), rad/s, that move the tool along Y of the floor at 10 mm/s without turning it more
    than needed (least squares).
    """

    def tool(angles: Array) -> Array:
        tree = at_posture(robot.known, np.degrees(angles))
        rotation, position = tree.pose(6)
        return np.concatenate([position + rotation @ robot.known.point("tool").xyz, 0.3 * rotation[:, 2]])

    middle = np.radians(ZONES_DEG[zone])
    jacobian = np.array([(tool(middle + 1e-6 * e) - tool(middle - 1e-6 * e)) / 2e-6 for e in np.eye(6)]).T
    return np.asarray(
        np.linalg.lstsq(jacobian, np.array([0.0, SPEED_M_PER_S, 0.0, 0.0, 0.0, 0.0]), rcond=1e-2)[0]
    )


def sampled(signal: Array) -> Array:
    """At RATE, behind an anti-alias filter without phase, common to all channels."""
    filtered = sosfiltfilt(butter(6, 0.4 * RATE, fs=1 / STEP, output="sos"), signal, axis=0)
    return np.asarray(filtered[::OVERSAMPLING])


def chirp_pass(robot: Machine, zone: str, rng: np.random.Generator) -> list[Record]:
    """One pass: spindle angle, force of the load cell, acceleration of the bracket, sampled with noise, as an
    analyser records them.
    """
    today = varied(robot, rng)
    held, steps = (
        plant(today, ZONES_DEG[zone] + _VARIES["posture_deg"] * rng.normal(size=6)),
        round(SECONDS / STEP),
    )
    sweep = Sweep()
    ride = held.ride(
        "tool", sweep.force, path_rates(robot, zone), STEP, steps, [f"cell.{name}" for name in _CELL]
    )
    return records(ride, sweep, rng)


def varied(robot: Machine, rng: np.random.Generator) -> Machine:
    """The robot as it is on one pass."""

    def scattered(values: Array, share: float) -> Array:
        return np.asarray(values * np.exp(share * rng.normal(size=values.shape)))

    return replace(
        robot,
        stiffness=scattered(robot.stiffness, _VARIES["stiffness"]),
        damping=scattered(robot.damping, _VARIES["damping"]),
        friction=scattered(robot.friction, _VARIES["friction"]),
    )


def records(ride: Ride, sweep: Sweep, rng: np.random.Generator) -> list[Record]:
    """The analyser's channels: 14:RZ spindle angle, 13 the force that the robot feels, 12 the acceleration of
    the bracket.
    """
    quiet = round(0.05 / STEP)
    # The springs push the spindle back towards the robot, which feels the opposite.
    felt = sampled(-(ride.spring_force - ride.spring_force[:quiet].mean(axis=0)))
    shaken = sampled(ride.acceleration[:, 0] - ride.acceleration[:quiet, 0].mean(axis=0))
    angle = sweep.turning(np.arange(len(felt)) / RATE)[0]
    result = [Record(14, 6, "rad", angle + NOISE["angle"] * rng.normal(size=len(angle)))]
    for axis in range(3):
        result.append(Record(13, axis + 1, "N", felt[:, axis] + NOISE["force"] * rng.normal(size=len(felt))))
        result.append(
            Record(
                12, axis + 1, "m/s^2", shaken[:, axis] + NOISE["acceleration"] * rng.normal(size=len(shaken))
            )
        )
    return result


def hammer(robot: Machine, zone: str, rng: np.random.Generator) -> bytes:
    """FRFs of the bracket from the tool in all three directions, some hits each of 200 N, the robot moving,
    a spacer for the load cell.
    """
    held, steps = plant(robot, ZONES_DEG[zone], spacer=True), round(_HAMMER_S / STEP)
    parts, points = [], {point.name: point for point in robot.known.points}
    rates, times = path_rates(robot, zone), np.arange(steps) * STEP
    idle = held.ride("tool", lambda time: np.zeros(3), rates, STEP, steps, [])
    for axis in range(3):
        forces, responses = [], []
        for _ in range(HITS):
            hit = replace(swing(rng, axis, 200.0, 0.0, STEP), start=0.05)
            ride = held.ride("tool", hit.force, rates, STEP, steps, [])
            force, motion = (
                sampled(hit.reading(times)),
                sampled(ride.acceleration[:, 0] - idle.acceleration[:, 0]),
            )
            forces.append(force + 0.1 * rng.normal(size=len(force)))
            responses.append(motion + NOISE["acceleration"] * rng.normal(size=motion.shape))
        estimate = h1(np.array(forces), np.array(responses), RATE).band(4.0, 45.0)
        for channel in range(3):
            ends = (points["bracket"], channel, points["tool"], axis)
            parts.append(Function(estimate.frequency_hz, estimate.h1[:, channel], *ends))
            parts.append(Function(estimate.frequency_hz, estimate.coherence[:, channel], *ends))
    return b"".join(dataset(part, binary=True) for part in parts)


def truth(robot: Machine) -> dict[str, Any]:
    """What the user of the data is not told."""
    return {
        "hidden": [
            f"load cell of finite stiffness at z = {CELL_M} m of link 6, the spindle of"
            f" {robot.spindle.mass:.1f} kg beyond it"
        ],
        "axes": ["rx", "ry", "rz"],
        "stiffness": robot.stiffness.tolist(),
        "damping": robot.damping.tolist(),
        "base": robot.base.tolist(),
        "cell": robot.cell.tolist(),
        "spindle": {"mass": robot.spindle.mass, "centre": robot.spindle.centre.tolist()},
        "friction": robot.friction.tolist(),
    }


def generate(folder: Path, seed: int = 160) -> None:
    """All files of the study."""
    folder.mkdir(parents=True, exist_ok=True)
    robot = machine()
    for number, zone in enumerate(ZONES_DEG):
        for repeat in range(PASSES):
            recorded = chirp_pass(robot, zone, np.random.default_rng([seed, number, repeat]))
            content = b"".join(time_dataset(record, RATE) for record in recorded)
            (folder / f"{zone}_pass{repeat + 1}.uff").write_bytes(content)
    (folder / "hammer_zone5.uff").write_bytes(hammer(robot, "zone5", np.random.default_rng([seed, 99])))
    (folder / "robot.urdf").write_text(robot.known.urdf(), encoding="utf-8")
    (folder / "points.csv").write_text(robot.known.points_csv(), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(truth(robot), indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Write the study's data."""
    parser = argparse.ArgumentParser(prog="python -m tests.generator.chirp", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write")
    generate(parser.parse_args().out)


if __name__ == "__main__":
    main()
