"""The test for posture dependence on estimates that are drawn: false alarms as often as stated, real
differences found.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from identify.batch.population import holm, homogeneity


def _drawn(
    rng: np.random.Generator, count: int, scatter: float = 0.0, slope: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    angles = rng.uniform(-1.0, 1.0, (count, 3))
    std = rng.uniform(0.005, 0.03, count)
    x = 10.0 + slope * angles[:, 1] + scatter * rng.normal(size=count) + std * rng.normal(size=count)
    return x, std, angles


def test_false_alarms_come_as_often_as_stated() -> None:
    rng = np.random.default_rng(1)
    found = [homogeneity(*_drawn(rng, 12)) for _ in range(600)]
    p = np.array([one.p_value for one in found if one is not None])
    assert len(p) == 600
    assert stats.kstest(p, "uniform").pvalue > 0.01
    trends = np.array([one.trend.p_value for one in found if one is not None and one.trend is not None])
    assert np.mean(trends < 0.05) < 0.06, "counted for the choice among three joints"


def test_the_statistic_by_another_route() -> None:
    """Q is the rise of chi-square from a mean of each own to a common one; the mean is that of least
    squares.
    """
    x, std, angles = _drawn(np.random.default_rng(2), 9, scatter=0.02)
    found = homogeneity(x, std, angles)
    assert found is not None
    common = np.linalg.lstsq(1 / std[:, None], x / std)[0]
    assert found.mean == pytest.approx(common[0])
    assert found.chi_square == pytest.approx(np.sum(((x - common) / std) ** 2))
    assert found.p_value == pytest.approx(1 - stats.chi2.cdf(found.chi_square, 8), abs=1e-12)


def test_scatter_and_trend_are_found_and_told_apart() -> None:
    rng = np.random.default_rng(3)
    scattered, risen = (
        homogeneity(*_drawn(rng, 100, scatter=0.05)),
        homogeneity(*_drawn(rng, 100, slope=0.08)),
    )
    assert (
        scattered is not None
        and risen is not None
        and scattered.trend is not None
        and risen.trend is not None
    )
    assert scattered.p_value < 1e-6
    assert scattered.scatter == pytest.approx(0.05, rel=0.2)
    assert scattered.trend.p_value > 0.01, "scatter is no trend"
    assert risen.trend.joint == 2
    assert risen.trend.slope == pytest.approx(0.08, abs=4 * risen.trend.std)
    assert risen.trend.p_value < 1e-9


def test_too_little_to_tell() -> None:
    one = np.ones(1)
    assert homogeneity(one, 0.1 * one, np.zeros((1, 2))) is None
    assert homogeneity(np.ones(3), np.array([0.1, np.nan, 0.0]), np.zeros((3, 2))) is None, (
        "no interval, no test"
    )
    still = homogeneity(np.ones(3), np.full(3, 0.1), np.zeros((3, 2)))
    assert still is not None and still.trend is None, "no angle varies"


def test_holm() -> None:
    assert holm(np.array([0.01, 0.04, 0.03])) == pytest.approx([0.03, 0.06, 0.06])
    assert np.isnan(holm(np.array([np.nan, 0.5]))[0])
    assert holm(np.array([np.nan, 0.5]))[1] == 0.5
