"""Reference records of the Nagoya two-link study: slow and fast moves, excitation in the closed loop, and
six controllers.

Nothing here comes from identify: the arm is in `nagoya_arm`, its controllers in `nagoya_control`.
`python -m tests.generator.nagoya FOLDER` writes the records as CSV and the truth as JSON, in some minutes.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import chirp

from tests.generator.nagoya_arm import RATIO, STRIBECK_VELOCITY, TRUTH, Arm, Array
from tests.generator.nagoya_control import PERIOD_S, Servo

PARTS = 2
NOISE = {"motor_rad": 2e-6, "link_rad": 5e-6, "torque_N_m": 20.0}


@dataclass(frozen=True)
class Test:
    """One record: from a posture, joints (from 0) turn by an angle at a speed; or one is excited with so many
    N m.

    gain: times that of the velocity loop.
    """

    name: str
    start_deg: tuple[float, float]
    moves: tuple[tuple[int, float, float], ...] = ()
    control: str = "conventional"
    gain: int = 1
    smoothing_s: float = 0.1
    excited: tuple[int, float] | None = None
    duration_s: float = 4.0
    every: int = 24


BOTH, POSTURES = (
    ((0, -40.0, 60.0), (1, 60.0, 80.0)),
    {"upright": (90.0, -90.0), "reaching": (45.0, -20.0), "folded": (110.0, -150.0)},
)
TESTS = (
    Test("slow1", (60.0, -60.0), ((0, 20.0, 6.0),)),
    Test("slow2", (60.0, -30.0), ((1, -20.0, 6.0),)),
    Test("fast1", (100.0, -100.0), ((0, -40.0, 60.0),)),
    Test("fast2", (90.0, -100.0), ((1, 60.0, 80.0),)),
    *(
        Test(f"{name}{joint + 1}", start, excited=(joint, torque), every=8)
        for name, start in POSTURES.items()
        for joint, torque in enumerate((2000.0, 1000.0))
    ),
    *(
        Test(
            f"{control}{gain}",
            (100.0, -100.0),
            BOTH,
            control,
            gain,
            smoothing_s=0.04,
            duration_s=2.5,
            every=8,
        )
        for control in ("conventional", "flexible", "notched", "inertia", "shaped", "feedback")
        for gain in (1, 2)
    ),
)


def command(test: Test) -> Array:
    """Angles (ticks, 2): trapezoids of velocity at 250 deg/s^2, averaged over the smoothing time."""
    fine = np.arange(round(test.duration_s / 1e-4) + 1) * 1e-4
    angles = np.zeros((len(fine), 2))
    for joint, by, speed in test.moves:
        ramp = min(speed / 250.0, np.sqrt(abs(by) / 250.0))
        whole = abs(by) / (250.0 * ramp) + ramp
        since = fine - 0.2
        velocity = np.sign(by) * np.minimum(np.minimum(since, whole - since), ramp).clip(min=0.0) * 250.0
        summed = np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2) * 1e-4])
        area = np.concatenate([[0.0], np.cumsum((summed[1:] + summed[:-1]) / 2) * 1e-4])
        angles[:, joint] = (
            area - np.interp(fine - test.smoothing_s, fine, area, left=0.0)
        ) / test.smoothing_s
    return np.asarray(np.radians(np.array(test.start_deg) + angles)[:: round(PERIOD_S / 1e-4)])


def excitation(test: Test, ticks: int) -> Array:
    """Torque at the gear output that is added to the controller's, (ticks, 2): a chirp from 1 to 60 Hz every
    second.
    """
    torque = np.zeros((ticks, 2))
    if test.excited is not None:
        joint, size = test.excited
        once = size * chirp(np.arange(2000) * PERIOD_S, 1.0, 1.0, 60.0, phi=-90)
        torque[:, joint] = np.resize(once, ticks)
    return torque


def simulate(test: Test) -> tuple[Array, Array, Array]:
    """Drive angle, link angle and torque at the gear output at the ticks, (ticks, 2)."""
    plant, wanted = Arm(), command(test)
    added = excitation(test, len(wanted))
    servo = Servo(plant, test.control, wanted, test.gain)
    state, torque = plant.at_rest(servo.position[0])
    servo.holds(torque, state[0], state[2])
    rows = []
    for tick, extra in enumerate(added):
        rows.append((state[0], state[2], RATIO * torque))
        torque = servo.torque(tick, state[0], state[2]) + extra / RATIO
        for _ in range(PARTS):
            state = plant.advance(state, torque, PERIOD_S / PARTS)
    turn, link, given = np.stack(rows, axis=1)
    return turn, link, given


def main(folder: Path) -> None:
    """Write all records and the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "truth.json").write_text(
        json.dumps({**TRUTH, "stribeck_velocity_rad_s": [STRIBECK_VELOCITY] * 2, "noise": NOISE}, indent=2)
        + "\n"
    )
    names = ["time_s", *(f"joint{n}.{what}" for what in NOISE for n in (1, 2))]
    for number, test in enumerate(TESTS):
        rng = np.random.default_rng([1, number])
        parts = [values[:: test.every] for values in simulate(test)]
        noisy = [
            values + rng.normal(scale=sigma, size=values.shape)
            for values, sigma in zip(parts, NOISE.values(), strict=True)
        ]
        time = np.arange(len(noisy[0])) * PERIOD_S * test.every
        formats = ["%.4f", *["%.7f"] * 4, *["%.1f"] * 2]
        np.savetxt(
            folder / f"{test.name}.csv",
            np.column_stack([time, *noisy]),
            fmt=formats,
            delimiter=",",
            header=",".join(names),
            comments="",
        )
        print(
            test.name,
            np.degrees(np.ptp(noisy[1], axis=0)).round(2),
            np.abs(noisy[2]).max(axis=0).round(0),
            flush=True,
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
