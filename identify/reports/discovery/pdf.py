"""The PDF report of a discovery: the same tables as its HTML page, and printed figures."""

from __future__ import annotations

import numpy as np

from identify.reports.compare import figure as compare_figure
from identify.reports.compare import tables as compare_tables
from identify.reports.compare.pdf import residual_curves
from identify.reports.compare.pick import Shared
from identify.reports.discovery import figure as discovery_figure
from identify.reports.discovery import tables as own
from identify.reports.discovery.html import FALLS_NOTE, MAP_NOTE, OPTIONS_NOTE, PARTS_NOTE
from identify.reports.discovery.pick import SHOWN, beside, gap_maps, models, waterfall
from identify.reports.fit import data, frf_figure, measurement_tables, tables
from identify.reports.fit.pick import modes_in_band
from identify.reports.kit import figures, robot_figure
from identify.reports.kit.cells import Column, Curves, Table, number, words
from identify.reports.kit.document import Document
from identify.reports.kit.shapes import mode_views
from identify.results.discovery import DiscoveryResult, StepResult

_WORST_ROWS = 10


def document(result: DiscoveryResult) -> Document:
    """The PDF of a discovery, in the making."""
    made, shown = Document(), beside(result)
    several = len(models(result).runs) > 1
    with figures.style():
        made.opening(result, own.tiles(result))
        if several:
            made.add("heading", "What was added")
            made.table(own.added_table(result))
            made.table(own.added_parameter_table(result), heading=True)
        made.add("heading", "Step by step")
        for number_of, step in own.steps(result):
            _step(made, number_of, step)
        _gaps(made, result, shown, several)
        _frfs(made, shown)
        _parameters(made, result, several)
        _modes(made, shown)
    if several:
        made.add("heading", "The study with what was found")
        made.add("code", result.after.provenance.config)
    made.sources(result)
    return made


def _step(made: Document, number_of: int, step: StepResult) -> None:
    made.add("subheading", own.step_title(number_of, step))
    made.add("paragraph", f"{own.model_sentence(step)} {step.where}")
    made.add("paragraph", " ".join(filter(None, (step.decision, own.doubt_sentence(step), step.advice))))
    where, options = discovery_figure.parts(step), own.option_table(number_of, step)
    if where is not None:
        made.figure(
            where, f"Where model and measurement disagree. {PARTS_NOTE}", own.part_table(number_of, step)
        )
    made.tables.append(own.part_table(number_of, step))
    if options.rows:
        made.figure(discovery_figure.options(step), f"The best candidates. {OPTIONS_NOTE}", options)
        made.table(options, rows=SHOWN)
    if len(options.rows) > SHOWN:
        made.add(
            "paragraph",
            f"The best {SHOWN} of {len(options.rows)} candidates; all are on the HTML page and in the"
            " exported tables.",
        )


def _gaps(made: Document, result: DiscoveryResult, shown: list[Shared], several: bool) -> None:
    made.add("heading", "Before and after" if several else "The gap that is left")
    made.figure(
        discovery_figure.falls(waterfall(result)),
        f"{FALLS_NOTE} Other data: {result.elsewhere}.",
        _falls(result),
    )
    made.table(own.gap_table(shown))
    for row, (title, _) in enumerate(gap_maps(result)):
        made.figure(
            discovery_figure.gap_map(result, row),
            f"Gap by band and channel, {title}. {MAP_NOTE}",
            *_maps(result, row),
        )
    for one in shown:
        if one.frfs:
            caption = f"Residual over frequency, {one.name}, all FRFs together."
            made.figure(compare_figure.residuals(one), caption, residual_curves(one))


def _falls(result: DiscoveryResult) -> Table:
    columns = (words("Model"), Column("Gap"), Column("Gap, other data"))
    return Table(
        "fall of the gap", columns, tuple((row.label, *map(number, row.end)) for row in waterfall(result))
    )


def _maps(result: DiscoveryResult, row: int) -> list[Curves]:
    edges = result.map_before.bands_hz
    columns = (
        Column("From", "Hz"),
        Column("To", "Hz"),
        *(Column(name, "residual/noise") for name in result.map_before.channels),
    )
    return [
        Curves(label, columns, np.column_stack([edges[:-1], edges[1:], gap]))
        for label, gap in gap_maps(result)[row][1]
    ]


def _frfs(made: Document, shown: list[Shared]) -> None:
    with_frf = [one for one in shown if one.frfs]
    if not with_frf:
        return
    made.add("heading", "Frequency response functions")
    for one in with_frf:
        made.add("subheading", f"{one.name}, {measurement_tables.use(one.first)}")
        (label, frf), *others = one.frfs.items()
        curves = [
            curve
            for name, of in one.frfs.items()
            for curve in data.frfs(of, name)[(0 if name == label else 1) : 2]
        ]
        caption = (
            f"{one.name}: {frf.quantity}, {measurement_tables.band(frf)}; gaps are those of the {label}."
        )
        made.figure(
            frf_figure.overlays(frf, label, {other: of.fitted for other, of in others}), caption, *curves
        )
        table = compare_tables.frf_table(one)
        made.add(
            "paragraph",
            f"The {min(_WORST_ROWS, len(table.rows))} FRFs of {one.name} with the largest gap, of"
            f" {len(table.rows)}:",
        )
        made.table(table, rows=_WORST_ROWS)


def _parameters(made: Document, result: DiscoveryResult, several: bool) -> None:
    made.add("heading", "Parameters")
    runs = models(result)
    table = compare_tables.parameter_table(runs) if several else tables.parameter_table(result.before)
    made.table(table)
    if compare_figure.ratios(runs)[0]:
        caption = f"Values with their 95 % intervals over those of the {next(iter(runs.runs))}."
        made.figure(compare_figure.parameters(runs), caption, table)


def _modes(made: Document, shown: list[Shared]) -> None:
    made.add("heading", "Modes")
    for one in shown:
        made.table(own.mode_table(one) or measurement_tables.mode_table(one.first), heading=True)
    label = next(iter(shown[0].runs))
    matrices = [found for found in (figures.pair_mac(one.first) for one in shown) if found]
    mac = figures.mac(matrices)
    if mac is not None:
        made.figure(
            mac,
            f"Modal assurance criterion (MAC) of measured shapes and those of the {label}.",
            *map(data.mac, matrices),
        )
    first = shown[0].first
    views = mode_views(first)
    caption = f"Modes of the {label}, {first.name}: at rest (grey) and at both ends of the motion, enlarged"
    caption += "; rings: measured." if first.pairs and first.pairs.measured_shapes is not None else "."
    drawn, places = (
        robot_figure.shapes(first.geometry, views[: modes_in_band(first)]),
        data.geometry(first.name, first.geometry),
    )
    made.figure(drawn, caption, data.shapes(first.geometry, views), places)
