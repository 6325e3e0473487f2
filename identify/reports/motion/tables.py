"""The tables of a motion's result, as finished text: RMS differences in the form of Kawasaki Table 3, effects
that were tried, records.
"""

from __future__ import annotations

import numpy as np

from identify.core.text import capital
from identify.reports.kit.cells import NONE, Column, Table, number, words
from identify.reports.motion.pick import factor, shown_unit
from identify.results.circular import CircularTest
from identify.results.motion import MotionResult, RecordResult, TrajectoryComparison


def tiles(result: MotionResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first: (what, value, what it means)."""
    fitted = result.parameters is not None
    what = "as fitted" if fitted else "at the study's numbers"
    return (
        ("Gap", number(result.gap, 3), f"RMS over noise, {what}"),
        ("Gap, not fitted", number(result.gap_validation, 3), "the same on records for validation"),
        (
            "Records",
            str(len(result.records)),
            f"{sum(r.time_s[-1] for r in result.records.values()):.1f} s of motion",
        ),
        (
            "Speed",
            f"{result.realtime_factor:.0f} times",
            f"as fast as it happens, in steps of {result.step_s:.3g} s",
        ),
    )


def record_table(result: MotionResult) -> Table:
    """The records, where they start, and their gaps."""
    rows = [
        (
            r.name,
            r.use or NONE,
            ", ".join(f"{angle:g}" for angle in r.start_deg),
            number(r.time_s[-1], 3),
            r.file or NONE,
            number(r.gap, 3),
        )
        for r in result.records.values()
    ]
    columns = (
        words("Record"),
        words("Use"),
        words("Start", "°"),
        Column("Length", "s"),
        words("File"),
        Column("Gap"),
    )
    return Table("Records", columns, tuple(rows))


def rms_tables(result: MotionResult) -> list[Table]:
    """A table per signal: a row per record and joint, a column per phase, RMS of simulated less recorded."""
    quantities = list(dict.fromkeys(q for record in result.records.values() for q in record.comparisons))
    return [_rms_table(result, quantity) for quantity in quantities]


def _rms_table(result: MotionResult, quantity: str) -> Table:
    phases = list(dict.fromkeys(phase for record in result.records.values() for phase in record.phases))
    begun, rows, unit = False, [], ""
    for record in result.records.values():
        comparison = record.comparisons.get(quantity)
        if comparison is not None:
            unit, begun = shown_unit(comparison.unit), begun or comparison.rms_initial is not None
            rows += [
                _row(record, comparison, result.joints, joint, phases) for joint in _measured(comparison)
            ]
    headings = [
        heading for phase in phases for heading in ([phase, f"{phase}, start model"] if begun else [phase])
    ]
    columns = (
        words("Record"),
        words("Joint"),
        *(Column(capital(heading), unit) for heading in headings),
    )
    return Table(f"RMS difference of {quantity.replace('_', ' ')}", columns, tuple(rows))


def _measured(comparison: TrajectoryComparison) -> list[int]:
    return [int(joint) for joint in np.flatnonzero(np.isfinite(comparison.rms[0]))]


def _row(
    record: RecordResult, c: TrajectoryComparison, joints: tuple[str, ...], joint: int, phases: list[str]
) -> tuple[str, ...]:
    cells = []
    for phase in phases:
        for rms in (c.rms, c.rms_initial):
            if rms is not None:
                value = rms[record.phases.index(phase), joint] if phase in record.phases else np.nan
                cells.append(number(factor(c.unit) * value, 3))
    name = f"{record.name} (not fitted)" if record.use == "validate" else record.name
    return (name, "xyz"[joint] if c.unit == "m" else joints[joint], *cells)


def circle_tables(result: MotionResult) -> list[Table]:
    """The circular tests of a tool that was led, a table per record: commanded, by the encoders, in truth,
    and recorded.
    """
    return [
        _circle_table(record, record.circles)
        for record in result.records.values()
        if record.circles is not None
    ]


def _circle_table(record: RecordResult, tests: dict[str, CircularTest]) -> Table:
    begun = tests["command"].centre
    rows = []
    for name, test in tests.items():
        aside = 1e6 * (test.centre - begun)
        errors = (1e6 * value for value in (test.error.min(), test.error.max(), test.deviation, test.rms))
        cells = (
            f"{1e3 * test.radius:.4f}",
            *(f"{value:.0f}" for value in aside),
            *(f"{1e6 * value:.1f}" for value in test.quadrant_rms),
            *(f"{value:.1f}" for value in errors),
        )
        rows.append((name, *cells))
    heads = (
        ("Mean radius", "mm"),
        ("Centre off, first axis", "µm"),
        ("Second", "µm"),
        *((f"RMS, quadrant {n}" if n == 1 else str(n), "µm") for n in range(1, 5)),
        ("Innermost", "µm"),
        ("Outermost", "µm"),
    )
    columns = (words("Path"), *(Column(*head) for head in (*heads, ("Deviation", "µm"), ("RMS", "µm"))))
    return Table(
        f"Circular test of {record.name}, radial errors about each path's mean circle", columns, tuple(rows)
    )


def trial_table(result: MotionResult) -> Table | None:
    """The effects that were tried, round by round; None where none were."""
    t = result.trials
    if t is None or len(t.name) < 2:
        return None
    odds = t.log_odds if len(t.log_odds) else np.full(len(t.name), np.nan)
    parts = zip(t.round, t.name, t.gap, t.gap_validation, odds, t.kept, strict=True)
    rows = [
        (f"{turn:.0f}", name, number(gap, 3), number(judged, 3), _odds(one), "kept" if kept else "")
        for turn, name, gap, judged, one, kept in parts
    ]
    columns = (
        Column("Round"),
        words("Effect added"),
        Column("Gap"),
        Column("Gap, records that judge"),
        Column("Log odds"),
        words("Decision"),
    )
    least = "5" if result.searched else "2"
    note = (
        "Each is added to the model of its round and fitted; the likeliest stays if the records that judge"
        f" are for it (log odds above {least}) and it takes 1 % off their gap."
    )
    if result.searched:
        note += " Tried are those of the whole catalogue that promise most to first order."
    return Table("Effects that may be missing", columns, tuple(rows), note)


def _odds(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else NONE
