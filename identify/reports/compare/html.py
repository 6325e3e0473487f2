"""The HTML report of a comparison, from the parts it shares with the page of a fit (`html`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.reports.compare import tables as compare_tables
from identify.reports.compare.figure import band_gaps, ratios, residual_label, shown_range
from identify.reports.compare.pick import Shared, matched, shape_mac, shared
from identify.reports.fit import measurement_tables
from identify.reports.fit.html import frf_data, render, robot_data
from identify.reports.fit.pick import errors
from identify.reports.kit.cells import number
from identify.reports.kit.shapes import ModeView, beside_views
from identify.results.comparison import Comparison
from identify.results.fit import FrfComparison


def page(comparison: Comparison) -> str:
    """The whole page of a comparison."""
    found = shared(comparison)
    labels = list(comparison.runs)
    with_frf = [one for one in found if one.frfs]
    names, values = ratios(comparison)
    data = {
        "measurements": [
            _measurement(one, {label: number for number, label in enumerate(labels)}) for one in found
        ],
        "curves": {
            "measured": "measured",
            "fitted": labels[0],
            **{f"run{n}": label for n, label in enumerate(labels[1:], 1)},
        },
        "stages": dict(zip(("model", "measured"), labels, strict=False)),
        "parameters": {
            "name": names,
            "runs": values,
            "range": shown_range(values) if names else (0.1, 10.0),
            "first": labels[0],
        },
        "residuals": [residual_data(one) for one in with_frf],
    }
    return render(
        "compare.html.j2",
        "compare.js",
        data,
        comparison,
        measurements=[one.first for one in found],
        with_frf_measurements=[one.first for one in with_frf],
        frf_tables=[compare_tables.frf_table(one) for one in with_frf],
        shared=found,
        with_frf=with_frf,
        sections=_sections(bool(found), bool(with_frf)),
        stages=[
            ("model", f"the model of {labels[0]}"),
            ("measured", f"the points of {labels[1]}, moving in the same mode"),
        ],
        tiles=compare_tables.tiles(comparison),
        tables=compare_tables,
    )


def _sections(with_measurements: bool, with_frf: bool) -> list[tuple[str, str]]:
    modes = [("modes", "Modes"), ("robot", "Shapes")] if with_measurements else []
    frfs = (
        [("frf", "FRFs"), ("residuals", "Residuals"), ("errors", "Errors")]
        if with_frf
        else [("errors", "Errors")]
    )
    return [
        ("verdict", "Verdict"),
        ("parameters", "Parameters"),
        *modes,
        *frfs,
        ("asked", "Settings"),
        ("provenance", "Provenance"),
    ]


def _measurement(one: Shared, numbers: dict[str, int]) -> dict[str, Any]:
    first = one.first
    mac = shape_mac(one)
    axes = None
    if mac is not None:
        rows, columns = ([number(hz) for hz in side] for side in (mac.rows_hz, mac.columns_hz))
        axes = {
            "rows": rows,
            "columns": columns,
            "down": mac.down,
            "across": mac.across,
            "values": mac.values,
        }
    return {
        "name": one.name,
        "use": measurement_tables.use(first),
        "robot": robot_data(first.geometry, first.frf, mode_views(one), [], ("", "")),
        "frf": _frf(one, numbers) if one.frfs else None,
        "mac": axes,
    }


def mode_views(one: Shared) -> list[ModeView]:
    """The modes of the first run with what they became in the second one, to look at."""
    a, b = list(one.runs.values())[:2]
    return beside_views(a, b, {mode: other for mode, (other, _) in matched(a, b).items()})


def _frf(one: Shared, numbers: dict[str, int]) -> dict[str, Any]:
    (_, first), *others = one.frfs.items()
    data = frf_data(first, {f"run{numbers[label]}": frf.fitted for label, frf in others})
    data["title"] = [_title(one, pair) for pair in range(len(first.output))]
    return data


def _title(one: Shared, pair: int) -> str:
    return ", ".join(f"{label} {_error(frf, pair)}" for label, frf in one.frfs.items())


def _error(frf: FrfComparison, pair: int) -> str:
    value = errors(frf)[pair]
    return f"gap {number(value)}" if frf.gap is not None else f"relative error {number(100 * value)} %"


def residual_data(one: Shared) -> dict[str, Any]:
    """The residual of every run over frequency, as steps."""
    runs = {}
    for label, frf in one.frfs.items():
        edges, values = band_gaps(frf)
        runs[label] = {"edges": edges, "values": np.append(values, values[-1:])}
    return {"name": one.name, "runs": runs, "label": residual_label(one)}
