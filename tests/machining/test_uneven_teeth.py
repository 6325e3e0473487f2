"""Teeth at uneven angles: against even ones, the closed form of the mean, and a simulation in time."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from identify.machining.engagement import Engagement
from identify.machining.exact_limit import exact_limit
from identify.machining.lobes import Limits, crossings, inverse_eigenvalues, uneven_crossings
from identify.machining.multi_frequency import multi_frequency
from tests.generator import milling
from tests.machining.test_limits import _altintas, _arm, _cut, _tip

MILL = _altintas()
LINES = MILL.lines_hz(800)
EVEN = _cut(4, 0.0, np.pi / 2)
UNEVEN = (70.0, 110.0, 70.0, 110.0)
SHIFTED = (84.0, 87.0, 93.0, 96.0)


def _with(pitch_deg: tuple[float, ...]) -> Engagement:
    return replace(EVEN, pitches=tuple(np.radians(pitch_deg)))


def _near(cut: Engagement, rpm: float, count: int = 1) -> Limits:
    inverse = inverse_eigenvalues(cut.mean, MILL.receptance(LINES))
    if not cut.pitches:
        return crossings(inverse, LINES, cut.teeth, np.array([rpm]), count)
    return uneven_crossings(inverse, LINES, cut.pitches, np.array([rpm]), count)


def _exact(cut: Engagement, rpm: float) -> float:
    near = _near(cut, rpm)
    found = exact_limit(
        cut, partial(_tip, MILL), 700.0, rpm, (float(near.depth[0, 0]), float(near.chatter_hz[0, 0]))
    )
    assert found is not None
    return found.depth


@pytest.mark.parametrize("rpm", [5000.0, 9000.0])
def test_even_angles_are_even_teeth(rpm: float) -> None:
    """Both by the mean of the cut, and exactly: harmonics of the turn for those of the tooth."""
    same = _with((90.0,) * 4)
    assert _near(same, rpm).depth == pytest.approx(_near(EVEN, rpm).depth, rel=2e-3)
    assert _exact(same, rpm) == pytest.approx(_exact(EVEN, rpm), rel=1e-4)
    assert _exact(_with(UNEVEN), rpm) != pytest.approx(_exact(EVEN, rpm), rel=0.1)


def test_the_mean_of_uneven_teeth_is_the_closed_form() -> None:
    """One direction, a rank of one: the depth is 1 / (alpha Re[(1 - mean e^-iwT) H]) where the bracket is
    real (Altintas, Engin and Budak 1999).
    """
    cut, rpm = replace(_with(UNEVEN), entry=0.0, exit=np.pi), 5000.0
    tip = MILL.receptance(LINES).copy()
    tip[:, 1] = tip[:, :, 1] = 0.0
    inverse = inverse_eigenvalues(np.diag(np.diag(cut.mean)), tip)
    found = uneven_crossings(inverse, LINES, cut.pitches, np.array([rpm]), 1)
    hz = np.linspace(300.0, 1500.0, 240_001)
    late = np.mean(np.exp(-2j * np.pi * np.outer(hz * 60 / rpm, np.array(UNEVEN) / 360)), axis=1)
    loop = cut.mean[0, 0] * (1 - late) * MILL.receptance(hz)[:, 0, 0]
    passed = np.flatnonzero(loop.imag[:-1] * loop.imag[1:] < 0)
    assert found.depth[0, 0] == pytest.approx(1 / loop.real[passed].max(), rel=1e-3)


@pytest.mark.parametrize("pitch_deg", [UNEVEN, SHIFTED, SHIFTED[::-1]])
def test_limits_of_uneven_teeth_are_those_of_a_simulation(pitch_deg: tuple[float, ...]) -> None:
    cut, rpm = _with(pitch_deg), 5000.0
    limit = _exact(cut, rpm)
    sketch = milling.Cut(4, 0.0, np.pi / 2, 6e8, 2e8, 0.0, cut.pitches)
    simulated = milling.limit(_arm(MILL), sketch, rpm, limit * np.linspace(0.96, 1.06, 6), 0.3, 120)
    assert limit == pytest.approx(simulated, rel=0.012)
    assert float(_near(cut, rpm).depth[0, 0]) != pytest.approx(simulated, rel=0.012), "the mean is not enough"


def test_a_search_over_all_frequencies_finds_the_same() -> None:
    cut, rpm = _with(SHIFTED), 9000.0
    found = multi_frequency(cut, partial(_tip, MILL), MILL.lines_hz(100), 700.0, np.array([rpm]))
    assert found.depth[0] == pytest.approx(_exact(cut, rpm), rel=1e-3)
