"""What a report shows, and what is worked out for showing only."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from identify.reports.fit.figures import cost_lines
from identify.reports.shared import pick
from identify.reports.shared.parameters import between_bounds, half_interval
from identify.results.fit import FrfComparison, MeasurementResult
from tests.reports.sample import frf_result, modal_result


@pytest.fixture(scope="module")
def measurement() -> MeasurementResult:
    return frf_result().measurements["posture1"]


@pytest.fixture(scope="module")
def frf(measurement: MeasurementResult) -> FrfComparison:
    assert measurement.frf is not None
    return measurement.frf


def test_gap_map_is_the_gap_band_by_band(frf: FrfComparison) -> None:
    found = pick.gap_map(frf)
    assert found.in_noise
    assert found.values.shape == (40, len(frf.output))
    assert frf.noise is not None and frf.gap is not None
    pair, band = 5, 7
    lines = [
        i for i, hz in enumerate(frf.frequency_hz) if found.edges_hz[band] < hz < found.edges_hz[band + 1]
    ]
    squares = [
        abs(frf.fitted[i, pair] - frf.measured[i, pair]) ** 2 / frf.noise[i, pair] ** 2 / 2 for i in lines
    ]
    assert found.values[band, pair] == pytest.approx(np.sqrt(sum(squares) / len(lines)))
    # Bands of three lines each: their mean square is that of the whole.
    assert np.sqrt(np.mean(found.values**2, axis=0)) == pytest.approx(frf.gap)


def test_gap_map_without_noise_is_relative(frf: FrfComparison) -> None:
    found = pick.gap_map(dataclasses.replace(frf, noise=None))
    assert not found.in_noise
    assert found.values[:, 0] == pytest.approx(1.0), "what the model does not move is missed by all of it"


def test_gap_map_of_few_lines(frf: FrfComparison) -> None:
    assert frf.noise is not None
    few = dataclasses.replace(
        frf,
        frequency_hz=frf.frequency_hz[:3],
        fitted=frf.fitted[:3],
        measured=frf.measured[:3],
        noise=frf.noise[:3],
    )
    assert pick.gap_map(few).values.shape == (3, len(frf.output))


def test_rows_are_ordered_by_number_not_by_text(frf: FrfComparison) -> None:
    shuffled = dataclasses.replace(frf, output=("10:+X", "9:+X", "9:-Y"), input=("2:+X", "2:+X", "1:+X"))
    assert pick.map_order(shuffled).tolist() == [2, 1, 0]


def test_worst_first(frf: FrfComparison) -> None:
    assert frf.gap is not None
    order = pick.worst_first(frf)
    assert order[0] == np.argmax(frf.gap)
    assert np.all(np.diff(frf.gap[order]) <= 0)
    without = dataclasses.replace(frf, gap=None)
    assert pick.worst_first(without)[0] == np.argmax(frf.relative_error)


def test_shown_frfs_are_drive_points_and_the_worst(frf: FrfComparison) -> None:
    shown = pick.shown_frfs(frf)
    drive = [
        i
        for i, (o, e) in enumerate(zip(frf.output, frf.input, strict=True))
        if o.replace("+", "") == e.replace("-", "")
    ]
    assert len(drive) == 2
    assert shown[:2] == drive
    assert 3 in shown, "the FRF that was made wrong"
    assert len(shown) == 5 == len(set(shown))


def test_few_modes_are_all_shown_and_many_up_to_the_band(measurement: MeasurementResult) -> None:
    assert pick.shown_modes(measurement) == 4
    assert pick.modes_in_band(measurement) == 3
    many = dataclasses.replace(
        measurement, modes=dataclasses.replace(measurement.modes, frequency_hz=np.arange(1.0, 41) * 10)
    )
    assert pick.shown_modes(many) == 13, "up to 120 Hz, and the next"


def test_between_bounds_on_the_scale_of_the_search() -> None:
    table = frf_result().parameters
    middle = np.where(table.log, np.sqrt(np.abs(table.lower * table.upper)), (table.lower + table.upper) / 2)
    assert between_bounds(table, middle) == pytest.approx(0.5)
    assert between_bounds(table, np.array([table.lower, table.upper])) == pytest.approx(
        np.array([[0] * 5, [1] * 5])
    )


def test_half_interval() -> None:
    half = half_interval(frf_result().parameters)
    assert half[0] == pytest.approx((1.8746e6 - 1.7954e6) / 2 / 1834540.53)
    assert np.isnan(half[3])


def test_cost_lines_count_evaluations_through_the_stages() -> None:
    lines = cost_lines(frf_result().history)
    assert [(start, stage) for start, stage, _, _ in lines] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert lines[1][2][0] == lines[0][2][-1] + 1


def test_pairs() -> None:
    pairs = modal_result().measurements["table"].pairs
    assert pairs is not None
    assert pick.partner(pairs, 1) == 1
    assert pick.partner(pairs, 2) is None
    assert pick.mac_of(pairs, 0) == 0.9876
    assert np.isnan(pick.mac_of(pairs, 2))
