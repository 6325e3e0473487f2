"""Reference runs for the identification of single joints: an arm of three axes whose joints 2 and 3 are
elastic and have friction.

Nothing here comes from identify: links by Pinocchio, gears and friction by Nagoya's Eqs. 8, 9 and 11 written
again, a hysteresis out of Maxwell slip elements, a servo loop, encoders with counts, noise.  `python -m
tests.generator.joint_runs FOLDER` writes the shipped set.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATIO, ROTOR = np.array([180.0, 160.0, 140.0]), np.array([0.012, 0.012, 0.008])
STEP_S, EVERY, DURATION_S = 1e-3, 10, 12.0
COUNTS, LINK_NOISE, TORQUE_NOISE = 2**16, 4e-6, 0.1
"""Counts per turn of the motors' encoders; rad of the link sensor; N m at the motor."""
CREEP = 2e-3


@dataclass(frozen=True)
class Joint:
    """The truth of one joint, at the gear output: Eq. 8, Eq. 9 as (order, amplitude, phase), Eq. 11."""

    stiffness: float = 8e6
    cubic: float = 1.5e12
    damping: float = 6e3
    error: tuple[tuple[float, float, float], ...] = ()
    coulomb: float = 0.0
    viscous: float = 0.0
    stribeck: float = 0.0
    stribeck_velocity: float = 0.05


JOINTS = (
    Joint(coulomb=350.0, viscous=250.0),
    Joint(error=((1.0, 8e-5, 0.6), (2.0, 3e-5, -1.1)), coulomb=420.0, viscous=300.0, stribeck=180.0),
    Joint(stiffness=4e6, cubic=0.0, damping=3e3, coulomb=210.0, viscous=140.0),
)
HYSTERESIS_N_M = 120.0
BODIES = (
    (310.0, (-0.22, 0.12, 0.03), (14.0, 17.0, 19.0)),
    (255.0, (-0.58, 0.02, 0.06), (5.0, 38.0, 39.0)),
    (330.0, (-0.66, -0.04, 0.02), (7.0, 41.0, 42.0)),
)
"""Mass, centre and inertia about it, of each link in its Denavit-Hartenberg frame."""
DH = ((0.6, 0.3, -np.pi / 2), (0.0, 1.1, 0.0), (0.0, 1.2, 0.0))


def arm(bodies: Any = BODIES) -> pinocchio.Model:
    """A column that turns about the vertical and two arms that swing in its plane."""
    model, parent, place = pinocchio.Model(), 0, pinocchio.SE3.Identity()
    for number, ((offset, length, twist), (mass, centre, moments)) in enumerate(
        zip(DH, bodies, strict=True), 1
    ):
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), place, f"q{number}")
        place = pinocchio.SE3(pinocchio.utils.rotate("x", twist), np.array([length, 0.0, offset]))
        model.appendBodyToJoint(parent, pinocchio.Inertia(mass, np.array(centre), np.diag(moments)), place)
    return model


def weight(model: pinocchio.Model, angles: Array) -> Array:
    """Torques (joints,) that hold the arm."""
    return np.asarray(pinocchio.rnea(model, model.createData(), angles, 0 * angles, 0 * angles))


def friction(joint: Joint, v: Array) -> Array:
    """Eq. 11, with a slope where it changes sign."""
    dry = joint.coulomb + joint.stribeck * np.exp(-np.abs(v) / joint.stribeck_velocity)
    return dry * np.tanh(v / CREEP) + joint.viscous * v


def back_and_forth(speed: float, travel: float, start: float) -> Array:
    """Angle (ticks,), rad, from speed and travel in degrees: there, a rest, and back."""
    time = np.arange(round(DURATION_S / STEP_S) + 1) * STEP_S
    ramp = max(speed / 200.0, 0.02)
    whole = travel / speed + ramp
    velocity = np.zeros(len(time))
    for begin, side in ((0.3, 1.0), (0.6 + whole, -1.0)):
        since = time - begin
        velocity += side * speed * np.clip(np.minimum(since, whole - since) / ramp, 0.0, 1.0)
    smooth = np.convolve(velocity, np.ones(100) / 100)[: len(time)]
    return np.radians(start + np.cumsum(smooth) * STEP_S)


