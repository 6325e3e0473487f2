"""The band that data suggest: from below the first resonance, over as many as asked for, in good lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.measured.band import suggested_band
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet, Quantity
from tests.measured.simulate import Structure

HZ = np.array([10.0, 17.0, 31.0, 44.0, 60.0, 83.0, 130.0, 170.0, 240.0, 350.0])


def wide(quantity: Quantity = "accelerance") -> FrfSet:
    """Ten modes between 10 and 350 Hz, measured from 0.1 to 1000 Hz, with noise of the sensors."""
    rng = np.random.default_rng(2)
    structure = Structure(HZ, np.full(10, 0.02), rng.normal(size=(10, 6)))
    lines = np.arange(0.1, 1000, 0.3)
    s = 2j * np.pi * lines
    frf = structure.receptance(s)[:, :, :2] * s[:, None, None] ** POWER[quantity]
    noise = np.abs(s[:, None, None]) ** (POWER[quantity] - 2) * np.exp(lines / 150)[:, None, None] * 0.02
    coherence = np.abs(frf) ** 2 / (np.abs(frf) ** 2 + noise**2)
    frf = frf + noise * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape)) / 2
    channels = tuple(Channel(node, 1) for node in range(1, 7))
    return FrfSet(lines, frf, channels, channels[:2], quantity, coherence, averages=4)


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_of_a_wide_test_the_first_resonances_are_proposed(quantity: Quantity) -> None:
    low, high = suggested_band(wide(quantity), 6)
    assert low == pytest.approx(HZ[0] / 2, rel=0.1)
    assert HZ[5] < high < HZ[6]


def test_where_there_are_fewer_the_band_ends_with_the_lines_that_are_measured_well() -> None:
    low, high = suggested_band(wide(), 30)
    assert low == pytest.approx(HZ[0] / 2, rel=0.1)
    assert HZ[9] < high < 950


def test_without_coherence_and_resonances_it_is_the_whole_above_0_hz() -> None:
    lines = np.arange(0.0, 5, 0.5)
    flat = replace(wide(), frequency_hz=lines, frf=np.ones((10, 6, 2), complex), coherence=None)
    assert suggested_band(flat, 6) == (0.5, 4.5)
