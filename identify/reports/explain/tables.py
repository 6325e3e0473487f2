"""The tables of an explained motion, as finished text; terminal, HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import NONE, Column, Table, number, words
from identify.reports.kit.cells import unit as printed
from identify.results.explain import ExplainResult, TargetResult

_TITLE = {
    "torque": "Motor torque",
    "deflection": "Motor-side minus link-side position",
    "tracking": "Tracking error",
}
_OPTIONAL = ("Reading", "Not distinguishable from")
"""Columns of effects that are left out where they say nothing."""
_SCALE = {"N m": (1.0, "N m"), "rad": (1e3 * 180 / np.pi, "m°")}


def title(found: TargetResult) -> str:
    """What was explained."""
    return _TITLE[found.target]


def scale(found: TargetResult) -> tuple[float, str]:
    """Factor and unit in which the history is shown: N m, thousandths of a degree."""
    return _SCALE[found.unit]


def tiles(result: ExplainResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first: (what, value, what it means)."""
    shown = []
    for found in result.targets.values():
        total = 1 - float((found.rms_judge**2).sum() / (found.rms_judge_start**2).sum())
        joints = f"of joints {', '.join(map(str, found.joints))}, squares on the held-out record"
        shown.append((f"{title(found).split(' (')[0]} explained", f"{number(100 * total, 3)} %", joints))
    count = sum(len(found.effects.name) for found in result.targets.values())
    tried = sum(found.tried for found in result.targets.values())
    return (*shown, ("Effects", str(count), f"of {tried} that were tried"))


def residual_table(found: TargetResult) -> Table:
    """A row per joint: RMS before and after on both records, and the gap."""
    factor, unit = scale(found)
    columns: tuple[Column, ...] = (
        Column("Joint"),
        Column("Fitted, before", unit),
        Column("Fitted, after", unit),
        Column("Held out, before", unit),
        Column("Held out, after", unit),
        Column("Explained", "%"),
        Column("Gap before"),
        Column("Gap after"),
    )
    rows = []
    for row, joint in enumerate(found.joints):
        levels = (found.rms_fit_start, found.rms_fit, found.rms_judge_start, found.rms_judge)
        cells = [number(factor * level[row], 3) for level in levels]
        ends = (
            number(100 * found.explained[row], 3),
            number(found.gap_start[row], 3),
            number(found.gap[row], 3),
        )
        seen = [
            number(factor * level[row], 3) for t in found.tests.values() for level in (t.rms_start, t.rms)
        ]
        rows.append((str(joint), *cells, *ends, *seen))
    note = (
        "RMS of what is left. Gap: over the noise from sample to sample on the held-out record; 1 is noise."
    )
    for test in found.tests:
        columns += (Column(f"{test}, before", unit), Column(f"{test}, after", unit))
    if found.tests:
        note += f" Nothing depended on {' and '.join(found.tests)}."
    return Table(f"{title(found)}: what is left", columns, tuple(rows), note)


def effect_table(found: TargetResult) -> Table:
    """A row per effect, strongest evidence first."""
    columns = (
        words("Effect"),
        Column("Evidence"),
        *(Column(f"Joint {joint}", "%") for joint in found.joints),
        words("Reading"),
        words("Not distinguishable from"),
        words("Name"),
    )
    e = found.effects
    rows = [
        (
            e.sentence[row] or e.name[row],
            number(e.evidence[row], 3),
            *(_percent(value) for value in e.share[row]),
            e.reading[row] or NONE,
            found.words(e.rivals[row]) if e.rivals[row] else NONE,
            e.name[row],
        )
        for row in range(len(e.name))
    ]
    note = (
        "By evidence on the held-out record (ln of the likelihood ratio, residuals correlated in time). Per"
        " joint: the part of the squares left on the held-out record without this effect that it takes away,"
        " all others staying. Not distinguishable from: effects that would do about as well in its place."
    )
    used = [n for n, column in enumerate(columns) if column.heading not in _OPTIONAL or _said(rows, n)]
    kept = tuple(tuple(row[n] for n in used) for row in rows)
    return Table(f"{title(found)}: effects", tuple(columns[n] for n in used), kept, note)


