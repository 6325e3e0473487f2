"""Commanded moves: limits of velocity and acceleration, and the angle reached."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.motion.command import Move


@settings(max_examples=40, deadline=None)
@given(
    by=st.floats(-180, 180).filter(lambda angle: abs(angle) > 0.1),
    speed=st.floats(5, 300),
    acceleration=st.floats(50, 2000),
    smoothing=st.sampled_from([0.0, 0.02, 0.2]),
)
def test_a_move_ends_where_and_when_it_says_within_its_limits(
    by: float, speed: float, acceleration: float, smoothing: float
) -> None:
    move = Move(
        joint=1,
        start_s=0.25,
        by_deg=by,
        speed_deg_s=speed,
        acceleration_deg_s2=acceleration,
        smoothing_s=smoothing,
    )
    end = 0.25 + move.duration_s
    time = np.linspace(0, end + 0.1, 4001)
    angle = np.degrees(move.angle(time))
    assert angle[time <= 0.25] == pytest.approx(0.0)
    assert angle[time >= end] == pytest.approx(by, rel=1e-6)
    velocity = np.diff(angle) / np.diff(time)
    assert np.abs(velocity).max() <= speed * (1 + 1e-4)
    assert np.abs(np.diff(velocity) / np.diff(time[:-1])).max() <= acceleration * 1.01 + 0.1
    assert (np.sign(by) * np.diff(angle) >= -1e-6).all()  # rounding of integrals
    before = time < end - 1e-2 * move.duration_s
    assert abs(angle[before][-1] - by) > 0  # it takes all of its time
