"""FRFs that do not share their poles are noticed, and those that do are not."""

from __future__ import annotations

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.alone import _apart, disagreement
from identify.modal.analysis import analyse

HZ, DAMPING = np.array([12.0, 27.0, 41.0]), np.array([0.012, 0.015, 0.01])
SHAPES = np.array([[1.0, 0.8, -0.6], [0.7, -0.9, 0.5], [1.2, 0.6, 0.9], [-0.8, 1.1, 0.7]])


def roved(*shifts: float, noise: float = 0.003) -> FrfSet:
    """Accelerances of responses to one force, each of a structure whose frequencies are times a shift."""
    rng, frequency = np.random.default_rng(1), np.arange(1, 121) * 0.5
    s = 2j * np.pi * frequency[:, None]
    columns = []
    for shape, shift in zip(SHAPES, shifts, strict=False):
        w = 2 * np.pi * HZ * shift
        frf = np.sum(shape * SHAPES[0] * s**2 / (s**2 + 2 * DAMPING * w * s + w**2), axis=1)
        scatter = rng.normal(size=(2, len(frequency)))
        columns.append(frf + noise * np.sqrt(np.mean(np.abs(frf) ** 2)) * (scatter[0] + 1j * scatter[1]))
    outputs = tuple(Channel(node, 3) for node in range(1, len(shifts) + 1))
    return FrfSet(frequency, np.stack(columns, axis=1)[:, :, None], outputs, outputs[:1], "accelerance")


def test_a_moved_accelerometer_is_noticed() -> None:
    found = disagreement(analyse(roved(1, 1.012, 0.985, 1.02)))
    assert found is not None and found.modes == 3
    np.testing.assert_allclose(found.low_hz, 0.985 * HZ, rtol=2e-3)
    np.testing.assert_allclose(found.high_hz, 1.02 * HZ, rtol=2e-3)


@pytest.mark.parametrize("noise", [1e-6, 0.003, 0.1])
def test_one_structure_is_not_doubted(noise: float) -> None:
    assert disagreement(analyse(roved(1, 1, 1, 1, noise=noise))) is None


def test_one_response_cannot_disagree() -> None:
    assert disagreement(analyse(roved(1.0))) is None


@pytest.mark.parametrize(
    ("shift", "std", "found"), [(0.05, 0.01, False), (0.3, 0.01, True), (0.3, 0.1, False)]
)
def test_apart_is_beyond_half_a_resonance_and_beyond_what_is_uncertain(
    shift: float, std: float, found: bool
) -> None:
    """A mode at 12 Hz with 1.2 % of damping: its resonance is half 0.14 Hz wide."""
    tables = [
        ModalTable(np.array([12.0 + more]), np.array([0.012]), frequency_std_hz=np.array([std]))
        for more in (0.0, shift, shift / 2)
    ]
    assert (_apart(tables) is not None) == found
