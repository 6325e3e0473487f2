"""Double hits and clipped signals are found in time records, and nothing in clean ones."""

from __future__ import annotations

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.hits import clipped, hit_findings, second_hit
from identify.measured.time_history import TimeHistory
from tests.measured.simulate import SAMPLE_RATE_HZ, half_sine, hammer_test, random_structure, response


def history(spoil: object = None) -> TimeHistory:
    """Four impacts on a structure with noise on all signals, then spoilt."""
    rng = np.random.default_rng(3)
    structure = random_structure(5, 4)
    data = hammer_test(structure, 1, 4, rng)
    data += rng.normal(size=data.shape) * np.array([0.1, 0.01, 0.01, 0.01, 0.01])
    if callable(spoil):
        spoil(structure, data)
    channels = (Channel(2, 3), *(Channel(node, 3) for node in (1, 2, 3, 4)))
    return TimeHistory(SAMPLE_RATE_HZ, data, channels, ("N", *4 * ("m/s^2",)))


def double(structure: object, data: np.ndarray) -> None:
    again = half_sine(0.06, 0.006, 60.0)
    data[2, :, 0] += again
    data[2, :, 1:] += response(structure, again, 1)  # type: ignore[arg-type]


def over_range(structure: object, data: np.ndarray) -> None:
    limit = 0.5 * np.abs(data[:, :, 3]).max()
    data[:, :, 3] = np.clip(data[:, :, 3], -limit, limit)


def test_clean_hits_raise_nothing() -> None:
    assert list(hit_findings(history())) == []


def test_a_double_hit_is_named_with_its_size() -> None:
    [finding] = hit_findings(history(double))
    assert finding.check == "double-hit" and finding.channels == (Channel(2, 3),)
    assert "Hit 3 at 2:+Z" in finding.sentence and "48.8 ms later" in finding.sentence
    assert 0.2 < (finding.value or 0) < 0.5


def test_a_clipped_channel_is_named() -> None:
    [finding] = hit_findings(history(over_range))
    assert finding.check == "clipped" and finding.channels == (Channel(3, 3),)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_the_steps_of_a_converter_are_no_clipping(bits: int) -> None:
    time = np.arange(4000) / 1000
    signal = np.exp(-time) * np.sin(2 * np.pi * 0.8 * time)
    assert not clipped(np.round(signal * 2 ** (bits - 1)) / 2 ** (bits - 1)).any()


def test_a_force_of_nothing_is_no_hit() -> None:
    assert second_hit(np.zeros(10)) == (0.0, 0)
