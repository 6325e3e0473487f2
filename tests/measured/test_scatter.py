"""Noise by the scatter between neighbouring lines is that which coherence tells, and which was put in."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.measured.noise import noise_std, pooled_variance
from identify.measured.scatter import FREEDOM, scatter
from identify.measured.silent import dead, noise_alone, without
from tests.measured.simulate import random_structure

ROOT = Path(__file__).parents[2]
CHANNELS = tuple(Channel(node, axis) for node in (1, 2, 3) for axis in (1, 2, 3))


def structure(seed: int, noise: float, lines: int = 100) -> FrfSet:
    """Nine outputs and three forces, with white noise of a part of each FRF's RMS."""
    frequency = np.linspace(5.0, 80.0, lines)
    frf = random_structure(seed, 9).receptance(2j * np.pi * frequency)[:, :, 6:]
    rng = np.random.default_rng(seed)
    level = noise * np.sqrt(np.mean(np.abs(frf) ** 2, axis=0) / 2)
    frf = frf + level * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    return FrfSet(frequency, frf, CHANNELS, CHANNELS[6:], "receptance")


@pytest.mark.parametrize("noise", [0.003, 0.03, 0.3])
def test_the_noise_that_was_put_in_is_found(noise: float) -> None:
    ratios = []
    for seed in range(3):
        data = structure(seed, noise)
        variance = scatter(data)
        assert variance is not None
        ratios.append(np.median(variance, axis=0) / np.mean(np.abs(data.frf) ** 2, axis=0) / noise**2)
    assert 0.7 < np.median(ratios) < 1.3


def test_noise_in_an_exponential_window_is_that_which_coherence_tells() -> None:
    options = FrfFileOptions(averages=4, window_decay_per_s=1.226)
    path = ROOT / "data" / "arm_hammer_test" / "posture1.uff"
    data = load_frf_set(path, options).band(3, 80)
    variance = scatter(data)
    assert variance is not None
    found = np.sqrt(pooled_variance(np.abs(data.frf) ** 2, variance, FREEDOM) / 2)
    ratio = found / noise_std(data)
    assert 0.9 < np.median(ratio) < 1.1
    assert np.all(np.abs(np.log(np.percentile(ratio, [5, 95]))) < np.log(1.5))


def test_too_few_or_uneven_lines_tell_nothing() -> None:
    data = structure(1, 0.01)
    assert scatter(data.lines(data.frequency_hz < 12)) is None
    assert scatter(replace(data, frequency_hz=np.geomspace(5.0, 80.0, 100))) is None


def test_channels_of_noise_alone_and_dead_ones_are_told_from_quiet_ones() -> None:
    data, rng = structure(2, 0.01), np.random.default_rng(1)
    frf, level = data.frf.copy(), np.sqrt(np.mean(np.abs(data.frf) ** 2))
    noise = level * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    frf[:, 2] = 1e-3 * noise[:, 2]
    frf[:, 4] = 1e-3 * data.frf[:, 4] + 5e-4 * np.abs(data.frf[:, 4]).mean() * noise[:, 4] / level
    frf[:, 5] = 0.7
    frf[:, :, 1] = np.where(np.arange(9)[:, None].T == 5, 0.7, noise[:, :, 1])
    data = replace(data, frf=frf)
    assert dead(data) == ((CHANNELS[5],), ())
    assert noise_alone(without(data, *dead(data), "is dead")) == ((CHANNELS[2],), (CHANNELS[7],))
