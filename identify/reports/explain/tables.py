"""The tables of an explained motion."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit.cells import (
    NONE,
    Column,
    Table,
    digits,
    interval,
    number,
    ready,
    several,
    unit,
    words,
)
from identify.reports.kit.report import Tiles
from identify.results.explain import ExplainResult, TargetResult

_TITLE = {
    "torque": "Motor torque",
    "deflection": "Motor-side minus link-side position",
    "tracking": "Tracking error",
}
_SCALE = {"N m": (1.0, "N m"), "rad": (1e3 * 180 / np.pi, "m°")}


def title(found: TargetResult) -> str:
    """What was explained."""
    return _TITLE[found.target]


def scale(found: TargetResult) -> tuple[float, str]:
    """Factor and unit in which the history is shown: N m, thousandths of a degree."""
    return _SCALE[found.unit]


def tiles(result: ExplainResult) -> Tiles:
    """The few numbers that are read first."""
    shown = []
    for found in result.targets.values():
        total = 1 - float((found.rms_judge**2).sum() / (found.rms_judge_start**2).sum())
        joints = f"of joints {', '.join(map(str, found.joints))}, squares on the held-out record"
        shown.append((f"{title(found)} explained", f"{number(100 * total, 3)} %", joints))
    count = sum(len(found.effects.name) for found in result.targets.values())
    tried = sum(found.tried for found in result.targets.values())
    return (*shown, ("Effects", str(count), f"of {tried} that were tried"))


def _levels(found: TargetResult, name: str, before: Array, after: Array) -> list[Column]:
    """RMS per joint, before and after."""
    factor, of = scale(found)
    sides = (("before", before), ("after", after))
    return [Column(f"{name}, {side}", of, factor * values, digits(3)) for side, values in sides]


def residual_table(found: TargetResult) -> Table:
    """A row per joint: RMS before and after on both records, and the gap."""
    columns = [
        Column("Joint", "", map(str, found.joints), ready),
        *_levels(found, "Fitted", found.rms_fit_start, found.rms_fit),
        *_levels(found, "Held out", found.rms_judge_start, found.rms_judge),
        Column("Explained", "%", 100 * found.explained, digits(3)),
        Column("Gap before", "", found.gap_start, digits(3)),
        Column("Gap after", "", found.gap, digits(3)),
    ]
    note = "RMS residual. Gap: over the sample-to-sample noise, on the held-out record; 1 is noise."
    for name, test in found.tests.items():
        columns += _levels(found, name, test.rms_start, test.rms)
    if found.tests:
        note += f" Only reported: {' and '.join(found.tests)}."
    return Table(f"{title(found)}: residuals", columns, note)


def effect_table(found: TargetResult) -> Table:
    """A row per effect, strongest evidence first; readings and rivals only where there are any."""
    e = found.effects
    said = [
        ("Reading", [reading or NONE for reading in e.reading]),
        ("Not distinguishable from", [found.words(rivals) if rivals else NONE for rivals in e.rivals]),
    ]
    columns = [
        words("Effect", [sentence or name for sentence, name in zip(e.sentence, e.name, strict=True)]),
        Column("Evidence", "", e.evidence, digits(3)),
        *(Column(f"Joint {joint}", "%", e.share[:, n], _share) for n, joint in enumerate(found.joints)),
        *(words(heading, texts) for heading, texts in said if set(texts) - {NONE}),
        words("Name", e.name),
    ]
    note = (
        "By evidence on the held-out record (ln of the likelihood ratio, residuals correlated in time). Per"
        " joint: share of the squared residual on the held-out record that this effect explains beside all"
        " others. Not distinguishable from: effects that would explain about as much in its place."
    )
    return Table(f"{title(found)}: effects", columns, note)


def _share(share: float) -> str:
    return NONE if np.isnan(share) or abs(share) < 5e-4 else number(100 * share, 3)


def step_table(found: TargetResult) -> Table:
    """How the effects were found, one a row."""
    (factor, of), s = scale(found), found.steps
    levels = factor * np.vstack([found.rms_judge_start, s.rms_judge])
    columns = [
        words("Step", range(len(levels))),
        words("Effect added", [NONE, *map(found.words, s.name)]),
        Column("Evidence", "", [np.nan, *s.evidence], digits(3)),
        *several([f"RMS joint {joint}" for joint in found.joints], of, levels, digits(3)),
    ]
    note = (
        "RMS on the held-out record after each step. An effect that was found and is not among the effects"
        " above was no longer needed."
    )
    return Table(f"{title(found)}: how they were found", columns, note)


def value_table(found: TargetResult) -> Table:
    """Values with intervals, and the same from the held-out record alone."""
    v = found.values
    names = zip(v.name, v.at_edge, strict=True)
    columns = [
        words("Effect", map(found.words, v.effect)),
        words("Value", [name + (" (at the end of its range)" if at_edge else "") for name, at_edge in names]),
        Column("Fitted", "", v.value),
        Column("95 %", "", map(interval, v.low_95, v.high_95), ready),
        Column("Held-out record alone", "", v.other),
        Column("95 %", "", map(interval, v.other_low_95, v.other_high_95), ready),
        words("Unit", map(unit, v.unit)),
    ]
    note = (
        "Intervals take into account that residuals are correlated in time; they are valid if no other"
        " effect is missing."
    )
    return Table(f"{title(found)}: values", columns, note)


def bound_table(found: TargetResult) -> Table:
    """Effects with one number that were not found: what it would be."""
    b = found.bounds
    columns = [
        words("Not found", map(found.words, b.effect)),
        Column("Would be", "", b.value, digits(3)),
        Column("95 %", "", map(interval, b.low_95, b.high_95), ready),
        words("Unit", map(unit, b.unit)),
    ]
    note = (
        "Added to the effects found, on the fitted record; an interval without zero is not enough, because"
        " the held-out record must agree."
    )
    return Table(f"{title(found)}: tried and not found", columns, note)


def pair_table(found: TargetResult) -> Table:
    """A row per pair of records: what is left, and which effects that pair does not confirm."""
    (factor, of), p = scale(found), found.pairs
    loose = ["; ".join(found.words(p.effect[n]) for n in np.flatnonzero(row <= 0)) for row in p.share]
    columns = [
        words("Fitted to", p.fitted),
        words("Judged by", p.judge),
        *several([f"RMS joint {joint}" for joint in found.joints], of, factor * p.rms, digits(3)),
        *several([f"Explained {joint}" for joint in found.joints], "%", 100 * p.explained, digits(3)),
        words("Not confirmed", [one or NONE for one in loose]),
    ]
    note = (
        "All effects found, fitted to one record alone and judged by another; shapes of waves and orders as"
        " found. Not confirmed: effects whose share, as fitted, leaves the judge no better."
    )
    return Table(f"{title(found)}: every pair of records", columns, note)
