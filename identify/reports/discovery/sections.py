"""The report of a discovery: what was added, step by step, before and after, and the final model."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.core.thresholds import CONVINCING
from identify.reports.compare import tables as compare_tables
from identify.reports.compare.pick import Shared
from identify.reports.compare.sections import ratio_parts, residual_parts, titles
from identify.reports.discovery import curve, figure, tables
from identify.reports.discovery.page_data import page_data
from identify.reports.discovery.pick import (
    BEFORE,
    SHOWN,
    OnRobot,
    beside,
    gap_maps,
    gaps_on_robot,
    models,
    part_bars,
    waterfall,
)
from identify.reports.kit.cells import Column, Curves, Table, number, ready, several, words
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    PRINT,
    TERMINAL,
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
    Text,
    note,
    origin,
)
from identify.reports.shared import measurement_tables
from identify.reports.shared.data import banded
from identify.reports.shared.figures import pair_mac
from identify.reports.shared.page_data import measurement_data
from identify.reports.shared.parameters import parameter_table
from identify.reports.shared.parts import (
    Page,
    error_lists,
    first_shapes,
    frf_picker,
    mac,
    overlays_beside,
    stage,
    stages_of,
    worst,
)
from identify.reports.shared.pick import errors
from identify.results.discovery import DiscoveryResult, StepResult

_PARTS = (
    "Gap (RMS residual over noise; dotted: 1, noise) of the fitted data in each part. In per cent: share of"
    " all that is above noise; those of bands, points, directions, impacts and measurements add up to 100 %."
)
_OPTIONS = (
    "Gap that remains with each of the best candidates, on fitted data (dot) and on data that were not fitted"
    " (circle); dashed: without it, dotted: noise. Log odds: model with it against model without it; dotted:"
    f" {CONVINCING:.0f}, above which it is convincing."
)
_FALLS = "Gap of each model, measured from noise (1), and what each addition does to it."
_ROBOT = "RMS of the gap over all measurements, bands and directions of each point."
_RINGED = " Ringed: place of each added effect, with the axes along or about which it acts."
_MAP = "One row per response channel, one column per band, all maps in the same colours: neutral is noise."
_ADDED = ("Parameter", "Value", "Unit", "95 % from", "to", "±")
_BRIEF = ("Candidate", "Gap", "Gap, other data", "Log odds", "Verdict")


def report(result: DiscoveryResult) -> Report:
    """What is said of a discovery."""
    shown, runs = beside(result), models(result)
    several = len(runs.runs) > 1
    table = compare_tables.parameter_table(runs) if several else parameter_table(result.before.parameters)
    ratios = ratio_parts(runs, table, f"the {next(iter(runs.runs))}")
    before = "Before and after" if several else "The remaining gap"
    sections = [
        Section("path", "How the gap shrinks", _path(result), "Path"),
        Section("added", "What was added", _added(result) if several else []),
        Section("curve", "What was measured there", curve.parts(result), "Measured stiffness"),
        Section("steps", "Step by step", [part for one in tables.steps(result) for part in _step(*one)]),
        Section("gap", before, _gap(result, shown), "Before and after"),
        Section("frf", "Frequency response functions", _frfs(shown), "FRFs"),
        Section("parameters", "Parameters", ratios),
        Section("modes", "Modes", _modes(shown, _page(list(runs.runs), shown))),
        Section("errors", "Errors of every FRF", _errors(shown), "Errors"),
        *_origin(result, several),
    ]
    goes_on = f"The study with these effects is {result.written}, beside this result. Next: identify fit"
    opening = Text(f"{goes_on} {result.written}") if result.written else None
    return Report(tables.tiles(result), [opening], sections)


def _added(result: DiscoveryResult) -> Parts:
    parameters = tables.added_parameter_table(result)
    return [
        Tabular(tables.added_table(result)),
        Tabular(parameters, heading=True, terminal=_ADDED, on=EVERYWHERE),
    ]


def _step(number_of: int, step: StepResult) -> Parts:
    """The story of a step, where it saw the gap, and what it tried."""
    decision = " ".join(filter(None, (step.decision, tables.doubt_sentence(step), step.advice)))
    return [
        Heading(tables.step_title(number_of, step), look="step", on=EVERYWHERE),
        Text(f"{tables.model_sentence(step)} {step.where}", on=EVERYWHERE),
        Text(decision, on=EVERYWHERE),
        *_where(number_of, step),
        *_places(number_of, step),
        *_options(number_of, step),
    ]


def _where(number_of: int, step: StepResult) -> Parts:
    """In which parts of the data the gap is."""
    bars, table = part_bars(step.parts, step.gap), tables.part_table(number_of, step)
    plots = [Drawing(f"parts-{number_of - 1}-{i}") for i in range(len(bars))]
    caption = f"Where model and measurement disagree. {_PARTS}"
    return [
        Heading("Where model and measurement disagree", 4, on=PAGE),
        Box("columns bars", plots),
        Drawing("", partial(figure.parts, bars), caption, lambda: [table]) if bars else None,
        note(_PARTS),
        Fold("All parts, with their gap and share", [Tabular(table)], on=PAGE),
        Tabular(table, rows=0, on=PRINT),
    ]


def _places(number_of: int, step: StepResult) -> Parts:
    """Where it could come from, whatever it is; nothing in results from before places were looked at."""
    if not step.places.sentence:
        return []
    table = curve.place_table(number_of, step.places)
    return [Heading("Where the gap could come from", 4, on=PAGE), Tabular(table, rows=SHOWN, on=EVERYWHERE)]


def _options(number_of: int, step: StepResult) -> Parts:
    table = tables.option_table(number_of, step)
    if not table.rows:
        return []
    name, caption = f"options-{number_of - 1}", f"The best candidates. {_OPTIONS}"
    others = table.part(slice(SHOWN, None))
    return [
        Heading("What was tried", 4, on=PAGE),
        Drawing(name, partial(figure.options, step), caption, lambda: [table], _OPTIONS),
        Tabular(table.part(slice(SHOWN), note=table.note), terminal=_BRIEF, on=PAGE | TERMINAL),
        Tabular(table, rows=SHOWN, on=PRINT),
        Fold(f"The other {len(others.rows)} candidates", [Tabular(others)], on=PAGE) if others.rows else None,
    ]


def _path(result: DiscoveryResult) -> Parts:
    """How each addition makes the gap shrink, and where it was and is on the robot."""
    said, rows = f"{_FALLS} Other data: {result.elsewhere}.", waterfall(result)
    gaps = several(("Gap", "Gap, other data"), "", [row.end for row in rows])
    numbers = Table("fall of the gap", [words("Model", [row.label for row in rows]), *gaps])
    falls, page, scripts = partial(figure.falls, rows), page_data(result), ("discovery.js",)
    plot = Drawing("falls-plot", falls, said, lambda: [numbers], said, page=page, scripts=scripts)
    return [plot, *_robot(result)]


def _robot(result: DiscoveryResult) -> Parts:
    """The gap at the points of the robot; nothing where no point was measured."""
    found = gaps_on_robot(result)
    if not any(np.isfinite(values).any() for _, values in found.gaps):
        return []
    said = _ROBOT + (_RINGED if len(result.marks.at_m) else "")
    drawn = partial(figure.on_robot, result)
    return [
        Heading("On the robot", on=PAGE),
        Drawing("gap-robot", drawn, said, lambda: [_point_table(found)], said),
    ]


def _point_table(found: OnRobot) -> Table:
    g = found.geometry
    gaps = [Column(f"Gap, {label}", "", values) for label, values in found.gaps]
    nodes = Column("Node", "", map(str, g.nodes), ready)
    return Table("gap at every point", [nodes, words("Point", g.point_names), *gaps])


def _gap(result: DiscoveryResult, shown: list[Shared]) -> Parts:
    """Before and after: the gap by measurement, band and channel, and frequency."""
    maps: list[Part] = []
    for row, (title, _) in enumerate(gap_maps(result)):
        caption, drawn = f"Gap by band and channel, {title}. {_MAP}", partial(figure.gap_map, result, row)
        maps.append(Heading(title, 4, on=PAGE))
        maps.append(Drawing(f"map-{row}", drawn, caption, partial(_map_curves, result, row)))
    return [
        Tabular(tables.gap_table(shown), heading=True),
        Heading("By band and channel", on=PAGE),
        *maps,
        note(_MAP),
        Heading("Over frequency", on=PAGE),
        *residual_parts([one for one in shown if one.frfs]),
        note("All FRFs of a measurement together, in bands."),
    ]


def _map_curves(result: DiscoveryResult, row: int) -> list[Curves]:
    edges, channels = result.map_before.bands_hz, result.map_before.channels
    maps = gap_maps(result)[row][1]
    return [Curves(label, banded(edges, channels, "residual/noise", gap)) for label, gap in maps]


def _frfs(shown: list[Shared]) -> Parts:
    parts: list[Part] = [frf_picker([one.first for one in shown])]
    for one in shown:
        if one.frfs:
            parts.append(Heading(f"{one.name}, {measurement_tables.use(one.first)}", on=PRINT))
            parts.append(overlays_beside(one.name, one.frfs, "gaps are those of the"))
    return parts


def _modes(shown: list[Shared], page: Page) -> Parts:
    first = [one.first for one in shown]
    label = next(iter(shown[0].runs))
    caption = f"Modal assurance criterion (MAC) of measured shapes and those of the {label}."
    matrices = [found for found in map(pair_mac, first) if found]
    blocks = [Box("block wide", _mode_block(k, one, label)) for k, one in enumerate(shown)]
    moving = stage(first, stages_of(first), page)
    return [moving, *blocks, *mac(matrices, caption), first_shapes(shown[0].first, label)]


def _mode_block(k: int, one: Shared, label: str) -> Parts:
    table = Tabular(tables.mode_table(one) or measurement_tables.mode_table(one.first), heading=True)
    if not one.first.pairs or one.first.pairs.mac_matrix is None:
        return [table]
    title = Heading(f"MAC of the measured shapes and those of the {label}", 4, on=PAGE)
    return [table, title, Drawing(f"mac-{k}", look="mac")]


def _errors(shown: list[Shared]) -> Parts:
    lists = [compare_tables.frf_table(one) for one in shown if one.frfs]
    return [*error_lists(lists), *map(worst, lists)]


def _origin(result: DiscoveryResult, several: bool) -> list[Section]:
    """The study, and the one with what was found, before the settings."""
    asked, provenance = origin(result)
    found = "The study with what was found, as it was written beside the result"
    after = [Fold(found, [Code(result.after.provenance.config)], open=True)] if several else []
    first, *settings = asked.parts
    study = Fold("The study", [first], open=True)
    return [Section("asked", asked.title, [study, *after, *settings], asked.label), provenance]


def _page(runs: list[str], shown: list[Shared]) -> Page:
    return {
        "measurements": [_measurement(one) for one in shown],
        "curves": {"measured": "measured", **dict(zip(("fitted", "before"), runs, strict=False))},
        "stages": {"model": runs[0], "measured": "measured"},
    }


def _measurement(one: Shared) -> dict[str, Any]:
    """The first model's view of a measurement; the FRFs of the other as a further curve, so that nothing is
    on the page twice.
    """
    others = {"before": one.frfs[BEFORE].fitted} if len(one.frfs) > 1 else {}
    data = measurement_data(one.first, others)
    if data["frf"] is not None:
        del data["frf"]["map"]
        data["frf"]["title"] = titles(one, lambda frf, pair: f"gap {number(errors(frf)[pair])}")
    return data
