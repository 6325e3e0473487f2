"""Reference records of the Kawasaki RS010L study: three axes by Pinocchio, direct-current motors, PID
control, Coulomb friction.

Nothing here comes from identify.  The paper's facts (lengths, masses, motor) are written again; gear ratios,
gains, friction and the integral action, which the paper does not give or says are missing, are the truth that
a fit has to find. `python -m tests.generator.kawasaki FOLDER` writes the records as CSV and the truth as
JSON.
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
    "gear_ratio": [63.2, 58.5, 57.1],
    "position_gain_v_rad": [440.0, 820.0, 460.0],
    "derivative_gain_v_s_rad": [9.5, 35.0, 11.0],
    "integral_gain_v_rad_s": [700.0, 1600.0, 900.0],
    "viscous_motor_n_m_s_rad": [0.004, 0.005, 0.003],
    "coulomb_n_m": [55.0, 70.0, 40.0],
    "creep_velocity_rad_s": [2e-4, 2e-4, 2e-4],
}
TORQUE_CONSTANT, BACK_EMF, RESISTANCE, INDUCTANCE, ROTOR = (
    0.97,
    0.0337 * 60 / (2 * np.pi),
    0.22,
    0.0037,
    0.0012,
)
LIMIT_V, COUNTS, PERIOD_S, PARTS, EVERY = 200.0, 131072, 1e-3, 10, 16
NOISE = {"position_rad": 5e-5, "velocity_rad_s": 2e-3, "current_A": 0.15}
SLOW_DEG_S, FAST_DEG_S, DURATION_S = (15.0, 15.0, 15.0), (190.0, 205.0, 210.0), 5.0
POSITION_1, POSITION_2 = (0.0, -90.0, 90.0), (0.0, -60.0, 60.0)


@dataclass(frozen=True)
class Test:
    """One record: a joint (from 0) turns slowly by an angle and quickly back."""

    name: str
    start_deg: tuple[float, float, float]
    joint: int
    by_deg: float


TESTS = (
    Test("pos1_q1", POSITION_1, 0, 45.0),
    Test("pos1_q2", POSITION_1, 1, 40.0),
    Test("pos1_q3", POSITION_1, 2, -45.0),
    Test("pos1_eq", (0.0, -90.0, 22.5), 2, -45.0),
    Test("pos2_q1", POSITION_2, 0, 45.0),
    Test("pos2_q2", POSITION_2, 1, 40.0),
    Test("pos2_q3", POSITION_2, 2, -45.0),
)


def arm() -> pinocchio.Model:
    """Thin rods on three axes; the second and third turn about horizontal axes, down for positive angles."""
    model, turn = (
        pinocchio.Model(),
        pinocchio.SE3(pinocchio.utils.rotate("x", -np.pi / 2), np.array([0.0, 0.0, 0.465])),
    )
    rods = (
        (62.8, [0, 0, 0.2325], [1.0, 1.0, 1.0]),
        (54.7, [0.385, 0, 0], [0.01, 2.5, 2.5]),
        (62.1, [0.5025, 0, 0], [0.01, 3.0, 3.0]),
    )
    parent, places = 0, (pinocchio.SE3.Identity(), turn, pinocchio.SE3(np.eye(3), np.array([0.77, 0.0, 0.0])))
    for number, ((mass, centre, moments), place) in enumerate(zip(rods, places, strict=True)):
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), place, f"q{number + 1}")
        model.appendBodyToJoint(
            parent, pinocchio.Inertia(mass, np.array(centre), np.diag(moments)), pinocchio.SE3.Identity()
        )
    model.armature = np.array(TRUTH["gear_ratio"]) ** 2 * ROTOR
    return model


def command(test: Test) -> Array:
    """Commanded angles (ticks, 3), rad: trapezoids of velocity at 600 deg/s^2, averaged over 80 ms."""
    fine = np.arange(round(DURATION_S * 1e4) + 1) * 1e-4
    velocity = np.zeros_like(fine)
    for begin, angle, speed in (
        (0.2, test.by_deg, SLOW_DEG_S[test.joint]),
        (3.6, -test.by_deg, FAST_DEG_S[test.joint]),
    ):
        distance = abs(angle)
        ramp = min(speed / 600.0, np.sqrt(distance / 600.0))
        whole = distance / (600.0 * ramp) + ramp
        since = fine - begin
        shape = np.minimum(np.minimum(since, whole - since), ramp).clip(min=0.0) * 600.0
        velocity += np.sign(angle) * shape
    summed = np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2) * 1e-4])
    area = np.concatenate([[0.0], np.cumsum((summed[1:] + summed[:-1]) / 2) * 1e-4])
    late = np.interp(fine - 0.08, fine, area, left=0.0)
    angles = np.tile(np.array(test.start_deg), (len(fine), 1))
    angles[:, test.joint] += (area - late) / 0.08
    return np.radians(angles[::PARTS])


def simulate(test: Test) -> tuple[Array, Array, Array]:
    """Angle, velocity and current at the ticks, (ticks, 3), by Runge-Kutta of fourth order, ten steps a
    tick.
    """
    model = arm()
    data, zero, numbers = (
        model.createData(),
        np.zeros(3),
        {key: np.array(value) for key, value in TRUTH.items()},
    )
    ratio, wanted = numbers["gear_ratio"], command(test)

    def slope(y: Array, voltage: Array) -> Array:
        q, v, i = y
        friction = (
            numbers["coulomb_n_m"] * np.tanh(v / numbers["creep_velocity_rad_s"])
            + ratio**2 * numbers["viscous_motor_n_m_s_rad"] * v
        )
        torque = ratio * TORQUE_CONSTANT * i - friction
        return np.array(
            [
                v,
                pinocchio.aba(model, data, q, v, torque),
                (voltage - RESISTANCE * i - BACK_EMF * ratio * v) / INDUCTANCE,
            ]
        )

    weight = pinocchio.rnea(model, data, wanted[0], zero, zero)
    state = np.array([wanted[0], zero, weight / ratio / TORQUE_CONSTANT])
    integral, grain, h = RESISTANCE * state[2], 2 * np.pi / COUNTS / ratio, PERIOD_S / PARTS
    error, rows = np.zeros(3), []
    for target in wanted:
        rows.append(state.copy())
        new = target - np.round(state[0] / grain) * grain
        voltage = (
            numbers["position_gain_v_rad"] * new
            + numbers["derivative_gain_v_s_rad"] * (new - error) / PERIOD_S
            + integral
        )
        integral, error = integral + numbers["integral_gain_v_rad_s"] * PERIOD_S * new, new
        voltage = np.clip(voltage, -LIMIT_V, LIMIT_V)
        for _ in range(PARTS):
            k1 = slope(state, voltage)
            k2 = slope(state + h / 2 * k1, voltage)
            k3 = slope(state + h / 2 * k2, voltage)
            k4 = slope(state + h * k3, voltage)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    angle, velocity, current = np.stack(rows, axis=1)
    return angle, velocity, current


def measured(test: Test, seed: int) -> tuple[Array, list[str]]:
    """What is recorded, every 16 ms with noise: rows of time, three angles, velocities and currents; and the
    names of the columns.
    """
    rng = np.random.default_rng([seed, TESTS.index(test)])
    parts = [values[::EVERY] for values in simulate(test)]
    noisy = [
        values + rng.normal(scale=sigma, size=values.shape)
        for values, sigma in zip(parts, NOISE.values(), strict=True)
    ]
    time = np.arange(len(noisy[0])) * PERIOD_S * EVERY
    return np.column_stack([time, *noisy]), [
        "time_s",
        *(f"joint{n}.{what}" for what in NOISE for n in (1, 2, 3)),
    ]


def main(folder: Path) -> None:
    """Write all records and the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "truth.json").write_text(
        json.dumps({**TRUTH, "noise": NOISE, "rotor_inertia_kg_m2": ROTOR}, indent=2) + "\n"
    )
    formats = ["%.3f", *["%.6f"] * 3, *["%.4f"] * 3, *["%.3f"] * 3]
    for test in TESTS:
        rows, names = measured(test, 1)
        np.savetxt(
            folder / f"{test.name}.csv", rows, fmt=formats, delimiter=",", header=",".join(names), comments=""
        )
        print(
            test.name,
            np.degrees(np.ptp(rows[:, 1:4], axis=0)).round(1),
            np.abs(rows[:, 7:]).max(axis=0).round(1),
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
