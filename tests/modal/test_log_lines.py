"""Modes of FRFs whose lines are evenly spaced on a logarithmic axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.modal.analysis import analyse
from identify.modal.lines import place, spacing
from identify.modal.mac import mac
from identify.modal.poles import Band, moments
from identify.modal.settings import ModalSettings
from tests.modal.systems import chain, measure

HZ, DAMPING = [14.0, 23.0, 24.5, 41.0, 66.0, 97.0, 150.0], [0.02, 0.015, 0.012, 0.01, 0.02, 0.01, 0.015]
LINES = np.geomspace(8.0, 190.0, 700)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_all_modes_are_found_with_their_intervals(noise: float) -> None:
    system = chain(HZ, DAMPING, seed=4)
    found = analyse(measure(system, LINES, [0, 3], noise=noise, seed=2))
    table = found.table
    assert len(table) == len(HZ)
    assert table.frequency_hz == pytest.approx(HZ, rel=2e-3)
    assert table.damping_ratio == pytest.approx(DAMPING, rel=0.1)
    assert table.shapes is not None and table.frequency_std_hz is not None
    assert np.diag(mac(table.shapes, system.shapes)) == pytest.approx(1, abs=5e-3)
    if noise:
        off = (table.frequency_hz - HZ) / table.frequency_std_hz
        assert np.sqrt(np.mean(off**2)) < 2


def test_intervals_are_as_wide_as_modes_scatter() -> None:
    system = chain(HZ, DAMPING, seed=4)
    tables = [analyse(measure(system, LINES, [0, 3], noise=0.01, seed=s)).table for s in range(5)]
    assert {len(table) for table in tables} == {len(HZ)}
    scatter = np.std([table.frequency_hz for table in tables], axis=0, ddof=1)
    stated = np.mean([table.frequency_std_hz for table in tables], axis=0)
    assert 0.6 < np.median(stated / scatter) < 2.2


def test_lines_that_follow_no_axis_and_lsce_are_refused() -> None:
    system = chain(HZ, DAMPING, seed=4)
    data = measure(system, LINES, [0, 3])
    with pytest.raises(InputError, match="evenly spaced lines for LSCE"):
        analyse(data, ModalSettings(estimator="lsce"))
    mixed = np.unique(np.concatenate([np.geomspace(8, 60, 200), np.linspace(60.2, 190, 150) ** 1.02]))
    with pytest.raises(InputError, match="a constant ratio of neighbours"):
        analyse(measure(system, mixed, [0, 3]))
    holes = np.ones(len(LINES), dtype=bool)
    holes[300:330] = False
    with pytest.raises(InputError, match="constant"):
        analyse(replace(data, frequency_hz=LINES[holes], frf=data.frf[holes]))


def test_moments_of_lines_that_are_nearly_even_are_those_of_even_ones() -> None:
    even = np.linspace(10.0, 100.0, 4000)
    values = (np.exp(0.3j * even) / (1 + (even - 50) ** 2))[:, None]
    same = moments(values, 5)
    band = Band.of(even)
    assert band.places(even) is None
    stretched = np.geomspace(10.0, 100.0, 4000)
    places = Band.of(stretched).places(stretched)
    assert places is not None
    dense = (np.exp(0.3j * stretched) / (1 + (stretched - 50) ** 2))[:, None]
    assert moments(dense, 5, places) == pytest.approx(same, abs=0.01 * np.abs(same).max())


def test_places_and_spacings() -> None:
    lines = np.array([1.0, 2.0, 4.0, 8.0])
    assert place(lines, np.array([1.0, 3.0, 8.0, 12.0, 0.0])).tolist() == [0.0, 1.5, 3.0, 4.0, -1.0]
    assert spacing(lines, np.array([1.0, 3.0, 9.0])).tolist() == [1.0, 2.0, 4.0]