SPEEDS = (0.6, 1.0, 1.6, 2.5, 4.0, 6.5, 10.0, 16.0, 25.0, 36.0, 50.0)
"""Of the runs at constant velocity of joint 2, deg/s."""


def single_runs() -> dict[str, tuple[int, Array]]:
    """Joint (from 0) and command (ticks,) of every run of a single joint."""
    time = np.arange(round(DURATION_S / STEP_S) + 1) * STEP_S
    rise = (1 - np.cos(np.pi * np.clip(time / 2.0, 0, 1))) / 2
    runs = {f"speed{n:02d}": (1, back_and_forth(v, 1.6 + 1.1 * v, -70.0)) for n, v in enumerate(SPEEDS, 1)}
    runs["slow"] = (1, back_and_forth(1.2, 6.4, -60.0))
    runs |= {
        f"sine{n}": (2, np.radians(30 + a * np.sin(2 * np.pi * f * time) * rise))
        for n, a, f in ((1, 10.0, 0.4), (2, 12.0, 0.7))
    }
    return runs


@dataclass(frozen=True)
class Plant:
    """Joints that move alone, a lane each (lanes,): inertia, weight as A cos q + B sin q, and the truth of
    the joint.
    """

    inertia: Array
    weight: Array
    ratio: Array
    rotor: Array
    joint: Any

    def error(self, turn: Array) -> tuple[Array, Array]:
        """Transmission error, Eq. 9, and its slope."""
        found, slope = np.zeros_like(turn), np.zeros_like(turn)
        for order, amplitude, phase in self.joint.error:
            angle = order * self.ratio * turn + phase
            found += amplitude * np.cos(angle)
            slope -= amplitude * order * self.ratio * np.sin(angle)
        return found, slope

    def slope(self, y: Array, torque: Array) -> Array:
        """Derivative of (drive, its speed, link, its speed), (4, lanes), under motor torques (lanes,)."""
        turn, spin, q, v = y
        error, error_slope = self.error(turn)
        w, w_rate = turn + error - q, spin * (1 + error_slope) - v
        carried = self.joint.stiffness * w + self.joint.cubic * w**3 + self.joint.damping * w_rate
        drive = (self.ratio * torque - friction(self.joint, spin) - carried * (1 + error_slope)) / (
            self.ratio**2 * self.rotor
        )
        return np.array(
            [
                spin,
                drive,
                v,
                (carried - self.weight[0] * np.cos(q) - self.weight[1] * np.sin(q)) / self.inertia,
            ]
        )


def plant(joint: int, lanes: int) -> Plant:
    """Joint (from 0) with the others at rest at q2 = -60, q3 = 130 degrees: folded, so that the arm swings
    fast beside slow motion.
    """
    model = arm()
    home = np.radians([0.0, -60.0, 130.0])
    pinocchio.crba(model, data := model.createData(), home)
    angles = [np.where(np.arange(3) == joint, angle, home) for angle in (0.0, np.pi / 2)]
    held = np.array([weight(model, a)[joint] for a in angles])
    return Plant(data.M[joint, joint] * np.ones(lanes), held, RATIO[joint], ROTOR[joint], JOINTS[joint])


def moved(plant: Plant, command: Array) -> dict[str, Array]:
    """Motor and link angle and motor torque of lanes along commands (ticks, lanes), every tenth tick."""
    gain, integral_gain, position_gain = 200.0 * plant.ratio**2 * plant.rotor, 25.0, 15.0
    state = np.array([command[0], 0 * command[0], command[0], 0 * command[0]])
    held = plant.weight[0] * np.cos(command[0]) + plant.weight[1] * np.sin(command[0])
    state[2] -= held / plant.joint.stiffness - plant.error(command[0])[0]
    integral, rows, torque = held.copy(), [], held / plant.ratio
    speed, h = np.gradient(command, STEP_S, axis=0), STEP_S
    for tick, (wanted, moving) in enumerate(zip(command, speed, strict=True)):
        off = position_gain * (wanted - state[0]) + moving - state[1]
        integral = integral + gain * integral_gain * h * off
        before, torque = torque, (gain * off + integral) / plant.ratio
        if tick % EVERY == 0:
            rows.append((state[0], state[2], (before + torque) / 2))  # what is given changes at the tick
        k1 = plant.slope(state, torque)
        k2 = plant.slope(state + h / 2 * k1, torque)
        k3 = plant.slope(state + h / 2 * k2, torque)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + plant.slope(state + h * k3, torque))
    return dict(zip(("motor_rad", "link_rad", "torque_N_m"), np.stack(rows, axis=1), strict=True))


