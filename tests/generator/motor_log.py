"""Logs of controllers that hold arms and excite one drive at a time: torque, encoder and what was added to
the torque, at the controller's samples.  Shares no code with what is fitted.

A tested joint has a rotor of its own, a coordinate in series with the gear's spring; it turns under a sampled
cascade of position and velocity loops, one sample late.  The brakes of the others are on: their motors stand
still.  The arm moves as MuJoCo's forward dynamics say, linearised at the posture by differences; between
samples exactly, as the torque is held.  Encoders count, and an unknown torque acts at the motor beside the
commanded one (ripple of current and friction), so that the loop feeds its own noise back.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import scipy

from tests.generator.arm import Arm
from tests.generator.makes import MAKES
from tests.generator.rigid import Array
from tests.generator.servo import Loop, ServoPlant
from tests.generator.tree import Dof, at_posture

TESTED = (1, 2, 3)
_STEPS = (1e-6, 1e-5, 1e-2)
_HEADER = "time_s,torque,angle,added"


@dataclass(frozen=True)
class Drives:
    """Of the tested joints, at the gear output: rotor inertia n^2 J, kg m^2, and friction, N m s/rad; gear
    ratios n.
    """

    rotor: Array
    friction: Array
    ratio: Array


@dataclass(frozen=True)
class Logging:
    """Samples a second and seconds; Hz up to which the excitation has power; how far it moves the arm,
    rad RMS or so; unknown torque, as a share of the excitation; counts of the encoder per turn of the motor.
    """

    rate_hz: float = 1000.0
    seconds: float = 40.0
    band_hz: float = 120.0
    swing: float = 2e-3
    unknown: float = 0.02
    counts: float = 2.0**17


@dataclass(frozen=True)
class MotorTest:
    """An arm with its drives, the postures (postures, joints), degrees, and how it is logged."""

    arm: Arm
    drives: Drives
    postures: Array
    logging: Logging
    seed: int


def drawn(seed: int) -> MotorTest:
    """An arm, drives and logging at random."""
    rng = np.random.default_rng([seed, 0x307])
    arm = MAKES["random"](seed)
    postures = np.round(arm.home + rng.uniform(-1, 1, (2, 6)) * [20.0, 12.0, 20.0, 25.0, 20.0, 35.0], 1)
    outboard = [
        at_posture(arm, postures[0]).outboard_about(arm.links[n].name, arm.joints[n - 1].axis) for n in TESTED
    ]
    rotor = np.array(outboard) * rng.uniform(0.3, 2.0, len(TESTED))
    friction = (rotor + outboard) * rng.uniform(1.0, 10.0, len(TESTED))
    drives = Drives(rotor, friction, np.round(rng.uniform(60, 200, len(TESTED))))
    logging = Logging(
        rate_hz=float(rng.choice([500.0, 1000.0])),
        unknown=float(np.exp(rng.uniform(np.log(0.003), np.log(0.05)))),
        counts=float(2 ** rng.integers(13, 20)),
    )
    return MotorTest(arm, drives, postures, logging, seed)


def log(test: MotorTest, joint: int, posture: int) -> Array:
    """(samples, 4): time, torque (N m at the motor), angle (rad at the gear output) and what was added to the
    torque (N m at the motor) while a joint is excited at one of the postures.
    """
    logging, number = test.logging, TESTED.index(joint)
    a, b, c, total = _driven(test, joint, posture)
    step = 1 / logging.rate_hz
    matrix = np.zeros((len(a) + 1,) * 2)
    matrix[:-1, :-1], matrix[:-1, -1] = a, b
    whole = scipy.linalg.expm(matrix * step)
    rng = np.random.default_rng([test.seed, joint, posture, 0x10C])
    samples = int(logging.seconds * logging.rate_hz)
    corner = min(0.8, 2 * logging.band_hz * step)
    added = scipy.signal.lfilter(*scipy.signal.butter(2, corner), rng.normal(size=samples))
    added *= total * (2 * np.pi * 8.0) ** 2 * logging.swing / added.std()
    unknown = rng.normal(scale=logging.unknown * float(added.std()), size=samples)
    grain = 2 * np.pi / logging.counts / test.drives.ratio[number]
    gains = 2 * np.pi * np.array([3.0, 0.5, 0.15]) * [total, 1.0, 1.0]
    table = _closed(whole[:-1, :-1], whole[:-1, -1], c, (added, unknown), (gains, grain, step))
    return np.column_stack(
        [
            np.arange(samples) * step,
            table * [1 / test.drives.ratio[number], 1.0],
            added / test.drives.ratio[number],
        ]
    )


def _closed(
    forward: Array,
    drawn_in: Array,
    seen: Array,
    torques: tuple[Array, Array],
    loop: tuple[Array, float, float],
) -> Array:
    """(samples, 2): commanded torque at the gear output and counted angle under the cascade."""
    (velocity, position, integral), grain, step = loop
    state, before, held, late = np.zeros(len(forward)), 0.0, 0.0, 0.0
    table = np.empty((len(torques[0]), 2))
    for row, (added, unknown) in enumerate(zip(*torques, strict=True)):
        angle = np.round(seen @ state / grain + 0.3) * grain
        command = late + added
        table[row] = command, angle
        error = -position * angle - (angle - before) / step
        held += integral * error * step
        late, before = velocity * (error + held), angle
        state = forward @ state + drawn_in * (command + unknown)
    return table


def _driven(test: MotorTest, joint: int, posture: int) -> tuple[Array, Array, Array, float]:
    """x' = a x + b u and angle = c x of the motor of a joint under its torque u at the gear output, and the
    inertia that the torque turns.
    """
    number, tree = TESTED.index(joint), at_posture(test.arm, test.postures[posture])
    part, name = tree.parts[joint], f"joint{joint}.motor"
    rotor, friction = float(test.drives.rotor[number]), float(test.drives.friction[number])
    part.dofs = [Dof(name, False, part.dofs[0].axis, 0.0, friction, rotor), *part.dofs]
    total = rotor + tree.outboard_about(part.name, part.dofs[0].axis)
    plant = ServoPlant(tree, [Loop(name, 1.0, 1.0, 1.0, 100.0)])
    size, own = plant.model.nv, plant.coordinates.index(name)
    columns = [
        (_accelerations(plant, own, index, step) - _accelerations(plant, own, index, -step)) / (2 * step)
        for index in range(2 * size + 1)
        for step in [_STEPS[0] if index < size else _STEPS[1] if index < 2 * size else _STEPS[2]]
    ]
    lower = np.array(columns).T
    a = np.vstack([np.hstack([np.zeros((size, size)), np.eye(size)]), lower[:, : 2 * size]])
    b = np.concatenate([np.zeros(size), lower[:, 2 * size]])
    return a, b, np.eye(2 * size)[own], total


def _accelerations(plant: ServoPlant, own: int, index: int, value: float) -> Array:
    data, size = plant.data, plant.model.nv
    plant.rest()
    plant.begin(np.zeros(1))
    if index < size:
        data.qpos[index] = value
    elif index < 2 * size:
        data.qvel[index - size] = value
    mujoco.mj_fwdPosition(plant.model, data)
    plant.load(plant.sensors[0], None)
    if index == 2 * size:
        data.qfrc_applied[own] += value
    mujoco.mj_forward(plant.model, data)
    return np.array(data.qacc)


def study(folder: Path, test: MotorTest, extra: str = "") -> Path:
    """The logs and the study that fits them, with first guesses of the drives far off."""
    rng = np.random.default_rng([test.seed, 0x5D])
    (folder / "robot.urdf").write_text(test.arm.urdf())
    entries = []
    for posture, angles in enumerate(test.postures):
        for joint in TESTED:
            name = f"posture{posture + 1}_joint{joint}.csv"
            np.savetxt(
                folder / name,
                log(test, joint, posture),
                delimiter=",",
                header=_HEADER,
                comments="",
                fmt="%.12g",
            )
            signals = (
                f"{{time_s: time_s, 'joint{joint}:motor [N m]': torque, 'joint{joint}:motor [rad]': angle,"
                f" 'joint{joint}:reference [N m]': added}}"
            )
            entries.append(
                f"  - {{file: {name}, posture_deg: {angles.tolist()}, motor_side: [torque],\n"
                f"     estimate: {{excitation: broadband, held: true, signals: {signals}}}}}"
            )
    guess = [float(f"{k:.3g}") for k in test.arm.stiffness * np.exp(rng.uniform(-0.7, 0.7, 6))]
    inertia = [
        float(f"{j:.3g}")
        for j in test.drives.rotor / test.drives.ratio**2 * np.exp(rng.uniform(-0.7, 0.7, 3))
    ]
    lines = [
        "schema: identify/1\nname: motors\nrobot: {urdf: robot.urdf}\nmeasurements:",
        *entries,
        "band_hz: [2, 80]\neffects:",
        f"  - {{kind: joint-compliance, axes: [rz], stiffness: {{initial: {guess}}}}}",
        f"  - {{kind: rotor-inertia, joints: {list(TESTED)}, gear_ratio: {test.drives.ratio.tolist()},",
        f"     inertia: {{initial: {inertia}}}, friction: {{}}}}",
        *filter(None, [extra]),
    ]
    path = folder / "study.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def truth(test: MotorTest) -> dict[str, float]:
    """Of the tested joints, by what a fit calls it."""
    arm, drives = test.arm, test.drives
    found = {}
    for number, joint in enumerate(TESTED):
        found[f"joint{joint}.rz.stiffness"] = float(arm.stiffness[joint - 1])
        found[f"joint{joint}.rz.damping"] = float(arm.damping[joint - 1])
        found[f"joint{joint}.rotor.inertia"] = float(drives.rotor[number] / drives.ratio[number] ** 2)
        found[f"joint{joint}.rotor.friction"] = float(drives.friction[number])
    return found