def _said(rows: list[tuple[str, ...]], column: int) -> bool:
    return any(row[column] != NONE for row in rows)


def _percent(share: float) -> str:
    return NONE if np.isnan(share) or abs(share) < 5e-4 else number(100 * share, 3)


def step_table(found: TargetResult) -> Table:
    """How the effects were found, one a row."""
    factor, unit = scale(found)
    columns = (
        words("Step"),
        words("Effect added"),
        Column("Evidence"),
        *(Column(f"RMS joint {joint}", unit) for joint in found.joints),
    )
    s = found.steps
    rows = [("0", NONE, NONE, *(number(factor * value, 3) for value in found.rms_judge_start))]
    for row, name in enumerate(s.name):
        rows.append(
            (
                str(row + 1),
                found.words(name),
                number(s.evidence[row], 3),
                *(number(factor * value, 3) for value in s.rms_judge[row]),
            )
        )
    note = (
        "RMS on the held-out record after each step. An effect that was found and is not among the effects"
        " above was no longer needed."
    )
    return Table(f"{title(found)}: how they were found", columns, tuple(rows), note)


def value_table(found: TargetResult) -> Table:
    """Values with intervals, and the same from the held-out record alone."""
    columns = (
        words("Effect"),
        words("Value"),
        Column("Fitted"),
        Column("95 %"),
        Column("Held-out record alone"),
        Column("95 %"),
        words("Unit"),
    )
    v = found.values
    rows = [
        (
            found.words(v.effect[row]),
            v.name[row] + (" (at the end of its range)" if v.at_edge[row] else ""),
            number(v.value[row]),
            _interval(v.low_95[row], v.high_95[row]),
            number(v.other[row]),
            _interval(v.other_low_95[row], v.other_high_95[row]),
            printed(v.unit[row]),
        )
        for row in range(len(v.name))
    ]
    note = (
        "Intervals take into account that residuals are correlated in time; they hold as far as the"
        " effects found are all there are."
    )
    return Table(f"{title(found)}: values", columns, tuple(rows), note)


def bound_table(found: TargetResult) -> Table:
    """Effects with one number that were not found: what it would be."""
    columns = (words("Not found"), Column("Would be"), Column("95 %"), words("Unit"))
    b = found.bounds
    rows = [
        (
            found.words(b.effect[row]),
            number(b.value[row], 3),
            _interval(b.low_95[row], b.high_95[row]),
            printed(b.unit[row]),
        )
        for row in range(len(b.effect))
    ]
    note = (
        "Added to the effects found, on the fitted record; an interval without zero is not enough, because"
        " the held-out record must agree."
    )
    return Table(f"{title(found)}: tried and not found", columns, tuple(rows), note)


def pair_table(found: TargetResult) -> Table:
    """A row per pair of records: what is left, and which effects that pair does not confirm."""
    factor, unit = scale(found)
    p = found.pairs
    columns = (
        words("Fitted to"),
        words("Judged by"),
        *(Column(f"RMS joint {joint}", unit) for joint in found.joints),
        *(Column(f"Explained {joint}", "%") for joint in found.joints),
        words("Not confirmed"),
    )
    rows = [
        (
            p.fitted[row],
            p.judge[row],
            *(number(factor * value, 3) for value in p.rms[row]),
            *(number(100 * value, 3) for value in p.explained[row]),
            _unconfirmed(found, row) or NONE,
        )
        for row in range(len(p.fitted))
    ]
    note = (
        "All effects found, fitted to one record alone and judged by another; shapes of waves and orders as"
        " found. Not confirmed: effects whose share, as fitted, leaves the judge no better."
    )
    return Table(f"{title(found)}: every pair of records", columns, tuple(rows), note)


def _unconfirmed(found: TargetResult, row: int) -> str:
    loose = np.flatnonzero(found.pairs.share[row] <= 0)
    return "; ".join(found.words(found.pairs.effect[n]) for n in loose)


def _interval(low: float, high: float) -> str:
    return f"{number(low, 3)} to {number(high, 3)}" if np.isfinite([low, high]).all() else NONE
