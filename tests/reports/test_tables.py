"""The tables say what the result says."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from identify.reports.fit import tables
from identify.reports.kit.cells import NONE, Table
from identify.reports.kit.report import provenance_table
from identify.reports.shared import measurement_tables
from identify.reports.shared.parameters import parameter_table
from identify.results.fit import FitResult
from tests.reports.sample import frf_result, modal_result


def _all(result: FitResult) -> list[Table]:
    run = (
        tables.start_table,
        tables.direction_table,
        provenance_table,
        tables.published_table,
        tables.published_modes_table,
        tables.profile_table,
        measurement_tables.measurement_table,
        measurement_tables.error_table,
    )
    measurements = list(result.measurements.values())
    made = [parameter_table(result.parameters), *(make(result) for make in run)]
    made += [measurement_tables.mode_table(m) for m in measurements]
    made += [measurement_tables.frf_table(m.name, m.frf) for m in measurements if m.frf]
    return [table for table in made if table is not None]


@pytest.mark.parametrize("result", [frf_result(), modal_result()], ids=["frf", "modal"])
def test_every_row_fits_its_columns(result: FitResult) -> None:
    for table in _all(result):
        assert all(len(row) == len(table.columns) for row in table.rows), table.title
        assert "nan" not in str(table.rows), table.title


def test_parameters() -> None:
    rows = parameter_table(frf_result().parameters).rows
    assert rows[0] == (
        "joint1.rz.stiffness",
        "1.835e6",
        "N·m/rad",
        "1.795e6",
        "1.875e6",
        "2.2",
        "1.000e6",
        "1.000e4",
        "1.000e8",
        "determined",
    )
    assert rows[2][-1] == "weak"
    p = frf_result().parameters
    at_bound = dataclasses.replace(p, status=(*p.status[:2], "at its upper bound", *p.status[3:]))
    assert parameter_table(at_bound).rows[2][-1] == "at its upper bound"
    assert rows[3][3:6] == (NONE, NONE, NONE)
    assert rows[3][-1] == "fixed"


def test_modes_without_measured_ones() -> None:
    table = measurement_tables.mode_table(frf_result().measurements["posture1"])
    assert table.rows[1] == ("2", "27.39", "3.200")
    assert [column.unit for column in table.columns] == ["", "Hz", "%"]


def test_modes_beside_measured_ones_in_order_of_frequency() -> None:
    rows = measurement_tables.mode_table(modal_result().measurements["table"]).rows
    assert rows[0] == ("1", "12.05", "12.10", "-0.413", "4.100", "4.350", "-0.250", "0.9876")
    assert rows[1][5:7] == (NONE, NONE), "its damping was not measured"
    assert rows[2] == ("no pair", NONE, "44.40", NONE, NONE, "2.000", NONE, NONE)
    assert rows[3][:3] == ("3", "61.50", NONE)


def test_frf_errors_worst_first_with_remarks() -> None:
    m = frf_result().measurements["posture1"]
    assert m.frf is not None and m.frf.gap is not None
    table = measurement_tables.frf_table(m.name, m.frf)
    gaps = [float(row[2]) for row in table.rows]
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[0] == pytest.approx(m.frf.gap.max(), rel=5e-4)
    remarks = {(row[0], row[1]): row[-1] for row in table.rows}
    assert remarks["1:+X", "6:-X"] == "the model does not move here"
    assert remarks["6:+Y", "6:-Y"] == "drive point"
    assert remarks["6:+X", "6:-Y"] == ""


def test_errors_without_known_noise() -> None:
    result = frf_result()
    m = result.measurements["posture1"]
    assert m.frf is not None
    blind = dataclasses.replace(m, gap=np.nan, frf=dataclasses.replace(m.frf, gap=None, noise=None))
    row = measurement_tables.error_table(dataclasses.replace(result, measurements={"posture1": blind})).rows[
        0
    ]
    assert row[2:5] == (NONE, NONE, NONE)
    assert "gap" not in measurement_tables.pair_errors(blind.frf, 1)  # type: ignore[arg-type]


def test_directions_name_free_parameters_only() -> None:
    rows = tables.direction_table(frf_result()).rows
    assert [row[3] for row in rows][-1] == "offset.z (+1.00)"
    assert rows[-1][1:3] == ("0", "∞")


def test_published_values() -> None:
    table = tables.published_table(frf_result())
    assert table is not None
    assert [row[0] for row in table.rows] == ["joint1.rz.stiffness", "joint2.rz.stiffness"]
    assert table.rows[1][1:4] == ("1.000e8", "5.000e7", "2.000")
    modes = tables.published_modes_table(frf_result())
    assert modes is not None
    assert modes.rows[0][1:4] == ("12.05", "12.17", "-0.990")
    assert tables.published_table(frf_result(published=None)) is None
    assert tables.published_modes_table(frf_result(published=None)) is None


def test_profiles() -> None:
    table = tables.profile_table(frf_result())
    assert table is not None
    assert table.rows == (("joint1.rz.damping", "1959", "1576", "2371", "1518", "2528", "N·m·s/rad"),)
    assert tables.profile_table(frf_result(profiles={})) is None


def test_tiles() -> None:
    found = {what: value for what, value, _ in tables.tiles(frf_result())}
    assert found == {
        "Gap, fitted data": "1.033",
        "Gap, validation": "1.063",
        "Parameters": "2 of 4",
        "Cost, frf-least-squares": "1.030",
    }
