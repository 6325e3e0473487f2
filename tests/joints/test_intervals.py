"""Half intervals against closed forms and against scatter: their width, not only what they hold."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student

from identify.joints.intervals import in_time, independent
from tests.motion.hidden_drive import coloured


def test_a_straight_line_through_few_points() -> None:
    """Textbook: half = t(n - 2) s / sqrt(sum (x - mean)^2) for the slope, and for the offset with rms x."""
    rng, x = np.random.default_rng(0), np.array([0.2, 0.5, 0.9, 1.4, 2.0, 2.7])
    y = 3.0 - 2.0 * x + rng.normal(scale=0.1, size=6)
    slope, offset = np.polyfit(x, y, 1)
    residual = y - offset - slope * x
    s = np.sqrt(residual @ residual / 4)
    about = np.sqrt(np.sum((x - x.mean()) ** 2))
    half = student.ppf(0.975, 4) * s / about * np.array([np.sqrt(np.mean(x**2)), 1.0])
    matrix, found = independent(np.column_stack([np.ones(6), x]), residual)
    assert found == pytest.approx(half, rel=1e-9)
    assert matrix[0, 1] == pytest.approx(-x.mean() * (s / about) ** 2, rel=1e-9)


def test_what_no_row_sees_has_no_interval() -> None:
    rows = np.column_stack([np.ones(8), np.linspace(0, 1, 8), np.zeros(8)])
    _, half = independent(rows, np.random.default_rng(0).normal(size=8))
    assert np.isfinite(half).tolist() == [True, True, False]
    assert np.all(np.isinf(independent(np.eye(3), np.zeros(3))[1])), "no more rows than values"


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_histories_have_intervals_as_wide_as_their_values_scatter(memory: float) -> None:
    time = np.linspace(0, 20, 2000)
    columns = np.column_stack([np.sin(2 * time), np.ones(2000)])
    used, found, half = np.ones((2000, 1), dtype=bool), [], []
    for seed in range(120):
        noise = coloured(np.random.default_rng(seed), (2000, 1), 0.5, memory)[:, 0]
        values = np.linalg.lstsq(columns, noise, rcond=None)[0]
        found.append(values)
        half.append(in_time(columns[:, None, :], (noise - columns @ values)[:, None], used)[1])
    ratio = np.median(half, axis=0) / np.std(found, axis=0)
    assert ratio == pytest.approx([2.05, 2.05], rel=0.25)
