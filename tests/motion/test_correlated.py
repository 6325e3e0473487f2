"""What correlated residuals are worth, and that intervals hold the truth as often as they say."""

from __future__ import annotations

import numpy as np
import pytest

from identify.core.correlated import (
    correlation_time,
    covariance,
    log_likelihood_gain,
    mean_above_zero,
    white_level,
)
from tests.motion.hidden_drive import coloured

ALL = np.ones(4000, dtype=bool)


@pytest.mark.parametrize("memory", [0.0, 0.8, 0.95])
def test_correlation_time_of_an_autoregression(memory: float) -> None:
    rng = np.random.default_rng(3)
    found = np.mean([correlation_time(coloured(rng, (4000, 1), 1.0, memory)[:, 0], ALL) for _ in range(8)])
    assert found == pytest.approx((1 + memory) / (1 - memory), rel=0.25)


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_intervals_hold_the_truth(memory: float) -> None:
    """A slow sine in coloured noise: the truth lies inside in about 95 of 100 cases; counted as white noise,
    it does not.
    """
    from scipy.stats import t as student

    rng, time = np.random.default_rng(5), np.linspace(0, 10, 1500)
    columns = np.stack([np.sin(2 * time), np.ones(1500)], axis=1)
    used = np.ones((1500, 1), dtype=bool)
    inside, white = 0, 0
    for _ in range(200):
        measured = 0.7 * columns[:, 0] + coloured(rng, (1500, 1), 0.5, memory)[:, 0]
        values = np.linalg.lstsq(columns, measured, rcond=None)[0]
        residual = measured - columns @ values
        matrix, freedom = covariance(columns[:, None, :], residual[:, None], used)
        inside += abs(values[0] - 0.7) < student.ppf(0.975, freedom) * np.sqrt(matrix[0, 0])
        white += abs(values[0] - 0.7) < 1.96 * residual.std() / np.sqrt((columns[:, 0] ** 2).sum())
    assert 178 <= inside <= 200
    assert (white < 150) == (memory > 0)


def test_a_gain_counts_where_it_is_in_frequency() -> None:
    """The same share of squares taken from a few slow samples is less evidence than from many fast ones."""
    rng = np.random.default_rng(1)
    slow, fast = (coloured(rng, (4000, 1), 1.0, memory)[:, 0] for memory in (0.999, 0.0))
    much, little = (log_likelihood_gain(residual, 0.8 * residual, ALL)[0] for residual in (fast, slow))
    assert much == pytest.approx(4000 * np.log(1 / 0.8), rel=0.02)
    assert log_likelihood_gain(fast + slow, fast + 0.8 * slow, ALL)[0] < 0.05 * much < little
    assert log_likelihood_gain(fast, fast, ALL)[0] < 0
    assert log_likelihood_gain(fast, fast + 0.05 * slow, ALL)[0] < 3


def test_a_constant_is_evidence_and_ends_that_do_not_count_are_not_there() -> None:
    """Six standard deviations of the mean of coloured noise; a margin with anything in it, left out."""
    noise = coloured(np.random.default_rng(5), (3000, 1), 0.05, 0.9)[:, 0]
    used = (np.arange(3000) >= 500) & (np.arange(3000) < 2500)
    odd = np.where(used, 0.0, 7.0)
    for residual, mask in ((noise, ALL[:3000]), (noise + odd, used)):
        assert log_likelihood_gain(residual + 0.03, residual, mask)[0] > 1
        assert log_likelihood_gain(residual, residual - 0.03, mask)[0] < 0
        assert not log_likelihood_gain(residual + 0.03, residual, mask)[1][~mask].any()


def test_a_gain_in_one_place_may_be_luck() -> None:
    values = np.zeros(1000)
    values[:50] = 1.0
    assert mean_above_zero(values) > 0.05
    assert mean_above_zero(np.ones(1000)) < 0.001
    assert mean_above_zero(-np.ones(1000)) > 0.99


def test_noise_level_ignores_what_is_slow() -> None:
    rng, time = np.random.default_rng(2), np.linspace(0, 10, 4000)
    assert white_level(5 * np.sin(time) + rng.normal(scale=0.02, size=4000), ALL) == pytest.approx(
        0.02, rel=0.1
    )
