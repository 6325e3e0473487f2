"""Residuals in the model's coordinates against those of all channels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.parameters import Parameter
from identify.vibration.costs.frf_least_squares import (
    FrfLeastSquares,
    FrfLeastSquaresObjective,
    compressed_frfs,
)
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget
from tests.arms import initial
from tests.targets import targets

FRICTION = [{"kind": "joint-compliance"}, {"kind": "joint-friction", "joints": [2]}]
SAMPLED = [
    {"kind": "joint-compliance"},
    {"kind": "pre-trigger"},
    {"kind": "window-decay", "error": {"initial": 0.3}},
]


def _products(rows: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    every = np.column_stack([rows[1], rows[0]])
    return every.T @ every


def _shortened(whole: Targets) -> FrfLeastSquaresObjective:
    return FrfLeastSquaresObjective(FrfLeastSquares(), whole, shortened=True)


def _louder(target: FrfTarget) -> FrfTarget:
    """Noise of its own for every number, so that no two lines or inputs weigh the same."""
    assert target.noise is not None
    factor = np.random.default_rng(3).uniform(0.5, 2.0, target.noise.shape)
    return replace(target, noise=target.noise * factor)


@pytest.mark.parametrize("effects", [None, FRICTION, SAMPLED])
def test_squares_and_products_are_those_of_all_channels(
    tmp_path: Path, effects: list[dict[str, object]] | None
) -> None:
    """Also of a robot that rubs, whose impacts are simulated, and where H is sampled elsewhere than stated;
    with the noise of one number changed they differ.
    """
    whole, parameters = targets(tmp_path, effects, noise=0.02)
    [target] = (_louder(one) for one in whole.frf)
    values, free = 1.1 * initial(parameters), np.arange(len(parameters))
    every = FrfLeastSquares().objective(Targets((target,)))
    short = _shortened(Targets((target,)))
    rows = short.residuals(values, free)
    assert len(rows[0]) < len(every.residuals(values, free)[0])
    expected = _products(every.residuals(values, free))
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs(_products(rows) - expected).max() <= 1e-9 * size.max()
    assert (np.abs(_products(rows) - expected) / size).max() < 1e-9
    population = np.array([values, initial(parameters)])
    assert short.costs(population) == pytest.approx(every.costs(population), rel=1e-10)
    noise = target.sigma.reshape(target.data.frf.shape).copy()
    noise[5, 2, 1] /= 30
    other = _shortened(Targets((replace(target, noise=noise),)))
    assert (np.abs(_products(other.residuals(values, free)) - expected) / size).max() > 1e-6


def test_what_instruments_change_is_compared_channel_by_channel(tmp_path: Path) -> None:
    """A gain turns no motion of the coordinates into that of a channel: there the residuals stay as they
    are.
    """
    effects = [{"kind": "joint-compliance"}, {"kind": "channel-gain", "channel": "1:+X"}]
    found: tuple[Targets, list[Parameter]] = targets(tmp_path, effects, noise=0.02)
    whole, parameters = found
    assert compressed_frfs(whole.frf[0]) is None
    values, free = 1.1 * initial(parameters), np.arange(len(parameters))
    one, other = FrfLeastSquares().objective(whole), _shortened(whole)
    assert np.array_equal(one.residuals(values, free)[1], other.residuals(values, free)[1])
