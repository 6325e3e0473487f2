"""The report of a comparison: runs and models, parameters, modes, FRFs and residuals side by side."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.reports.compare import tables
from identify.reports.compare.figure import (
    band_gaps,
    parameters,
    ratios,
    residual_label,
    residuals,
    shown_range,
)
from identify.reports.compare.pick import Shared, matched, shape_mac, shared
from identify.reports.shared import measurement_tables
from identify.reports.shared.page_data import channels, frf_data, mac_data, robot_data
from identify.reports.shared.parts import (
    error_lists,
    frf_picker,
    mac,
    overlays_beside,
    shapes,
    stage,
    worst,
)
from identify.reports.shared.pick import errors
from identify.reports.kit.cells import Column, Curves, Table, number
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    Box,
    Code,
    Drawing,
    Fold,
    Heading,
    Part,
    Report,
    Section,
    Tabular,
    Text,
    origin,
)
from identify.reports.shared.shapes import ModeView, beside_views
from identify.results.comparison import Comparison
from identify.results.fit import FrfComparison

_SCRIPTS = ("compare.js",)


def report(comparison: Comparison) -> Report:
    """What is said of several runs side by side."""
    found = shared(comparison)
    with_frf = [one for one in found if one.frfs]
    opening = [
        Tabular(
            tables.run_table(comparison),
            terminal=("Run", "Cost kind", "Cost", "Gap", "Gap, validation", "Ended as it should"),
            on=EVERYWHERE,
        ),
        Tabular(tables.effect_table(comparison), heading=True, on=EVERYWHERE),
    ]
    table = tables.parameter_table(comparison)
    drawn = ratio_parts(comparison, table, "the first run")
    sections = [
        Section("parameters", "Parameters", drawn, data=ratio_data(comparison), scripts=_SCRIPTS),
        *(_modes(comparison, found) if found else []),
        Section("alone", "Modes at measurements of one run", _alone(comparison, found), "Modes of one run"),
        *(_frfs(with_frf) if with_frf else []),
        Section("errors", "Errors", _errors(comparison, with_frf)),
    ]
    return Report(
        tables.tiles(comparison), opening, [*sections, *origin(comparison, "Settings", _asked(comparison))]
    )


def ratio_parts(comparison: Comparison, table: Table, first: str) -> list[Part]:
    """The parameters of all runs, and their values over those of the first."""
    caption = f"Values with their 95 % intervals over those of {first}."
    figure = partial(parameters, comparison) if ratios(comparison)[0] else None
    return [
        Tabular(
            table,
            sort="parameters",
            terminal=("Parameter", "Unit", "Fitted", *comparison.runs),
            on=EVERYWHERE,
        ),
        Drawing("ratio-plot", figure, caption, lambda: [table]),
    ]


def ratio_data(comparison: Comparison) -> dict[str, Any]:
    """What `compare.js` draws of the parameters."""
    names, values = ratios(comparison)
    span = shown_range(values) if names else (0.1, 10.0)
    first = next(iter(comparison.runs))
    return {"parameters": {"name": names, "runs": values, "range": span, "first": first}}


def _modes(comparison: Comparison, found: list[Shared]) -> list[Section]:
    labels = list(comparison.runs)
    numbers = {label: k for k, label in enumerate(labels)}
    page_data = {
        "measurements": [_measurement(one, numbers) for one in found],
        "curves": {
            "measured": "measured",
            "fitted": labels[0],
            **{f"run{k}": label for k, label in enumerate(labels[1:], 1)},
        },
        "stages": dict(zip(("model", "measured"), labels, strict=False)),
    }
    blocks = [
        Box(
            "block wide",
            [
                Tabular(tables.mode_table(one), heading=True, on=EVERYWHERE),
                Heading("MAC of the models' shapes", on=PAGE),
                Drawing(f"mac-{k}", look="mac"),
            ],
        )
        for k, one in enumerate(found)
    ]
    matrices = [matrix for matrix in map(shape_mac, found) if matrix]
    macs = mac(matrices, "Modal assurance criterion (MAC) of the models' shapes.")
    return [
        Section("modes", "Modes", [*blocks, *macs], data=page_data),
        Section("robot", "Mode shapes", _shapes(found), "Shapes"),
    ]


def _alone(comparison: Comparison, found: list[Shared]) -> list[Part]:
    """The modes of every run at measurements that no other run has."""
    shown = {one.name for one in found}
    brief = measurement_tables.MODES_TERMINAL
    return [
        Tabular(measurement_tables.mode_table(m), heading=True, terminal=brief, on=EVERYWHERE)
        for run in comparison.runs.values()
        for m in run.measurements.values()
        if m.name not in shown
    ]


def _shapes(found: list[Shared]) -> list[Part]:
    first, views = found[0], mode_views(found[0])
    a, b = list(first.runs)[:2]
    stages = [("model", f"the model of {a}"), ("measured", f"the points of {b}, moving in the same mode")]
    caption = f"Modes at {first.name}: at rest (grey), {a} at both ends of the motion, enlarged"
    caption += f"; rings: points of {b}."
    return [stage([one.first for one in found], stages), shapes(first.first, views, views, caption)]


def _frfs(with_frf: list[Shared]) -> list[Section]:
    drawn = [overlays_beside(one.name, one.frfs, "errors are those of") for one in with_frf]
    note = Text("All common FRFs together, in bands.", "note", PAGE)
    return [
        Section(
            "frf",
            "Frequency response functions",
            [frf_picker([one.first for one in with_frf]), *drawn],
            "FRFs",
        ),
        Section(
            "residuals",
            "Where the models disagree with the data",
            [*residual_parts(with_frf), note],
            "Residuals",
            residual_data(with_frf),
            _SCRIPTS,
        ),
    ]


def residual_parts(with_frf: list[Shared]) -> list[Part]:
    """The residual of every run over frequency, a plot a measurement."""
    parts: list[Part] = []
    for k, one in enumerate(with_frf):
        caption = f"Residual over frequency, {one.name}, all common FRFs together."
        drawing = Drawing(
            f"residual-{k}",
            partial(residuals, one),
            caption,
            lambda one=one: [_residual_curves(one)],  # type: ignore[misc]
        )
        parts += [Heading(one.name, on=PAGE), drawing]
    return parts


def _errors(comparison: Comparison, with_frf: list[Shared]) -> list[Part]:
    lists = [tables.frf_table(one) for one in with_frf]
    return [
        Tabular(tables.error_table(comparison), on=EVERYWHERE),
        *(error_lists(lists) if lists else []),
        *map(worst, lists),
    ]


def _asked(comparison: Comparison) -> list[Part]:
    settings = tables.setting_table(comparison)
    differ: list[Part] = [] if settings is None else [Tabular(settings, heading=True)]
    studies = [
        Fold(f"Study of {label}", [Code(run.provenance.config)]) for label, run in comparison.runs.items()
    ]
    return [*differ, *studies]


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
    found["title"] = [
        ", ".join(f"{label} {_error(frf, pair)}" for label, frf in one.frfs.items())
        for pair in range(len(first.output))
    ]
    return found


def _error(frf: FrfComparison, pair: int) -> str:
    value = errors(frf)[pair]
    return f"gap {number(value)}" if frf.gap is not None else f"relative error {number(100 * value)} %"


def residual_data(with_frf: list[Shared]) -> dict[str, Any]:
    """The residual of every run over frequency, as steps."""
    return {"residuals": [_steps(one) for one in with_frf]}


def _steps(one: Shared) -> dict[str, Any]:
    runs = {}
    for label, frf in one.frfs.items():
        edges, values = band_gaps(frf)
        runs[label] = {"edges": edges, "values": np.append(values, values[-1:])}
    return {"name": one.name, "runs": runs, "label": residual_label(one)}


def _residual_curves(one: Shared) -> Curves:
    """The residual of every run over frequency."""
    bands = [band_gaps(frf) for frf in one.frfs.values()]
    edges = bands[0][0]
    what = residual_label(one).split(" (")[0].lower().replace(" ", "")
    columns = (Column("From", "Hz"), Column("To", "Hz"), *(Column(label, what) for label in one.frfs))
    values = np.column_stack([edges[:-1], edges[1:], *(values for _, values in bands)])
    return Curves("residuals", columns, values)
