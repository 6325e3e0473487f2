"""The tables of a motion's result: RMS differences in the form of Kawasaki Table 3, effects that were tried,
records.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from identify.core.text import capital
from identify.reports.kit.cells import NONE, Column, Table, angles, digits, number, ready, words
from identify.reports.kit.report import Tiles
from identify.reports.motion.pick import factor, shown_unit
from identify.results.circular import CircularTest
from identify.results.motion import Glitches, MotionResult, RecordResult, TrajectoryComparison


def tiles(result: MotionResult) -> Tiles:
    """The few numbers that are read first."""
    what = "at the study's numbers" if result.parameters is None else "as fitted"
    seconds = f"{sum(r.time_s[-1] for r in result.records.values()):.1f} s of motion"
    speed = f"real time, in steps of {result.step_s:.3g} s"
    return (
        ("Gap", number(result.gap, 3), f"RMS over noise, {what}"),
        ("Gap, not fitted", number(result.gap_validation, 3), "the same on records for validation"),
        ("Records", str(len(result.records)), seconds),
        ("Speed", f"{result.realtime_factor:.3g} times", speed),
    )


def record_table(result: MotionResult) -> Table:
    """The records, where they start, and their gaps."""
    records = list(result.records.values())
    columns = [
        words("Record", [r.name for r in records]),
        words("Use", [r.use or NONE for r in records]),
        words("Start", [angles(r.start_deg, "g") for r in records], "°"),
        Column("Length", "s", [r.time_s[-1] for r in records], digits(3)),
        words("File", [r.file or NONE for r in records]),
        Column("Gap", "", [r.gap for r in records], digits(3)),
    ]
    return Table("Records", columns)


def rms_tables(result: MotionResult) -> list[Table]:
    """A table per signal: a row per record and joint, a column per phase, RMS of simulated less recorded;
    then of torques and currents that the recorded motion takes.
    """
    records = list(result.records.values())
    fed = "with the recorded motion fed in"
    return [
        *(
            _rms_table(result, q, f"RMS difference of {_said(q)}")
            for q in _of(r.comparisons for r in records)
        ),
        *(
            _rms_table(result, q, f"RMS difference of {_said(q)}, {fed}", True)
            for q in _of(r.fed or {} for r in records)
        ),
    ]


def _of(compared: Iterable[Mapping[str, TrajectoryComparison]]) -> list[str]:
    """Quantities, each once, as they come."""
    return list(dict.fromkeys(quantity for one in compared for quantity in one))


def _said(quantity: str) -> str:
    return quantity.replace("_", " ")


def _rms_table(result: MotionResult, quantity: str, title: str, fed: bool = False) -> Table:
    compared = [(r, (r.fed or {}) if fed else r.comparisons) for r in result.records.values()]
    found = [(r, own[quantity]) for r, own in compared if quantity in own]
    phases = list(dict.fromkeys(phase for record in result.records.values() for phase in record.phases))
    both = ("", ", start model") if any(one.rms_initial is not None for _, one in found) else ("",)
    rows = [row for record, one in found for row in _rows(record, one, result.joints, phases, len(both))]
    unit = shown_unit(found[-1][1].unit)
    heads = [Column(capital(phase) + more, unit, form=digits(3)) for phase in phases for more in both]
    return Table.of(title, [words("Record"), words("Joint"), *heads], rows)


def _rows(
    record: RecordResult, c: TrajectoryComparison, joints: tuple[str, ...], phases: list[str], models: int
) -> list[tuple[str | float, ...]]:
    """A row per joint that was measured; models: whether only the fitted one, or the start model, too."""
    name = f"{record.name} (not fitted)" if record.use == "validate" else record.name
    rows = []
    for joint in np.flatnonzero(np.isfinite(c.rms[0])):
        values = [
            factor(c.unit) * rms[record.phases.index(phase), joint]
            if phase in record.phases and rms is not None
            else np.nan
            for phase in phases
            for rms in (c.rms, c.rms_initial)[:models]
        ]
        rows.append((name, "xyz"[joint] if c.unit == "m" else joints[joint], *values))
    return rows


def tracking_table(result: MotionResult) -> Table | None:
    """How far links, or drives where these were not recorded, are off their command (Nagoya, section 5): RMS
    by record, joint and phase, as recorded and by the model; None where neither was recorded.
    """
    phases = list(dict.fromkeys(phase for record in result.records.values() for phase in record.phases))
    rows = [row for record in result.records.values() for row in _tracking(record, result.joints, phases)]
    if not rows:
        return None
    both = ("measured", "model")
    heads = [Column(f"{capital(phase)}, {which}", "°", form=digits(4)) for phase in phases for which in both]
    return Table.of("Tracking error, RMS", [words("Record"), words("Of"), *heads], rows)


def _tracking(
    record: RecordResult, joints: tuple[str, ...], phases: list[str]
) -> Iterator[tuple[str | float, ...]]:
    """Rows of a record, of joints that are commanded to move and were recorded."""
    side = next((one for one in ("link_position", "motor_position") if one in record.comparisons), None)
    if side is None:
        return
    compared, command = record.comparisons[side], record.signals["command_position"].values
    ends = dict(zip(record.phases, record.phase_s, strict=True))
    for joint in np.flatnonzero(np.ptp(command, axis=0) > 0):
        wanted = np.interp(compared.time_s, record.time_s, command[:, joint])
        off = [np.degrees(own[:, joint] - wanted) for own in (compared.measured, compared.simulated)]
        cells = []
        for phase in phases:
            begin, end = ends.get(phase, (np.inf, -np.inf))
            inside = (compared.time_s >= begin) & (compared.time_s <= end)
            cells += [float(np.sqrt(np.mean(one[inside] ** 2))) if inside.any() else np.nan for one in off]
        if np.isfinite(cells).any():
            yield (record.name, f"{side.split('_')[0]} of {joints[joint]}", *cells)


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
    begun, found = tests["command"].centre, list(tests.values())
    aside = np.array([1e6 * (test.centre - begun) for test in found])
    quadrants = 1e6 * np.array([test.quadrant_rms for test in found])
    ends = {
        "Innermost": [test.error.min() for test in found],
        "Outermost": [test.error.max() for test in found],
        "Deviation": [test.deviation for test in found],
        "RMS": [test.rms for test in found],
    }

    def micrometres(heading: str, values: np.ndarray, decimals: int = 1) -> Column:
        return Column(heading, "µm", [f"{value:.{decimals}f}" for value in values], ready)

    columns = [
        words("Path", tests),
        Column("Mean radius", "mm", [f"{1e3 * test.radius:.4f}" for test in found], ready),
        micrometres("Centre off, first axis", aside[:, 0], 0),
        micrometres("Second", aside[:, 1], 0),
        *(micrometres(str(n) if n > 1 else "RMS, quadrant 1", quadrants[:, n - 1]) for n in range(1, 5)),
        *(micrometres(name, 1e6 * np.array(values)) for name, values in ends.items()),
    ]
    return Table(f"Circular test of {record.name}, radial errors about each path's mean circle", columns)


def glitch_tables(result: MotionResult) -> list[Table]:
    """What the friction of each joint adds to the radial error where it turns round, a table per record."""
    return [
        _glitch_table(record.name, record.glitches)
        for record in result.records.values()
        if record.glitches is not None
    ]


def _glitch_table(name: str, g: Glitches) -> Table:
    columns = [
        Column("Joint", "", [f"{joint:.0f}" for joint in g.joint], ready),
        Column("Turns round at", "°", [f"{angle:.0f}" for angle in np.degrees(g.angle)], ready),
        Column("Quadrant", "", [f"{1 + int(angle // (np.pi / 2)) % 4}" for angle in g.angle], ready),
        Column("Glitch of the feedback", "µm", [f"{1e6 * one:.0f}" for one in g.feedback], ready),
        Column("Of the end", "µm", [f"{1e6 * one:.0f}" for one in g.end], ready),
    ]
    note = (
        "Radial error due to the friction of a joint, outwards positive, within 30° after its reversal: the"
        " model with it minus the model without."
    )
    return Table(f"Glitches of {name} by joint", columns, note)


def trial_table(result: MotionResult) -> Table | None:
    """The effects that were tried, round by round; None where none were."""
    t = result.trials
    if t is None or len(t.name) < 2:
        return None
    odds = t.log_odds if len(t.log_odds) else np.full(len(t.name), np.nan)
    columns = [
        Column("Round", "", [f"{turn:.0f}" for turn in t.round], ready),
        words("Effect added", t.name),
        Column("Gap", "", t.gap, digits(3)),
        Column("Gap, validation", "", t.gap_validation, digits(3)),
        Column("Log odds", "", [f"{one:.0f}" if np.isfinite(one) else NONE for one in odds], ready),
        words("Decision", ["kept" if kept else "" for kept in t.kept]),
    ]
    note = (
        "Each is added to the model of its round and fitted; the likeliest stays if the validation records"
        f" support it (log odds above {'5' if result.searched else '2'}) and it reduces their gap by 1 %."
    )
    if result.searched:
        note += " Only the most promising of the catalogue, to first order, are tried."
    return Table("Effects that may be missing", columns, note)
