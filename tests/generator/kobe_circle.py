"""The circular test of the Kobe study, simulated: python -m tests.generator.kobe_circle data/kobe_circle.

The robot of `kobe` with its elastic base and first link, which the user of the data is not told, moves its
loading mass along a circle of 5 mm at 2,000 mm/min; motors have friction, controllers are sampled.  What is
recorded: motor angles, and the tool by a laser tracker.  Beside it each joint moves to and fro alone, with
its motor's torque recorded, for its friction.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import mujoco
import numpy as np

from tests.generator.arm import Arm
from tests.generator.kobe import plant
from tests.generator.kobe_arm import POSTURE_DEG, Kobe, kobe
from tests.generator.rigid import Array
from tests.generator.servo import ServoPlant

RADIUS_M, FEED_M_S, TURNS, START_S, DURATION_S = 5e-3, 2.0 / 60, 2.0, 0.2, 2.2
ACCELERATION_M_S2, SMOOTHING_S = 1.0, 0.02
PERIOD_S, POSITION_EVERY, PARTS, RECORDED_EVERY = 2.5e-4, 4, 4, 8
COULOMB, VISCOUS = np.array([45.0, 50, 30, 4, 5, 1]), np.array([60.0, 70, 40, 4, 5, 2])
"""N m and N m s/rad at the gear output, of motor and joint bearing."""
SINE_DEG, SINE_S, SINE_EVERY, NOISE_TORQUE = 8.0, 6.0, 16, 0.02
"""Of records of single joints: amplitude; duration; ticks per sample; noise of a torque over the joint's
Coulomb friction.
"""
NOISE_TOOL_M, NOISE_ANGLE_RAD = 3e-6, 1e-6
_FOCUS = np.array([0.24, 0.09, 0.0])


def tool_of(arm: Arm, angles: Array) -> tuple[Array, Array, Array]:
    """Place (3,) and axes (3, 3) of the tool on rigid links at joint angles (6,), rad, and the Jacobian (6,
    6) of both.
    """
    rotation, position, axes, origins = np.eye(3), np.zeros(3), [], []
    for joint, angle in zip(arm.joints, angles, strict=True):
        position, rotation = position + rotation @ joint.xyz, rotation @ joint.rotation(float(angle))
        axes.append(rotation @ joint.axis)
        origins.append(position)
    tool = position + rotation @ _FOCUS
    return tool, rotation, np.vstack([np.cross(axes, tool - np.array(origins)).T, np.array(axes).T])


def commanded(arm: Arm) -> Array:
    """Joint angles at the ticks (n, 6), rad, that lead the tool round the circle in the XY plane without
    turning it.
    """
    angles, rows = np.radians(POSTURE_DEG), []
    begin, axes, _ = tool_of(arm, angles)
    for turned in _swept():
        wanted = begin + RADIUS_M * np.array([np.cos(turned) - 1, np.sin(turned), 0.0])
        for _ in range(6):
            place, now, jacobian = tool_of(arm, angles)
            tilt = sum(np.cross(now[:, n], axes[:, n]) for n in range(3)) / 2
            angles = angles + np.linalg.solve(jacobian, np.concatenate([wanted - place, tilt]))
        rows.append(angles)
    return np.array(rows)


def _swept() -> Array:
    """Angle about the centre at the ticks, rad: constant feed between ramps, averaged over the smoothing
    time.
    """
    fine = 10
    time = np.arange(round(DURATION_S / PERIOD_S) * fine + 1) * PERIOD_S / fine - START_S
    ramp, length = FEED_M_S / ACCELERATION_M_S2, TURNS * 2 * np.pi * RADIUS_M
    whole = length / FEED_M_S + ramp
    speed = FEED_M_S * np.minimum(np.minimum(time, whole - time) / ramp, 1.0).clip(min=0.0)
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)]) * PERIOD_S / fine
    area = np.concatenate([[0.0], np.cumsum((way[1:] + way[:-1]) / 2)]) * PERIOD_S / fine
    late = np.interp(time - SMOOTHING_S, time, area, left=0.0)
    return np.asarray((area - late) / SMOOTHING_S / RADIUS_M)[::fine]


class CirclePlant:
    """Motors that follow angles with cascaded loops and friction."""

    def __init__(self, robot: Kobe, held: ServoPlant) -> None:
        drives = robot.drives
        squares = np.array([drive.gear_ratio**2 for drive in drives])
        self.held, self.step = held, PERIOD_S / PARTS
        self.driven = np.array([held.coordinates.index(f"joint{n}.rotor") for n in range(1, 7)], dtype=int)
        self.gain = squares * [drive.velocity_gain for drive in drives]
        self.position_gain, self.integral_time = drives[0].position_gain, drives[0].integral_time
        self.lag = 1 - np.exp(-2 * np.pi * drives[0].current_hz * self.step)
        inertia = squares * [drive.rotor_inertia for drive in drives]
        self.creep = np.maximum(2e-4, 1.2 * COULOMB * self.step / inertia)

    def run(self, wanted: Array) -> tuple[Array, Array, Array]:
        """Motor angles less those at the start (ticks, 6), rad, places of the tool (ticks, 3), m, and torques
        of the motors at the gear output (ticks, 6), N m.
        """
        held, data = self.held, self.held.data
        held.rest()
        held.model.opt.timestep = self.step
        mujoco.mj_forward(held.model, data)
        hold = -data.qfrc_smooth[self.driven]
        rate = np.gradient(wanted, PERIOD_S, axis=0)
        asked, torque, integral, last = (np.zeros(6) for _ in range(4))
        angles, places, given = (
            np.empty((len(wanted), 6)),
            np.empty((len(wanted), 3)),
            np.empty((len(wanted), 6)),
        )
        for tick in range(len(wanted)):
            now = data.qpos[self.driven].copy()
            mujoco.mj_kinematics(held.model, data)
            angles[tick], places[tick], given[tick] = now, data.site(held.sensors[-1]).xpos, hold + torque
            if tick % POSITION_EVERY == 0:
                speed = rate[tick] + self.position_gain * (wanted[tick] - now)
            error = speed - (now - last) / PERIOD_S
            integral, last = integral + error * PERIOD_S / self.integral_time, now
            asked = self.gain * (error + integral)
            for _ in range(PARTS):
                turning = data.qvel[self.driven]
                rubbed = COULOMB * np.tanh(turning / self.creep) + VISCOUS * turning
                torque = torque + self.lag * (asked - torque)
                data.qfrc_applied[:] = 0.0
                data.qfrc_applied[self.driven] = hold + torque - rubbed
                mujoco.mj_step(held.model, data)
        return angles, places, given


def sine(joint: int) -> Array:
    """Joint angles at the ticks (n, 6), rad: one joint (from 0) to and fro twice, from rest to rest."""
    time = np.arange(round(SINE_S / PERIOD_S) + 1) * PERIOD_S
    angles = np.tile(np.radians(POSTURE_DEG), (len(time), 1))
    angles[:, joint] += (
        np.radians(SINE_DEG) * np.sin(2 * np.pi * time / 2) * np.sin(np.pi * time / SINE_S) ** 2
    )
    return angles


def generate_sines(folder: Path) -> None:
    """Write a record of each joint that moves alone, from which friction is identified."""
    robot = kobe()
    for joint in range(6):
        wanted = sine(joint)
        angles, _, torque = CirclePlant(robot, plant(robot, 6)).run(wanted - wanted[0])
        rng = np.random.default_rng([17, joint])
        moved = (angles + wanted[0])[::SINE_EVERY, joint]
        moved = moved + rng.normal(scale=NOISE_ANGLE_RAD, size=moved.shape)
        pushed = torque[::SINE_EVERY, joint] + NOISE_TORQUE * COULOMB[joint] * rng.normal(size=moved.shape)
        time = np.arange(len(moved)) * PERIOD_S * SINE_EVERY
        np.savetxt(
            folder / f"sine{joint + 1}.csv",
            np.column_stack([time, moved, pushed]),
            fmt=["%.4f", "%.7f", "%.4f"],
            delimiter=",",
            header=f"time_s,joint{joint + 1}.position_rad,joint{joint + 1}.torque_N_m",
            comments="",
        )


def generate(folder: Path, seed: int = 16) -> None:
    """Write the record."""
    robot = kobe()
    wanted = commanded(robot.arm)
    held = plant(robot, 6)
    angles, places, _ = CirclePlant(robot, held).run(wanted - wanted[0])
    rng = np.random.default_rng(seed)
    angles, places, wanted = (values[::RECORDED_EVERY] for values in (angles + wanted[0], places, wanted))
    angles = angles + rng.normal(scale=NOISE_ANGLE_RAD, size=angles.shape)
    places = places + rng.normal(scale=NOISE_TOOL_M, size=places.shape)
    time = np.arange(len(places)) * PERIOD_S * RECORDED_EVERY
    names = [
        "time_s",
        *(f"joint{n}.position_rad" for n in range(1, 7)),
        "tool_x_mm",
        "tool_y_mm",
        "tool_z_mm",
    ]
    folder.mkdir(parents=True, exist_ok=True)
    rows = np.column_stack([time, angles, 1e3 * places])
    np.savetxt(
        folder / "circle.csv",
        rows,
        fmt=["%.4f", *["%.7f"] * 6, *["%.4f"] * 3],
        delimiter=",",
        header=",".join(names),
        comments="",
    )


def main() -> None:
    """Write the study's data."""
    parser = argparse.ArgumentParser(prog="python -m tests.generator.kobe_circle", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write")
    folder = parser.parse_args().out
    generate(folder)
    generate_sines(folder)


if __name__ == "__main__":
    main()
