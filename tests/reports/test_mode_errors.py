"""Errors at the measured modes and amplitudes of links, of curves made up in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.reports.shared.measurement_tables import (
    amplitude_tables,
    frf_table,
    magnitude_errors,
    mode_error_table,
)
from identify.results.fit import MeasurementResult, ModePairs
from tests.reports.sample import frf_result


def measurement(factors: dict[str, float]) -> MeasurementResult:
    """One whose model is, at the points of each link, so many times what was measured."""
    one = frf_result().measurements["posture1"]
    assert one.frf is not None
    known = one.modes.frequency_hz[:2], one.modes.damping_ratio[:2], np.arange(2), np.arange(2)
    one = replace(one, pairs=ModePairs(*known, np.ones(2), None, None, "made up"))
    assert one.frf is not None
    of = dict(zip(map(str, one.geometry.nodes), one.geometry.point_links, strict=True))
    factor = np.array([factors.get(of[output.split(":")[0]], 1.0) for output in one.frf.output])
    return replace(one, frf=replace(one.frf, fitted=one.frf.measured * factor))


def test_amplitudes_are_told_by_link() -> None:
    links = list(dict.fromkeys(frf_result().measurements["posture1"].geometry.point_links))
    factors = {link: 0.5 + 0.1 * n for n, link in enumerate(links)}
    [table] = amplitude_tables([measurement(factors)])
    for column in table.columns[1:]:
        assert set(column.cells) == {f"{factors[column.heading]:.2f}"}
    assert len(table.columns) > 2


def test_errors_at_modes_are_those_of_the_magnitude() -> None:
    one = measurement({})
    assert one.frf is not None
    whole = replace(one, frf=replace(one.frf, fitted=0.8 * one.frf.measured))
    assert whole.frf is not None
    np.testing.assert_allclose(magnitude_errors(whole, whole.frf), 0.2, rtol=1e-9)
    hz, damping = one.modes.frequency_hz, one.modes.damping_ratio
    moved = replace(whole, modes=replace(one.modes, frequency_hz=1.05 * hz, damping_ratio=0.9 * damping))
    table = mode_error_table([moved])
    assert table is not None
    assert [float(cell) for cell in table.rows[0][1:]] == pytest.approx([2, 5, 10, 20], rel=1e-3)


def test_what_the_model_does_not_move_has_no_error() -> None:
    links = list(dict.fromkeys(frf_result().measurements["posture1"].geometry.point_links))
    one = measurement({links[0]: 0.0})
    assert one.frf is not None
    [table] = amplitude_tables([one])
    assert links[0] not in [column.heading for column in table.columns]
    errors = magnitude_errors(one, one.frf)
    assert np.isnan(errors).any()
    np.testing.assert_allclose(errors[np.isfinite(errors)], 0.0, atol=1e-12)
    whole = mode_error_table([one])
    assert whole is not None and float(whole.rows[0][-1]) == pytest.approx(0.0, abs=1e-9)
    headings = [column.heading for column in frf_table("posture1", one.frf, errors).columns]
    assert any("Magnitude error" in heading for heading in headings), "of the FRFs that it does move"


def test_without_measured_modes_nothing_is_told() -> None:
    one = replace(measurement({}), pairs=None)
    assert mode_error_table([one]) is None
    assert amplitude_tables([one]) == []
