"""A direct-current motor against what holds of every one: no-load speed, stall current, time constant,
power.
"""

from __future__ import annotations

import numpy as np
import pytest

from identify.motion.motor import _DcPlant

KM, KE, R, L, U = 0.9, 0.9, 0.5, 4e-3, 48.0


def _motor(limit: float = np.inf) -> _DcPlant:
    one = np.ones((1, 1))
    return _DcPlant(KM * one, KE * one, R * one, L * one, limit * one)


def _later(current: float, voltage: float, speed: float, seconds: float, limit: float = np.inf) -> float:
    one = np.ones((1, 1))
    return float(_motor(limit).advanced(current * one, voltage * one, speed * one, seconds)[0, 0])


def test_at_no_load_speed_no_current_flows_and_beyond_it_brakes() -> None:
    assert _later(0.0, U, U / KE, 1.0) == pytest.approx(0.0, abs=1e-12)
    assert _later(0.0, U, 1.2 * U / KE, 1.0) < 0 < _later(0.0, U, 0.8 * U / KE, 1.0)


def test_stalled_it_draws_the_voltage_over_the_resistance() -> None:
    assert _later(0.0, U, 0.0, 1.0) == pytest.approx(U / R)
    assert _later(0.0, U, 0.0, L / R) == pytest.approx(U / R * (1 - np.exp(-1)))
    assert _later(0.0, U, 0.0, 1.0, limit=U / 2) == pytest.approx(U / R / 2)


def test_electrical_power_becomes_heat_and_mechanical_power() -> None:
    speed = 20.0
    current = _later(0.0, U, speed, 1.0)
    torque = float(_motor().torque(np.full((1, 1), current))[0, 0])
    assert U * current == pytest.approx(R * current**2 + torque * speed)
