"""The report of a discovery: what was added, step by step, before and after, and the final model."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.core.thresholds import CONVINCING
from identify.reports.compare import tables as compare_tables
from identify.reports.compare.pick import Shared
from identify.reports.compare.sections import ratio_data, ratio_parts, residual_data, residual_parts
from identify.reports.discovery import curve, figure, tables
from identify.reports.discovery.pick import (
    BEFORE,
    SHOWN,
    STANDINGS,
    OnRobot,
    beside,
    few,
    gap_maps,
    gaps_on_robot,
    is_wide,
    models,
    part_bars,
    reach,
    standing,
    waterfall,
)
from identify.reports.shared import measurement_tables
from identify.reports.shared.page_data import measurement_data
from identify.reports.shared.parts import (
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
from identify.reports.fit.tables import parameter_rows
from identify.reports.kit.cells import Column, Curves, Table, number, words
from identify.reports.kit.figures import pair_mac
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
    Report,
    Section,
    Tabular,
    Text,
    origin,
)
from identify.reports.shared.robot_figure import Marks, projected
from identify.results.discovery import DiscoveryResult, StepResult

_PARTS = (
    "Gap (RMS residual over noise; dotted: 1, noise) of the fitted data in each part. In per cent: share of"
    " all that is above noise; those of bands, points, directions, impacts and measurements add up to 100 %."
)
_OPTIONS = (
    "Gap: what each of the best candidates leaves on fitted data (dot) and on data that were not fitted"
    " (circle); dashed: without it, dotted: noise. Log odds: for it over the model without it; dotted:"
    f" {CONVINCING:.0f}, above which it convinces."
)
_FALLS = "Gap of each model, measured from noise (1), and what each addition does to it."
_ROBOT = "RMS of the gap over all measurements, bands and directions of each point."
_RINGED = " Ringed: where what was added sits, with the axes along or about which it acts."
_MAP = "One row per response channel, one column per band, all maps in the same colours: neutral is noise."
_ADDED = ("Parameter", "Value", "Unit", "95 % from", "to", "±")
_BRIEF = ("Candidate", "Gap", "Gap, other data", "Log odds", "Verdict")
_SCRIPTS = ("compare.js", "discovery.js")


def report(result: DiscoveryResult) -> Report:
    """What is said of a discovery."""
    shown, runs = beside(result), models(result)
    several = len(runs.runs) > 1
    story = tables.steps(result)
    added = [
        Tabular(tables.added_table(result)),
        Tabular(tables.added_parameter_table(result), heading=True, terminal=_ADDED, on=EVERYWHERE),
    ]
    steps = [part for number_of, step in story for part in _step(number_of, step)]
    table = compare_tables.parameter_table(runs) if several else parameter_table(result.before.parameters)
    ratios = ratio_parts(runs, table, f"the {next(iter(runs.runs))}")
    step_data = {"steps": [_step_data(step) for _, step in story], "convincing": CONVINCING}
    sections = [
        _path(result),
        *([Section("added", "What was added", added)] if several else []),
        *curve.section(result),
        Section("steps", "Step by step", steps, data=step_data, scripts=_SCRIPTS),
        _gap(result, shown, several),
        Section("frf", "Frequency response functions", _frfs(shown), "FRFs", _page_data(runs.runs, shown)),
        Section("parameters", "Parameters", ratios, data=ratio_data(runs)),
        Section("modes", "Modes", _modes(shown)),
        _errors(shown),
    ]
    return Report(tables.tiles(result), _next(result), [*sections, *_origin(result, several)])


def _next(result: DiscoveryResult) -> list[Part]:
    """The new study and the command that goes on with it."""
    if not result.written:
        return []
    return [
        Text(
            f"The study with what was found is {result.written}, beside this result. Next: identify fit"
            f" {result.written}"
        )
    ]


def _step(number_of: int, step: StepResult) -> list[Part]:
    """The story of a step, where it saw the gap, and what it tried."""
    k, part_table = number_of - 1, tables.part_table(number_of, step)
    decision = " ".join(filter(None, (step.decision, tables.doubt_sentence(step), step.advice)))
    bars = part_bars(step.parts, step.gap)
    plots = [Drawing(f"parts-{k}-{i}") for i in range(len(bars))]
    where: list[Part] = [
        Heading("Where model and measurement disagree", 4, on=PAGE),
        Box("columns bars", plots),
    ]
    if bars:
        drawn = partial(figure.parts, bars)
        where.append(
            Drawing("", drawn, f"Where model and measurement disagree. {_PARTS}", lambda: [part_table])
        )
    return [
        Heading(tables.step_title(number_of, step), look="step", on=EVERYWHERE),
        Text(f"{tables.model_sentence(step)} {step.where}", on=EVERYWHERE),
        Text(decision, on=EVERYWHERE),
        *where,
        Text(_PARTS, "note", PAGE),
        Fold("All parts, with their gap and share", [Tabular(part_table)], on=PAGE),
        Tabular(part_table, rows=0, on=PRINT),
        *_places(number_of, step),
        *_options(number_of, step),
    ]


def _places(number_of: int, step: StepResult) -> list[Part]:
    """Where it could come from, whatever it is; nothing in results from before places were looked at."""
    if not step.places.sentence:
        return []
    table = curve.place_table(number_of, step.places)
    return [Heading("Where it could come from", 4, on=PAGE), Tabular(table, rows=SHOWN, on=EVERYWHERE)]


def _options(number_of: int, step: StepResult) -> list[Part]:
    table = tables.option_table(number_of, step)
    if not table.rows:
        return []
    best, others = tables.split(table)
    parts: list[Part] = [
        Heading("What was tried", 4, on=PAGE),
        Drawing(
            f"options-{number_of - 1}",
            partial(figure.options, step),
            f"The best candidates. {_OPTIONS}",
            lambda: [table],
            _OPTIONS,
        ),
        Tabular(best, terminal=_BRIEF, on=PAGE | TERMINAL),
        Tabular(table, rows=SHOWN, on=PRINT),
    ]
    if others.rows:
        parts.append(Fold(f"The other {len(others.rows)} candidates", [Tabular(others)], on=PAGE))
    return parts


def _path(result: DiscoveryResult) -> Section:
    """How each addition makes the gap shrink, and where it was and is on the robot."""
    note = f"{_FALLS} Other data: {result.elsewhere}."
    falls = partial(figure.falls, waterfall(result))
    parts = [Drawing("falls-plot", falls, note, lambda: [_fall_table(result)], note), *_robot(result)]
    data = {"falls": _fall_data(result), "robot": _robot_data(result)}
    return Section("path", "How the gap shrinks", parts, "Path", data)


def _gap(result: DiscoveryResult, shown: list[Shared], several: bool) -> Section:
    """Before and after: the gap by measurement, band and channel, and frequency."""
    with_frf = [one for one in shown if one.frfs]
    maps: list[Part] = []
    for row, (title, _) in enumerate(gap_maps(result)):
        caption = f"Gap by band and channel, {title}. {_MAP}"
        maps.append(Heading(title, 4, on=PAGE))
        maps.append(
            Drawing(
                f"map-{row}", partial(figure.gap_map, result, row), caption, partial(_map_curves, result, row)
            )
        )
    parts = [
        Tabular(tables.gap_table(shown), heading=True),
        Heading("By band and channel", on=PAGE),
        *maps,
        Text(_MAP, "note", PAGE),
        Heading("Over frequency", on=PAGE),
        *residual_parts(with_frf),
        Text("All FRFs of a measurement together, in bands.", "note", PAGE),
    ]
    title = "Before and after" if several else "The gap that is left"
    data = {
        **residual_data(with_frf),
        "maps": _map_data(result),
    }
    return Section("gap", title, parts, "Before and after", data)


def _robot(result: DiscoveryResult) -> list[Part]:
    """The gap at the points of the robot; nothing where no point was measured."""
    found = gaps_on_robot(result)
    if not any(np.isfinite(values).any() for _, values in found.gaps):
        return []
    said = _ROBOT + (_RINGED if len(result.marks.at_m) else "")
    return [
        Heading("On the robot", on=PAGE),
        Drawing("gap-robot", partial(figure.on_robot, result), said, lambda: [_point_table(found)], said),
    ]


def _point_table(found: OnRobot) -> Table:
    columns = (Column("Node"), words("Point"), *(Column(f"Gap, {label}") for label, _ in found.gaps))
    g = found.geometry
    rows = tuple(
        (str(node), name, *(number(values[k]) for _, values in found.gaps))
        for k, (node, name) in enumerate(zip(g.nodes, g.point_names, strict=True))
    )
    return Table("gap at every point", columns, rows)


def _robot_data(result: DiscoveryResult) -> dict[str, Any]:
    """All places as they are on the picture."""
    found, marks = gaps_on_robot(result), result.marks
    g = found.geometry
    return {
        "skeleton": projected(g.skeleton),
        "points": projected(g.points),
        "names": [
            f"{node} {name}, {link}"
            for node, name, link in zip(g.nodes, g.point_names, g.point_links, strict=True)
        ],
        "gaps": [{"label": label, "gap": values} for label, values in found.gaps],
        "marks": projected(marks.at_m),
        "said": list(marks.sentence),
        "arrows": [projected(ends).T for ends in Marks(marks.at_m, marks.along).arrows(g)],
    }


def _fall_table(result: DiscoveryResult) -> Table:
    columns = (words("Model"), Column("Gap"), Column("Gap, other data"))
    rows = tuple((row.label, *map(number, row.end)) for row in waterfall(result))
    return Table("fall of the gap", columns, rows)


def _map_curves(result: DiscoveryResult, row: int) -> list[Curves]:
    edges, channels = result.map_before.bands_hz, result.map_before.channels
    heads = (Column("From", "Hz"), Column("To", "Hz"), *(Column(name, "residual/noise") for name in channels))
    return [
        Curves(label, heads, np.column_stack([edges[:-1], edges[1:], gap]))
        for label, gap in gap_maps(result)[row][1]
    ]


def _frfs(shown: list[Shared]) -> list[Part]:
    parts: list[Part] = [frf_picker([one.first for one in shown])]
    for one in shown:
        if one.frfs:
            parts.append(Heading(f"{one.name}, {measurement_tables.use(one.first)}", on=PRINT))
            parts.append(overlays_beside(one.name, one.frfs, "gaps are those of the"))
    return parts


def _modes(shown: list[Shared]) -> list[Part]:
    first = [one.first for one in shown]
    label = next(iter(shown[0].runs))
    caption = f"Modal assurance criterion (MAC) of measured shapes and those of the {label}."
    matrices = [found for found in map(pair_mac, first) if found]
    blocks: list[Part] = []
    for k, one in enumerate(shown):
        table = tables.mode_table(one) or measurement_tables.mode_table(one.first)
        inside: list[Part] = [Tabular(table, heading=True)]
        if one.first.pairs and one.first.pairs.mac_matrix is not None:
            title = Heading(f"MAC of the measured shapes and those of the {label}", 4, on=PAGE)
            inside += [title, Drawing(f"mac-{k}", look="mac")]
        blocks.append(Box("block wide", inside))
    moving = stage(first, stages_of(first))
    return [moving, *blocks, *mac(matrices, caption), first_shapes(shown[0].first, label)]


def _errors(shown: list[Shared]) -> Section:
    lists = [compare_tables.frf_table(one) for one in shown if one.frfs]
    return Section("errors", "Errors of every FRF", [*error_lists(lists), *map(worst, lists)], "Errors")


def _origin(result: DiscoveryResult, several: bool) -> list[Section]:
    """The study, and the one with what was found, before the settings."""
    asked, provenance = origin(result)
    found = "The study with what was found, as it was written beside the result"
    after = [Fold(found, [Code(result.after.provenance.config)], open=True)] if several else []
    first, *settings = asked.parts
    study = Fold("The study", [first], open=True)
    return [Section("asked", asked.title, [study, *after, *settings], asked.label), provenance]


def _page_data(runs: dict[str, Any], shown: list[Shared]) -> dict[str, Any]:
    return {
        "measurements": [_measurement(one) for one in shown],
        "curves": {"measured": "measured", **dict(zip(("fitted", "before"), runs, strict=False))},
        "stages": {"model": next(iter(runs)), "measured": "measured"},
    }


def _measurement(one: Shared) -> dict[str, Any]:
    """The first model's view of a measurement; the FRFs of the other as a further curve, so that nothing is
    on the page twice.
    """
    others = {"before": one.frfs[BEFORE].fitted} if len(one.frfs) > 1 else {}
    data = measurement_data(one.first, others)
    if data["frf"] is not None:
        first = next(iter(one.frfs.values()))
        del data["frf"]["map"]
        data["frf"]["title"] = [
            ", ".join(f"{label} gap {number(errors(frf)[pair])}" for label, frf in one.frfs.items())
            for pair in range(len(first.output))
        ]
    return data


def _step_data(step: StepResult) -> dict[str, Any]:
    o, chosen = step.options, few(step.options)
    bars = part_bars(step.parts, step.gap)
    return {
        "gap": step.gap,
        "other": step.gap_validation,
        "parts": [{"title": b.title, "names": b.names, "gap": b.gap, "share": b.share} for b in bars],
        "most": max([1.0, *(float(b.gap.max()) for b in bars)]),
        "options": {
            "names": list(o.sentence[chosen]),
            "gap": o.gap[chosen],
            "other": o.gap_validation[chosen],
            "evidence": o.log_odds[chosen],
            "standing": [standing(verdict) for verdict in o.verdict[chosen]],
            "standings": STANDINGS,
            "wide": is_wide(np.append(o.gap[chosen], step.gap)),
        },
    }


def _fall_data(result: DiscoveryResult) -> dict[str, Any]:
    rows = waterfall(result)
    begin, end = (np.array([getattr(row, side) for row in rows]) for side in ("begin", "end"))
    return {
        "labels": [row.label for row in rows],
        "whole": [row.whole for row in rows],
        "begin": begin.T,
        "end": end.T,
        "wide": is_wide(np.concatenate([begin, end])),
        "elsewhere": result.elsewhere,
    }


def _map_data(result: DiscoveryResult) -> dict[str, Any]:
    return {
        "bands": result.map_before.bands_hz,
        "channels": list(result.map_before.channels),
        "reach": reach(result),
        "sets": [
            {"title": title, "maps": [{"label": label, "gap": gap.T} for label, gap in maps]}
            for title, maps in gap_maps(result)
        ],
    }
