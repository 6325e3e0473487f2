"""Forces that act at once: the model predicts their joint response, with exact derivatives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.targets import targets

PHASORS = (1.0 + 0j, -1j, 0j)


def test_the_joint_response_stands_in_the_first_column(tmp_path: Path) -> None:
    each, parameters = targets(tmp_path)
    apart = each.frf[0]
    at_once = replace(apart, data=replace(apart.data, simultaneous_inputs=PHASORS))
    values = np.array([parameter.initial for parameter in parameters]) * np.linspace(
        0.8, 1.2, len(parameters)
    )
    h, mixed = apart.predict(values), at_once.predict(values)
    _same(mixed[..., 0], h[..., 0] - 1j * h[..., 1])
    _same(mixed[..., 1:], h[..., 1:])
    assert np.abs(mixed[..., 0] - h[..., 0]).max() > 0.1 * np.abs(h).max()
    free = np.arange(len(parameters))
    slopes, together = apart.gradient(values, free)[1], at_once.gradient(values, free)
    _same(together[0], mixed)
    _same(together[1][:, :, 0], slopes[:, :, 0] - 1j * slopes[:, :, 1])


def _same(found: np.ndarray, expected: np.ndarray) -> None:
    """To rounding; as arrays, because number by number takes minutes."""
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