def clean_runs(names: Any = None) -> dict[str, tuple[int, dict[str, Array]]]:
    """Joint and noise-free signals (samples,) of the runs of single joints, at 100 Hz; names: only those."""
    runs = {name: run for name, run in single_runs().items() if names is None or name in names}
    found = {}
    for joint in (1, 2):
        lanes = {name: command for name, (moving, command) in runs.items() if moving == joint}
        if lanes:
            signals = moved(plant(joint, len(lanes)), np.stack(list(lanes.values()), axis=1))
            for lane, (name, command) in enumerate(lanes.items()):
                last = 1 + np.flatnonzero(np.diff(command))[-1] // EVERY + 20
                found[name] = joint, {key: values[:last, lane] for key, values in signals.items()}
    return found


def sensed(signals: dict[str, Array], ratio: Array | float, rng: np.random.Generator) -> dict[str, Array]:
    """The same as sensors give it: counts of the motor's encoder, noise on link angle and torque."""
    count = 2 * np.pi / COUNTS / ratio
    kinds = {
        "motor_rad": lambda x: np.round(x / count) * count,
        "link_rad": lambda x: x + rng.normal(scale=LINK_NOISE, size=x.shape),
    }
    kinds["torque_N_m"] = lambda x: x + rng.normal(scale=TORQUE_NOISE, size=x.shape)
    return {key: kinds[key](values) for key, values in signals.items()}


def static_loads(rng: np.random.Generator | None = None) -> dict[str, Array]:
    """Poses of joint 2 (Nagoya Fig. 4): from upright to level in steps of 5 degrees, disks of 15 kg to 150 kg
    on and off, and back.

    Columns (poses,): angles of all joints, mass of the disks, and the torque that the gear of joint 2
    carries.
    """
    lower = [*np.arange(-85.0, 1.0, 5.0)]
    pose = [*lower, *[0.0] * 20, *lower[-2::-1]]
    disks = [
        *[0.0] * len(lower),
        *np.arange(15.0, 151.0, 15.0),
        *np.arange(135.0, -1.0, -15.0),
        *[0.0] * (len(lower) - 1),
    ]
    yields = HYSTERESIS_N_M / 2 * np.array([0.4, 0.3, 0.2, 0.1])
    springs, slips, before, rows = yields / np.array([4e-6, 8e-6, 1.2e-5, 1.6e-5]), np.zeros(4), 0.0, []
    truth = JOINTS[1]
    for angle, mass in zip(pose, disks, strict=True):
        motor, last = np.radians([0.0, angle, 10.0]), BODIES[2]
        model = arm((*BODIES[:2], _loaded(last, mass)))
        low, high = -2e-3, 2e-3
        for _ in range(
            45
        ):  # bisection of the windup: what spring and slips hold less the weight at the link's angle
            w = (low + high) / 2
            held = np.clip(slips + springs * (w - before), -yields, yields).sum()
            carried = weight(model, motor - [0.0, w, 0.0])[1]
            low, high = (low, w) if truth.stiffness * w + truth.cubic * w**3 + held > carried else (w, high)
        slips, before = np.clip(slips + springs * (w - before), -yields, yields), w
        rows.append((*motor, *(motor - [0.0, w, 0.0]), mass, carried))
    table = np.array(rows)
    signals = {"motor_rad": table[:, :3], "link_rad": table[:, 3:6]}
    read = signals if rng is None else sensed(signals, RATIO, rng)
    found = {f"joint{n + 1}.{key}": values[:, n] for key, values in read.items() for n in range(3)}
    return {**found, "disks_kg": table[:, 6], "joint2.torque_N_m": table[:, 7]}


