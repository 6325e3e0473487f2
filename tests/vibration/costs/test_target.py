"""The signs of channels and the frames of points in a prediction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.model.effects.base import parse_effect
from tests.arms import arm, initial
from tests.targets import model, predictor


def test_a_channel_that_points_the_other_way_reads_the_opposite(tmp_path: Path) -> None:
    system, parameters = model(arm(tmp_path), [parse_effect({"kind": "joint-compliance"})])
    there, back = (
        predictor(system, channels=tuple(Channel(3, side * axis) for axis in (1, 2, 3))) for side in (1, -1)
    )
    values = initial(parameters)
    h = there.predict(values)
    assert np.abs(h).max() > 0
    assert back.predict(values) == pytest.approx(-h)
    assert back.out == pytest.approx(-there.out)


def test_responses_and_forces_at_one_point_are_reciprocal(tmp_path: Path) -> None:
    """H_ij = H_ji, and what a force does at its own place takes power: Re of the mobility is positive."""
    system, parameters = model(arm(tmp_path), [parse_effect({"kind": "joint-compliance"})])
    whole = predictor(system, channels=tuple(Channel(3, axis) for axis in (1, 2, 3)))
    target = replace(whole, record=None)
    h = target.predict(initial(parameters))
    assert h == pytest.approx(np.swapaxes(h, 1, 2), rel=1e-6, abs=1e-9 * np.abs(h).max())
    mobility = h / target.data.s[:, None, None]
    own = np.einsum("lii->li", mobility).real
    assert own.min() > -1e-6 * np.abs(mobility).max()
