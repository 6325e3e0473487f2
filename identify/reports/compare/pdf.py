"""The PDF report of a comparison: the same tables as its HTML page, and printed figures."""

from __future__ import annotations

import numpy as np

from identify.reports.compare import figure as compare_figure
from identify.reports.compare import tables as compare_tables
from identify.reports.compare.html import mode_views
from identify.reports.compare.pick import Shared, shape_mac, shared
from identify.reports.fit import data, frf_figure
from identify.reports.kit import figures, robot_figure
from identify.reports.kit.cells import Column, Curves
from identify.reports.kit.document import Document
from identify.results.comparison import Comparison

_WORST_ROWS = 10


def document(comparison: Comparison) -> Document:
    """The PDF of a comparison, in the making."""
    made, found = Document(), shared(comparison)
    with figures.style():
        made.opening(comparison, compare_tables.tiles(comparison))
        made.table(compare_tables.run_table(comparison))
        made.table(compare_tables.effect_table(comparison), heading=True)
        _parameters(made, comparison)
        _modes(made, found)
        _frfs(made, comparison, [one for one in found if one.frfs])
    settings = compare_tables.setting_table(comparison)
    if settings is not None:
        made.add("heading", "What was asked")
        made.table(settings, heading=True)
    made.sources(comparison)
    return made


def _parameters(made: Document, comparison: Comparison) -> None:
    made.add("heading", "Parameters")
    table = compare_tables.parameter_table(comparison)
    made.table(table)
    if compare_figure.ratios(comparison)[0]:
        caption = "Values with their 95 % intervals over those of the first run."
        made.figure(compare_figure.parameters(comparison), caption, table)


def _modes(made: Document, found: list[Shared]) -> None:
    if not found:
        return
    made.add("heading", "Modes")
    for one in found:
        made.table(compare_tables.mode_table(one), heading=True)
    matrices = [mac for mac in map(shape_mac, found) if mac]
    mac = figures.mac(matrices)
    if mac is not None:
        made.figure(mac, "Modal assurance criterion (MAC) of the models' shapes.", *map(data.mac, matrices))
    first = found[0]
    views = mode_views(first)
    labels = list(first.runs)
    caption = (
        f"Modes at {first.name}: at rest (grey), {labels[0]} at both ends of the motion, enlarged; rings:"
        f" points of {labels[1]}."
    )
    geometry = first.first.geometry
    made.figure(robot_figure.shapes(geometry, views), caption, data.shapes(geometry, views))


def _frfs(made: Document, comparison: Comparison, found: list[Shared]) -> None:
    made.add("heading", "Errors")
    made.table(compare_tables.error_table(comparison))
    for one in found:
        made.add("subheading", one.name)
        (label, frf), *others = one.frfs.items()
        beside = {other: of.fitted for other, of in others}
        curves = [
            curve
            for name, of in one.frfs.items()
            for curve in data.frfs(of, name)[(0 if name == label else 1) : 2]
        ]
        made.figure(
            frf_figure.overlays(frf, label, beside),
            f"{one.name}: measured and fitted FRFs; errors are those of {label}.",
            *curves,
        )
        made.figure(
            compare_figure.residuals(one),
            "Residual over frequency, all common FRFs together.",
            residual_curves(one),
        )
        made.table(compare_tables.frf_table(one), heading=True, rows=_WORST_ROWS)


def residual_curves(one: Shared) -> Curves:
    """The residual of every run over frequency."""
    bands = [compare_figure.band_gaps(frf) for frf in one.frfs.values()]
    edges = bands[0][0]
    what = compare_figure.residual_label(one).split(" (")[0].lower().replace(" ", "")
    columns = (Column("From", "Hz"), Column("To", "Hz"), *(Column(label, what) for label in one.frfs))
    return Curves(
        "residuals", columns, np.column_stack([edges[:-1], edges[1:], *(values for _, values in bands)])
    )
