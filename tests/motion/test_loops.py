"""What the sampled loops do, against the continuous laws that they stand for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from identify.motion.controller import Sample, parse_controller
from identify.motion.gear import Gear
from identify.motion.motor import TorqueMotor
from identify.motion.numbers import number_table

ONE = np.ones((1, 1))
RATIO, GAIN, RATE, POSITION = 50.0, 60.0, 4.0, 8.0


def _law(**more: Any) -> Any:
    gains = {"position_gain": POSITION, "velocity_gain": GAIN, "velocity_integral": RATE}
    controller = parse_controller({"kind": "cascade", **gains, **more})
    gear = Gear(ratio=RATIO)  # type: ignore[arg-type]
    table = number_table({"motor": TorqueMotor(), "gear": gear, "servo": controller}, 1)  # type: ignore[arg-type]
    return controller.law(table.arrays(np.zeros((1, 0))))


def _sample(tick: int, error: float, mode_hz: float = 10.0) -> Sample:
    return Sample(tick, error * ONE, 0 * ONE, 0 * ONE, 0 * ONE, 0 * ONE, mode_hz * ONE)


@pytest.mark.parametrize("period", [1e-3, 4e-3])
@pytest.mark.parametrize("every", [1, 5])
def test_velocity_loop_integrates_over_time_not_over_ticks(period: float, every: int) -> None:
    """Half a second of a constant error e behind a still motor: K (K_v e + t / T_i K_v e) at the gear
    output.
    """
    law = _law(period_s=period, velocity_every=every)
    state, command = law.begin(_sample(0, 0.0), 0 * ONE), 0 * ONE
    ticks = round(0.5 / period)
    for tick in range(ticks):
        command, state = law.act(state, _sample(tick, 0.01))
    asked = POSITION * 0.01
    expected = GAIN * asked * (1 + RATE * 0.5) / RATIO
    assert command[0, 0] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("hz", "gain"), [(10.0, 0.1), (1.0, 1.0), (200.0, 1.0)])
def test_a_notch_takes_out_its_frequency_alone(hz: float, gain: float) -> None:
    """A sine through the notch at the 10 Hz of the mode, by its amplitude against that without the notch."""
    size = []
    for width in (0.3, 0.0):
        law = _law(kind="two-degree-of-freedom", notch_width=width, notch_depth=0.1, velocity_integral=0.0)
        state, out = law.begin(_sample(0, 0.0), 0 * ONE), []
        time = np.arange(5000) * 1e-3
        for tick, now in enumerate(time):
            command, state = law.act(state, _sample(tick, 0.01 * np.sin(2 * np.pi * hz * now)))
            out.append(command[0, 0])
        phasor = np.exp(-2j * np.pi * hz * time[1000:])
        size.append(abs(np.mean(np.array(out)[1000:] * phasor)))
    assert size[0] / size[1] == pytest.approx(gain, abs=0.02)