def _loaded(body: Any, disks: float) -> Any:
    """The last link with disks as a point mass at its frame's origin; weight does not know inertia."""
    return body[0] + disks, tuple(body[0] / (body[0] + disks) * np.array(body[1])), body[2]


def excitation(
    seed: int, duration: float = 10.0, rate: float = 100.0, moving: Sequence[int] = range(3)
) -> dict[str, Array]:
    """Motor angle and motor torque (samples, 3) along random Fourier series of five harmonics of the joints
    (from 0) that move: rigid links, rotors, friction.
    """
    rng, model = np.random.default_rng([7, seed]), arm()
    data, time = model.createData(), np.arange(round(duration * rate) + 1) / rate
    base = 2 * np.pi / duration
    q, v, a = np.zeros((3, len(time), 3))
    for joint, (middle, reach) in enumerate(((0.0, 0.9), (-0.9, 0.45), (0.5, 0.6))):
        q[:, joint] += middle
        for harmonic in range(1, 6):
            phase, size, w = (
                rng.uniform(0, 2 * np.pi),
                (joint in moving) * reach * rng.uniform(0.4, 1.0) / harmonic**1.2,
                base * harmonic,
            )
            q[:, joint] += size * np.sin(w * time + phase)
            v[:, joint] += size * w * np.cos(w * time + phase)
            a[:, joint] -= size * w**2 * np.sin(w * time + phase)
    torque = (
        np.array([pinocchio.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
        + RATIO**2 * ROTOR * a
    )
    rub = np.stack([friction(replace(JOINTS[n], stribeck=0.0), v[:, n]) for n in range(3)], axis=1)
    return {"motor_rad": q, "torque_N_m": (torque + rub) / RATIO}


def write(path: Path, columns: dict[str, Array], time: bool = True) -> None:
    """One CSV."""
    table = {"time_s": np.arange(len(next(iter(columns.values())))) / 100.0, **columns} if time else columns
    form = [
        "%.2f"
        if n.endswith("_s")
        else "%.4f"
        if "N_m" in n and time
        else "%.3f"
        if "N_m" in n
        else "%.8f"
        if "rad" in n
        else "%g"
        for n in table
    ]
    np.savetxt(
        path,
        np.column_stack(list(table.values())),
        fmt=form,
        delimiter=",",
        header=",".join(table),
        comments="",
    )


def write_single(folder: Path, runs: dict[str, tuple[int, dict[str, Array]]], seed: int) -> None:
    """The runs of single joints with their noise; the link angle only where it is used."""
    rng = np.random.default_rng([1, seed])
    for name, (joint, signals) in runs.items():
        kept = ("motor_rad", "link_rad") if name == "slow" else ("motor_rad", "torque_N_m")
        read = sensed({key: signals[key] for key in kept}, RATIO[joint], rng)
        write(folder / f"{name}.csv", {f"joint{joint + 1}.{key}": values for key, values in read.items()})


def write_excited(folder: Path, name: str, motion: int, seed: int) -> None:
    """A run of the whole arm with its noise."""
    read = sensed(excitation(motion), RATIO, np.random.default_rng([2, motion, seed]))
    write(
        folder / f"{name}.csv",
        {f"joint{n + 1}.{key}": values[:, n] for key, values in read.items() for n in range(3)},
    )


def main(folder: Path) -> None:
    """Write all runs and the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    write_single(folder, clean_runs(), 1)
    write(folder / "loads.csv", static_loads(np.random.default_rng([3, 1])), time=False)
    write_excited(folder, "excited", 1, 1)
    write_excited(folder, "judge", 2, 1)
    truth = {f"joint{n}": vars(joint) for n, joint in enumerate(JOINTS, 1)}
    bodies = [{"mass_kg": m, "centre_m": c, "inertia_kg_m2": i} for m, c, i in BODIES]
    known = {"rotor_inertia_kg_m2": ROTOR.tolist(), "hysteresis_width_n_m": HYSTERESIS_N_M}
    (folder / "truth.json").write_text(json.dumps({**truth, "links": bodies, **known}, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
