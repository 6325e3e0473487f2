"""Kobe's cascade as sampled, at three rates, beside the continuous one that the effect `servo` has: the
stiffness that a rotor feels, from simulated motion in the closed loop.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.core.arrays import Complex
from identify.motion.excitation import Excitation
from tests.motion import arms

Array = NDArray[np.float64]
GAIN, POSITION, INTEGRAL, CURRENT = 2.728e4, 25.0, 20.0, 2 * np.pi * 400.0
"""Of joint 1 in configs/kobe_circle.yaml: N m s/rad, 1/s, 1/s and the bandwidth of its current loop, rad/s.
"""
EXCITED = {"joint": 1, "torque_n_m": 300.0, "band_hz": [2.0, 110.0], "period_s": 1.0}


def stiffness(folder: Path, period_s: float, position_every: int) -> tuple[Array, Complex]:
    """Lines, Hz, and N m/rad: what the controller's torque is over the turn of its motor."""
    servo = {
        "kind": "cascade",
        "period_s": period_s,
        "position_every": position_every,
        "position_gain": POSITION,
        "velocity_gain": GAIN,
        "velocity_integral": INTEGRAL,
    }
    record = {"name": "a", "start_deg": [0.0], "duration_s": 3.0, "excitation": EXCITED}
    motor = {"kind": "torque", "rotor_inertia": 1.077e-3, "bandwidth_hz": CURRENT / 2 / np.pi}
    keys = {"motor": motor, "gear": {"ratio": 120.0}, "servo": servo, "records": [record]}
    problem = arms.study(folder, arms.one_link(0.0), **keys)
    motion = problem.run(problem.initial[None], problem.records)
    ticks = round(1.0 / period_s)
    last = slice(2 * ticks, 3 * ticks)
    times = period_s * np.arange(2 * ticks, 3 * ticks)
    added = Excitation.model_validate(EXCITED).torque(times)
    turn, torque, extra = (
        np.fft.rfft(rows) for rows in (motion.coordinates[0, last, 0], motion.torque[0, last, 0], added)
    )
    f = np.arange(len(turn), dtype=float)
    held = np.exp(-1j * np.pi * f * period_s) * np.sinc(f * period_s)  # commands are held for a tick
    own = torque - extra * held * CURRENT / (2j * np.pi * f + CURRENT)
    band = slice(3, 101)
    return f[band], (-own / np.where(turn == 0, 1, turn))[band]


def continuous(f: Array) -> Complex:
    """z(s) of `identify.model.effects.geared`."""
    s = 2j * np.pi * f
    return np.asarray(GAIN * (s + POSITION) * (s + INTEGRAL) / s * CURRENT / (s + CURRENT))


def test_sampling_is_a_delay_and_nothing_else(tmp_path: Path) -> None:
    """Velocity at 4 kHz, position at 1 kHz: the magnitude within 1 % up to 100 Hz, the phase late by 0.25 ms,
    which is 0.9 degrees at 10 Hz; four times as fast, a quarter of that.
    """
    f, sampled = stiffness(tmp_path / "paper", 2.5e-4, 4)
    ratio = sampled / continuous(f)
    assert np.abs(np.abs(ratio) - 1).max() < 0.01
    late = -np.unwrap(np.angle(ratio)) / (2 * np.pi * f)
    assert late[7:] == pytest.approx(2.5e-4, rel=0.1)
    _, fast = stiffness(tmp_path / "fast", 6.25e-5, 4)
    quarter = np.abs(fast / continuous(f) - 1)[17:] / np.abs(ratio - 1)[17:]
    assert quarter == pytest.approx(0.25, abs=0.03)
