"""What `discovery.js` draws from: steps, the fall of the gap, its maps, and the gap on the robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.core.thresholds import CONVINCING
from identify.reports.discovery.pick import (
    STANDINGS,
    few,
    gap_maps,
    gaps_on_robot,
    is_wide,
    part_bars,
    reach,
    standings,
    waterfall,
)
from identify.reports.discovery.tables import steps
from identify.reports.shared.robot_figure import Marks, projected
from identify.results.discovery import DiscoveryResult, StepResult


def page_data(result: DiscoveryResult) -> dict[str, Any]:
    """All of it."""
    return {
        "steps": [_step(step) for _, step in steps(result)],
        "convincing": CONVINCING,
        "falls": _falls(result),
        "maps": _maps(result),
        "robot": _robot(result),
    }


def _step(step: StepResult) -> dict[str, Any]:
    o, chosen, bars = step.options, few(step.options), part_bars(step.parts, step.gap)
    options = {
        "names": list(o.sentence[chosen]),
        "gap": o.gap[chosen],
        "other": o.gap_validation[chosen],
        "evidence": o.log_odds[chosen],
        "standing": standings(step),
        "standings": STANDINGS,
        "wide": is_wide(np.append(o.gap[chosen], step.gap)),
    }
    return {
        "gap": step.gap,
        "other": step.gap_validation,
        "parts": [{"title": b.title, "names": b.names, "gap": b.gap, "share": b.share} for b in bars],
        "most": max([1.0, *(float(b.gap.max()) for b in bars)]),
        "options": options,
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
    before = result.map_before
    sets = [
        {"title": title, "maps": [{"label": label, "gap": gap.T} for label, gap in maps]}
        for title, maps in gap_maps(result)
    ]
    return {"bands": before.bands_hz, "channels": list(before.channels), "reach": reach(result), "sets": sets}


def _robot(result: DiscoveryResult) -> dict[str, Any]:
    """All places as they are on the picture."""
    found, marks = gaps_on_robot(result), result.marks
    g = found.geometry
    points = zip(g.nodes, g.point_names, g.point_links, strict=True)
    return {
        "skeleton": projected(g.skeleton),
        "points": projected(g.points),
        "names": [f"{node} {name}, {link}" for node, name, link in points],
        "gaps": [{"label": label, "gap": values} for label, values in found.gaps],
        "marks": projected(marks.at_m),
        "said": list(marks.sentence),
        "arrows": [projected(ends).T for ends in Marks(marks.at_m, marks.along).arrows(g)],
    }
