"""Reference records of the Nagoya two-link study: links by Pinocchio, rotors, nonlinear gears and friction by the paper's equations.

Nothing here comes from identify.  The paper's figures carry no numbers (units are normalised), so the arm is ours in the size of axes 2
and 3 of a robot for 165 kg.  `python -m tests.generator.nagoya FOLDER` writes the records as CSV and the truth as JSON.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio
from numpy.typing import NDArray

Array = NDArray[np.float64]

TRUTH = {
    "stiffness_n_m_rad": [3.0e6, 1.2e6],
    "damping_n_m_s_rad": [2500.0, 800.0],
    "cubic_n_m_rad3": [8.0e10, 4.0e10],
    "te_amplitude_rad": [8.0e-5, 6.0e-5],
    "te_phase_rad": [0.6, 1.9],
    "coulomb_n_m": [400.0, 200.0],
    "viscous_n_m_s_rad": [300.0, 150.0],
    "stribeck_n_m": [250.0, 120.0],
}
STRIBECK_VELOCITY, RATIO, ROTOR = 0.05, np.array([160.0, 140.0]), np.array([0.012, 0.008])
POSITION_GAIN, VELOCITY_GAIN, INTEGRAL = 12.0, np.array([12000.0, 4000.0]), 4.0
PERIOD_S, PARTS, EVERY, DURATION_S = 5e-4, 5, 24, 4.0
NOISE = {"motor_rad": 2e-6, "link_rad": 5e-6, "torque_N_m": 20.0}


@dataclass(frozen=True)
class Test:
    """One record: from a posture, a joint (from 0) turns by an angle at a speed."""

    name: str
    start_deg: tuple[float, float]
    joint: int
    by_deg: float
    speed_deg_s: float


TESTS = (
    Test("slow1", (60.0, -60.0), 0, 20.0, 6.0),
    Test("slow2", (60.0, -30.0), 1, -20.0, 6.0),
    Test("fast1", (100.0, -100.0), 0, -40.0, 60.0),
    Test("fast2", (90.0, -100.0), 1, 60.0, 80.0),
)


def arm() -> pinocchio.Model:
    """Two links in a vertical plane; angles from the horizontal, gravity along -y."""
    model, parent, place = pinocchio.Model(), 0, pinocchio.SE3.Identity()
    for mass, middle, moment, length in ((250.0, 0.5, 30.0, 1.1), (420.0, 0.6, 70.0, 1.2)):
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), place, f"q{parent + 1}")
        inertia = pinocchio.Inertia(mass, np.array([middle, 0, 0]), np.diag([1.0, moment, moment]))
        model.appendBodyToJoint(parent, inertia, pinocchio.SE3.Identity())
        place = pinocchio.SE3(np.eye(3), np.array([length, 0.0, 0.0]))
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    return model


def command(test: Test) -> tuple[Array, Array, Array]:
    """Angles, velocities and accelerations (ticks, 2): a trapezoid of velocity at 250 deg/s^2, averaged over 100 ms."""
    fine = np.arange(round(DURATION_S / 1e-4) + 1) * 1e-4
    ramp = min(test.speed_deg_s / 250.0, np.sqrt(abs(test.by_deg) / 250.0))
    whole = abs(test.by_deg) / (250.0 * ramp) + ramp
    since = fine - 0.2
    velocity = np.sign(test.by_deg) * np.minimum(np.minimum(since, whole - since), ramp).clip(min=0.0) * 250.0
    summed = np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2) * 1e-4])
    area = np.concatenate([[0.0], np.cumsum((summed[1:] + summed[:-1]) / 2) * 1e-4])
    angles = np.zeros((len(fine), 2))
    angles[:, test.joint] = (area - np.interp(fine - 0.1, fine, area, left=0.0)) / 0.1
    position = np.radians(np.array(test.start_deg) + angles)[:: round(PERIOD_S / 1e-4)]
    speed = np.gradient(position, PERIOD_S, axis=0)
    return position, speed, np.gradient(speed, PERIOD_S, axis=0)


class Arm:
    """The equations of motion: link torque by Nagoya Eq. 8 of the windup less the transmission error of Eq. 9; friction by Eq. 11."""

    def __init__(self) -> None:
        self.model = arm()
        self.data = self.model.createData()
        self.n = {key: np.array(value) for key, value in TRUTH.items()}

    def error(self, turn: Array) -> tuple[Array, Array]:
        """Transmission error and its slope: one period a turn of the motor."""
        angle = RATIO * turn + self.n["te_phase_rad"]
        return self.n["te_amplitude_rad"] * np.cos(angle), -self.n["te_amplitude_rad"] * RATIO * np.sin(angle)

    def slope(self, y: Array, torque: Array) -> Array:
        """Derivative of (drive angles, drive velocities, link angles, link velocities), (4, 2), under motor torques (2,)."""
        turn, spin, q, v = y
        error, error_slope = self.error(turn)
        e = q - turn - error
        spring, damper = self.n["stiffness_n_m_rad"] * e + self.n["cubic_n_m_rad3"] * e**3, self.n["damping_n_m_s_rad"] * (v - spin)
        dry = self.n["coulomb_n_m"] + self.n["stribeck_n_m"] * np.exp(-np.abs(spin) / STRIBECK_VELOCITY)
        friction = dry * np.tanh(spin / 2e-4) + self.n["viscous_n_m_s_rad"] * spin
        rotor = (RATIO * torque - friction + spring * (1 + error_slope) + damper) / (RATIO**2 * ROTOR)
        return np.array([spin, rotor, v, pinocchio.aba(self.model, self.data, q, v, -spring - damper)])

    def at_rest(self, turn: Array) -> tuple[Array, Array]:
        """State with the drives at `turn`, and motor torques that hold it."""
        q = turn.copy()
        for _ in range(30):
            weight = pinocchio.rnea(self.model, self.data, q, np.zeros(2), np.zeros(2))
            e = -weight / self.n["stiffness_n_m_rad"]
            for _ in range(20):
                off = self.n["stiffness_n_m_rad"] * e + self.n["cubic_n_m_rad3"] * e**3 + weight
                e -= off / (self.n["stiffness_n_m_rad"] + 3 * self.n["cubic_n_m_rad3"] * e**2)
            q = turn + e + self.error(turn)[0]
        return np.array([turn, np.zeros(2), q, np.zeros(2)]), weight * (1 + self.error(turn)[1]) / RATIO


def simulate(test: Test) -> tuple[Array, Array, Array]:
    """Drive angle, link angle and torque at the gear output at the ticks, (ticks, 2), by Runge-Kutta of fourth order."""
    plant, (position, speed, acceleration) = Arm(), command(test)
    rigid = np.array([pinocchio.rnea(plant.model, plant.data, *row) for row in zip(position, speed, acceleration, strict=True)])
    ahead, h = rigid + RATIO**2 * ROTOR * acceleration, PERIOD_S / PARTS
    state, torque = plant.at_rest(position[0])
    integral, before, rows = RATIO * torque - ahead[0], position[0], []
    for wanted, moving, feed in zip(position, speed, ahead, strict=True):
        rows.append((state[0], state[2], RATIO * torque))
        error = POSITION_GAIN * (wanted - state[0]) + moving - (state[0] - before) / PERIOD_S
        before, integral = state[0], integral + VELOCITY_GAIN * INTEGRAL * PERIOD_S * error
        torque = (VELOCITY_GAIN * error + integral - VELOCITY_GAIN * INTEGRAL * PERIOD_S * error + feed) / RATIO
        for _ in range(PARTS):
            k1 = plant.slope(state, torque)
            k2 = plant.slope(state + h / 2 * k1, torque)
            k3 = plant.slope(state + h / 2 * k2, torque)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + plant.slope(state + h * k3, torque))
    turn, link, given = np.stack(rows, axis=1)
    return turn, link, given


def main(folder: Path) -> None:
    """Write all records and the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "truth.json").write_text(json.dumps({**TRUTH, "stribeck_velocity_rad_s": STRIBECK_VELOCITY, "noise": NOISE}, indent=2) + "\n")
    names = ["time_s", *(f"joint{n}.{what}" for what in NOISE for n in (1, 2))]
    for number, test in enumerate(TESTS):
        rng = np.random.default_rng([1, number])
        parts = [values[::EVERY] for values in simulate(test)]
        noisy = [values + rng.normal(scale=sigma, size=values.shape) for values, sigma in zip(parts, NOISE.values(), strict=True)]
        time = np.arange(len(noisy[0])) * PERIOD_S * EVERY
        formats = ["%.4f", *["%.7f"] * 4, *["%.1f"] * 2]
        np.savetxt(
            folder / f"{test.name}.csv", np.column_stack([time, *noisy]), fmt=formats, delimiter=",", header=",".join(names), comments=""
        )
        print(test.name, np.degrees(np.ptp(noisy[1], axis=0)).round(2), np.abs(noisy[2]).max(axis=0).round(0))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
