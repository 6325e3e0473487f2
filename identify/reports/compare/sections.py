"""The report of a comparison: runs and models, parameters, modes, FRFs and residuals side by side."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from identify.reports.compare import figure, tables
from identify.reports.compare.pick import Shared, matched, shape_mac, shared
from identify.reports.kit.cells import Curves, Table, number
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    Box,
    Code,
    Drawing,
    Fold,
    Heading,
    Part,
    Parts,
    Report,
    Section,
    Tabular,
    given,
    note,
    origin,
)
from identify.reports.shared import measurement_tables
from identify.reports.shared.data import RESIDUAL, banded
from identify.reports.shared.page_data import channels, frf_data, mac_data, robot_data
from identify.reports.shared.parts import (
    Page,
    error_lists,
    frf_picker,
    mac,
    overlays_beside,
    shapes,
    stage,
    worst,
)
from identify.reports.shared.pick import errors
from identify.reports.shared.shapes import ModeView, beside_views
from identify.results.comparison import Comparison
from identify.results.fit import FrfComparison

SCRIPTS = ("compare.js",)
_RUNS = ("Run", "Cost kind", "Cost", "Gap", "Gap, validation", "Ended as it should")


def report(comparison: Comparison) -> Report:
    """What is said of several runs side by side."""
    found = shared(comparison)
    with_frf = [one for one in found if one.frfs]
    opening = [
        Tabular(tables.run_table(comparison), terminal=_RUNS, on=EVERYWHERE),
        Tabular(tables.effect_table(comparison), heading=True, on=EVERYWHERE),
    ]
    ratios = ratio_parts(comparison, tables.parameter_table(comparison), "the first run")
    sections = [
        Section("parameters", "Parameters", ratios),
        *(_modes(comparison, found) if found else []),
        Section("alone", "Modes at measurements of one run", _alone(comparison, found), "Modes of one run"),
        *(_frfs(with_frf) if with_frf else []),
        Section("errors", "Errors", _errors(comparison, with_frf)),
        *origin(comparison, "Settings", _asked(comparison)),
    ]
    return Report(tables.tiles(comparison), opening, sections)


def ratio_parts(comparison: Comparison, table: Table, first: str) -> Parts:
    """The parameters of all runs, and their values over those of the first."""
    caption = f"Values with their 95 % intervals over those of {first}."
    names, values = figure.ratios(comparison)
    drawn = partial(figure.parameters, comparison) if names else None
    span = figure.shown_range(values) if names else (0.1, 10.0)
    page = {"name": names, "runs": values, "range": span, "first": next(iter(comparison.runs))}
    brief = ("Parameter", "Unit", "Fitted", *comparison.runs)
    return [
        Tabular(table, sort="parameters", terminal=brief, on=EVERYWHERE),
        Drawing("ratio-plot", drawn, caption, lambda: [table], page={"parameters": page}, scripts=SCRIPTS),
    ]


def _modes(comparison: Comparison, found: list[Shared]) -> list[Section]:
    first, *others = comparison.runs
    numbers = {label: k for k, label in enumerate(comparison.runs)}
    runs = {f"run{k}": label for k, label in enumerate(others, 1)}
    page = {
        "measurements": [_measurement(one, numbers) for one in found],
        "curves": {"measured": "measured", "fitted": first, **runs},
        "stages": dict(zip(("model", "measured"), comparison.runs, strict=False)),
    }
    blocks = [Box("block wide", _mode_block(k, one)) for k, one in enumerate(found)]
    matrices = [matrix for matrix in map(shape_mac, found) if matrix]
    macs = mac(matrices, "Modal assurance criterion (MAC) of the models' shapes.")
    return [
        Section("modes", "Modes", [*blocks, *macs]),
        Section("robot", "Mode shapes", _shapes(found, page), "Shapes"),
    ]


def _mode_block(k: int, one: Shared) -> Parts:
    table = Tabular(tables.mode_table(one), heading=True, on=EVERYWHERE)
    return [table, Heading("MAC of the models' shapes", on=PAGE), Drawing(f"mac-{k}", look="mac")]


def _alone(comparison: Comparison, found: list[Shared]) -> Parts:
    """The modes of every run at measurements that no other run has."""
    shown, brief = {one.name for one in found}, measurement_tables.MODES_TERMINAL
    alone = [m for run in comparison.runs.values() for m in run.measurements.values() if m.name not in shown]
    return [given(measurement_tables.mode_table(m), terminal=brief, on=EVERYWHERE) for m in alone]


def _shapes(found: list[Shared], page: Page) -> Parts:
    first, views = found[0], mode_views(found[0])
    a, b = list(first.runs)[:2]
    stages = [("model", f"the model of {a}"), ("measured", f"the points of {b}, moving in the same mode")]
    caption = f"Modes at {first.name}: at rest (grey), {a} at both ends of the motion, enlarged"
    caption += f"; rings: points of {b}."
    moving = stage([one.first for one in found], stages, page)
    return [moving, shapes(first.first, views, views, caption)]


def _frfs(with_frf: list[Shared]) -> list[Section]:
    drawn = [overlays_beside(one.name, one.frfs, "errors are those of") for one in with_frf]
    picker = frf_picker([one.first for one in with_frf])
    left = [*residual_parts(with_frf), note("All common FRFs together, in bands.")]
    return [
        Section("frf", "Frequency response functions", [picker, *drawn], "FRFs"),
        Section("residuals", "Where the models disagree with the data", left, "Residuals"),
    ]


def residual_parts(with_frf: list[Shared]) -> list[Part]:
    """The residual of every run over frequency, a plot a measurement."""
    parts: list[Part] = []
    for k, one in enumerate(with_frf):
        plot = figure.residuals(f"residual-{k}", one)
        parts += [Heading(one.name, on=PAGE), plot.drawing(partial(_residual_curves, one))]
    return parts


def _residual_curves(one: Shared) -> list[Curves]:
    """The residual of every run over frequency."""
    bands = [figure.band_gaps(frf) for frf in one.frfs.values()]
    what = RESIDUAL[one.in_noise]
    values = np.column_stack([values for _, values in bands])
    return [Curves("residuals", banded(bands[0][0], list(one.frfs), what, values))]


def _errors(comparison: Comparison, with_frf: list[Shared]) -> Parts:
    lists = [tables.frf_table(one) for one in with_frf]
    every = Tabular(tables.error_table(comparison), on=EVERYWHERE)
    return [every, *(error_lists(lists) if lists else []), *map(worst, lists)]


def _asked(comparison: Comparison) -> Parts:
    runs = comparison.runs.items()
    studies = [Fold(f"Study of {label}", [Code(run.provenance.config)]) for label, run in runs]
    return [given(tables.setting_table(comparison)), *studies]


def _measurement(one: Shared, numbers: dict[str, int]) -> dict[str, Any]:
    first = one.first
    return {
        "name": one.name,
        "use": measurement_tables.use(first),
        "robot": robot_data(first.geometry, channels(first.frf), mode_views(one), [], ("", "")),
        "frf": _frf(one, numbers) if one.frfs else None,
        "mac": mac_data(shape_mac(one)),
    }


def mode_views(one: Shared) -> list[ModeView]:
    """The modes of the first run with what they became in the second one, to look at."""
    a, b = list(one.runs.values())[:2]
    return beside_views(a, b, {mode: other for mode, (other, _) in matched(a, b).items()})


def _frf(one: Shared, numbers: dict[str, int]) -> dict[str, Any]:
    (_, first), *others = one.frfs.items()
    found = frf_data(first, {f"run{numbers[label]}": frf.fitted for label, frf in others})
    return found | {"title": titles(one, _error)}


def titles(one: Shared, error: Callable[[FrfComparison, int], str]) -> list[str]:
    """What stands above each FRF: the error of every model."""
    pairs = range(len(next(iter(one.frfs.values())).output))
    return [", ".join(f"{label} {error(frf, pair)}" for label, frf in one.frfs.items()) for pair in pairs]


def _error(frf: FrfComparison, pair: int) -> str:
    value = errors(frf)[pair]
    return f"gap {number(value)}" if frf.gap is not None else f"relative error {number(100 * value)} %"
