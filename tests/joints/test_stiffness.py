"""Stiffness from static loads: derivatives against differences, and intervals as wide as the values
scatter.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.joints.base import parse_curve
from identify.joints.stiffness import _predict
from tests.generator import joint_runs
from tests.joints.memory import bench


def test_derivatives_of_the_windup() -> None:
    torque, x = np.linspace(-900, 900, 41), np.array([3e5, 4e10, 40.0, 1e-4])
    rising = np.where(np.arange(41) % 2, 1.0, -1.0)
    _, slopes = _predict(x, torque, rising)
    for number in range(4):
        step = 1e-5 * x * (np.arange(4) == number)
        ends = (_predict(x + side * step, torque, rising)[0] for side in (1, -1))
        expected = np.subtract(*ends) / (2 * step[number])
        assert slopes[:, number] == pytest.approx(expected, rel=1e-4, abs=1e-6 * np.abs(expected).max())


def test_intervals_are_as_wide_as_values_scatter(tmp_path: Path) -> None:
    """Loads up and down on a spring that hardens, 2 x 40 poses, with noise of the angles: the windup by
    the roots of the cubic.
    """
    load = np.concatenate([np.linspace(-900, 900, 40), np.linspace(900, -900, 40)])
    up = np.arange(80) < 40
    roots = [
        np.roots([2e11, 0, 4e5, -(t - (60 if rises else -60))]) for t, rises in zip(load, up, strict=True)
    ]
    windup = np.array([float(r[np.abs(r.imag) < 1e-12][0].real) for r in roots]) + 2e-4
    curve = parse_curve(
        {
            "kind": "stiffness-static",
            "joint": 2,
            "files": ["loads.csv"],
            "torque": {"at": "joint2.torque_N_m", "unit": "N m"},
        }
    )
    found, half = [], []
    for seed in range(60):
        noise = np.random.default_rng(seed).normal(scale=4e-5, size=80)
        columns = {
            "joint2.motor_rad": windup + noise,
            "joint2.link_rad": 0 * windup,
            "joint2.torque_N_m": load,
        }
        joint_runs.write(tmp_path / "loads.csv", columns, time=False)
        values = curve.identify(bench(folder=tmp_path)).values
        found.append(values.value)
        half.append((values.high_95 - values.low_95) / 2)
    truth = {"stiffness": 4e5, "cubic_stiffness": 2e11, "hysteresis_width": 120.0, "zero": 2e-4}
    assert values.name == tuple(truth)
    scatter = np.std(found, axis=0)
    assert np.max(np.abs(np.mean(found, axis=0) - list(truth.values())) / scatter) < 0.6
    assert np.median(half, axis=0) / scatter == pytest.approx(np.full(4, 2.0), rel=0.3)
