"""What is explained is what is left when the known is taken off."""

from __future__ import annotations

import numpy as np
import pytest

from identify.explain.effects.joint_stiffness import SensorLatency
from identify.explain.problem import curved
from identify.explain.regression import solve
from tests.explain.moved import moved, problem

LATE = 0.02


def test_a_late_reading_is_speed_times_latency_and_nothing_of_the_acceleration() -> None:
    """The link side read 20 ms late, on a path whose angle is known at any time: q(t) - q(t - T)."""
    scene = moved()
    w, a = 2 * np.pi * np.array([0.25, 0.4]), np.array([1.9, 1.7])
    deflection = scene.position[:, 0] - np.sin(np.outer(scene.time_s - LATE, w)) @ a
    made = problem(scene, deflection)
    fit = solve(made, (SensorLatency(1),), (np.zeros(0),), np.ones(1))
    assert fit.of(SensorLatency(1))[0] == pytest.approx(LATE, rel=0.01)
    before, after = (
        solve(one, fit.effects, fit.nonlinear, np.ones(1)).residual(one) for one in (made, curved(made, fit))
    )
    assert after.std() < 0.1 * before.std()
