"""The HTML report of a discovery, from the parts it shares with the pages of a fit (`html`) and of a
comparison (`compare_html`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.core.thresholds import CONVINCING
from identify.reports.compare import tables as compare_tables
from identify.reports.compare.figure import ratios, shown_range
from identify.reports.compare.html import residual_data
from identify.reports.compare.pick import Shared
from identify.reports.discovery import tables as discovery_tables
from identify.reports.discovery.pick import (
    BEFORE,
    STANDINGS,
    beside,
    few,
    gap_maps,
    is_wide,
    models,
    part_bars,
    reach,
    standing,
    waterfall,
)
from identify.reports.fit import measurement_tables, tables
from identify.reports.fit.html import measurement_data, render, stages_of
from identify.reports.fit.pick import errors
from identify.reports.kit.cells import number
from identify.results.comparison import Comparison
from identify.results.discovery import DiscoveryResult, StepResult

PARTS_NOTE = (
    "Residual over noise of the fitted data in each part; dotted: noise. In per cent: share of all that is"
    " above noise; those of bands, points, directions, blows and measurements add up to 100 %."
)
OPTIONS_NOTE = (
    "Left: the gap that each of the best candidates leaves on fitted data (dot) and on data that were not"
    " fitted (circle); dashed: without it, dotted: noise. Right: log odds for it over the model without it;"
    f" dotted: {CONVINCING:.0f}, above which it convinces."
)
FALLS_NOTE = "Gap of each model, measured from noise (1), and what each addition does to it."
MAP_NOTE = (
    "One row per response channel, one column per band, all maps in the same colours: neutral is noise."
)
_SECTIONS = (
    ("verdict", "Verdict"),
    ("added", "What was added"),
    ("steps", "Step by step"),
    ("gap", "Before and after"),
    ("frf", "FRFs"),
    ("parameters", "Parameters"),
    ("modes", "Modes"),
    ("errors", "Errors"),
    ("asked", "Study"),
    ("provenance", "Provenance"),
)


def page(result: DiscoveryResult) -> str:
    """The whole page of a discovery."""
    runs, shown = models(result), beside(result)
    several = len(runs.runs) > 1
    story = discovery_tables.steps(result)
    first = [one.first for one in shown]
    return render(
        "discovery.html.j2",
        ("compare.js", "discovery.js"),
        _payload(result, runs, shown),
        result,
        sections=[section for section in _SECTIONS if section[0] != "added" or several],
        several=several,
        name=next(iter(runs.runs)),
        shown=shown,
        measurements=first,
        stages=stages_of(first),
        tiles=discovery_tables.tiles(result),
        discovery=discovery_tables,
        parameters=compare_tables.parameter_table(runs) if several else tables.parameter_table(result.before),
        modes=[discovery_tables.mode_table(one) or measurement_tables.mode_table(one.first) for one in shown],
        steps=story,
        parts=[part_bars(step.parts, step.gap) for _, step in story],
        frf_tables=[compare_tables.frf_table(one) for one in shown if one.frfs],
        maps=gap_maps(result),
        notes={"parts": PARTS_NOTE, "options": OPTIONS_NOTE, "falls": FALLS_NOTE, "map": MAP_NOTE},
    )


def _payload(result: DiscoveryResult, runs: Comparison, shown: list[Shared]) -> dict[str, Any]:
    """What the scripts draw from."""
    names, values = ratios(runs)
    first = next(iter(runs.runs))
    return {
        "measurements": [_measurement(one) for one in shown],
        "curves": {"measured": "measured", **dict(zip(("fitted", "before"), runs.runs, strict=False))},
        "stages": {"model": first, "measured": "measured"},
        "parameters": {
            "name": names,
            "runs": values,
            "range": shown_range(values) if names else (0.1, 10.0),
            "first": first,
        },
        "residuals": [residual_data(one) for one in shown if one.frfs],
        "steps": [_step(step) for _, step in discovery_tables.steps(result)],
        "falls": _falls(result),
        "maps": _maps(result),
        "convincing": CONVINCING,
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


def _step(step: StepResult) -> dict[str, Any]:
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


def _falls(result: DiscoveryResult) -> dict[str, Any]:
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


def _maps(result: DiscoveryResult) -> dict[str, Any]:
    return {
        "bands": result.map_before.bands_hz,
        "channels": list(result.map_before.channels),
        "reach": reach(result),
        "sets": [
            {"title": title, "maps": [{"label": label, "gap": gap.T} for label, gap in maps]}
            for title, maps in gap_maps(result)
        ],
    }
