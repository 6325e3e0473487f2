"""The nonlinear spring of a gear conserves energy: its torques are the slopes of one potential."""

from __future__ import annotations

import numpy as np
import pytest

from identify.motion.gear import GearSpring

K, A3, PLAY, ORDER, SIZE, PHASE, RATIO = 2e5, 3e10, 4e-4, 2, 2e-4, 0.3, 80.0


def _spring(play: float = PLAY) -> GearSpring:
    one = np.ones((1, 1))
    return GearSpring(RATIO * one, K * one, A3 * one, play * one, ((ORDER, SIZE * one, PHASE * one),))


def _energy(turn: float, delta: float) -> float:
    """k e^2 / 2 + A_3 e^4 / 4 of what the windup is beyond half the play."""
    windup = delta - SIZE * np.cos(ORDER * RATIO * turn + PHASE)
    e = max(abs(windup) - PLAY / 2, 0.0)
    return K * e**2 / 2 + A3 * e**4 / 4


@pytest.mark.parametrize("turn", [0.013, 0.4, -1.1])
@pytest.mark.parametrize("delta", [-1.5e-3, 1.0e-3, 2.2e-3])
def test_torques_are_the_slopes_of_the_energy(turn: float, delta: float) -> None:
    on_drive, on_windup = _spring().beyond_linear(np.full((1, 1), turn), np.full((1, 1), delta))
    step = 1e-7
    of_turn = (_energy(turn + step, delta) - _energy(turn - step, delta)) / (2 * step)
    of_delta = (_energy(turn, delta + step) - _energy(turn, delta - step)) / (2 * step)
    assert on_drive[0, 0] == pytest.approx(-of_turn, rel=1e-4)
    assert on_windup[0, 0] == pytest.approx(K * delta - of_delta, rel=1e-4, abs=1e-3)


def test_free_play_is_as_wide_as_stated_from_stop_to_stop() -> None:
    fine = np.linspace(-PLAY, PLAY, 2001)[None]
    free = fine[np.abs(_spring().torque(fine)) < 1e-9]
    assert np.ptp(free) == pytest.approx(PLAY, rel=2e-3)


@pytest.mark.parametrize("torque", [-700.0, -3.0, 250.0])
def test_windup_is_the_inverse_of_torque(torque: float) -> None:
    found = _spring().windup(np.full((1, 1), torque))
    assert _spring().torque(found)[0, 0] == pytest.approx(torque, rel=1e-9)
