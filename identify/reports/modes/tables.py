"""The tables of a modal analysis."""

from __future__ import annotations

import numpy as np

from identify.core.text import capital, count
from identify.core.thresholds import SIGMAS_95
from identify.reports.kit.cells import (
    Column,
    Table,
    angles,
    digits,
    number,
    percent,
    ready,
    whole,
    words,
)
from identify.reports.kit.report import Tiles
from identify.reports.shared.measurement_tables import AREA, FRAC, band, pair_name
from identify.reports.shared.pick import worst_first
from identify.results.modes import AnalysedMeasurement, ModesResult

DIAGRAM_NOTE = (
    "Poles of every model order over the complex mode indicator function (CMIF). Stable: in a cluster of"
    " poles that is present in enough orders. Dotted lines: the chosen modes. Framed or crossed out: clusters"
    " that were kept or dropped by hand, or that explain less than a mode must."
)
_DOUBTFUL = (
    " Doubtful: a frequency whose interval is wider than the resonance, a damping whose interval contains 0,"
    " a shape more complex than is accepted of candidates."
)


def tiles(result: ModesResult) -> Tiles:
    """The few numbers that are read first."""
    found, nouns = list(result.measurements.values()), result.noun.several
    collinear = np.concatenate([m.modes.mpc for m in found])
    lowest = number(collinear.min(initial=1.0) if len(collinear) else np.nan)
    several = f"in {count(len(found), 'measurement')}" if len(found) > 1 else "of the measured structure"
    error = percent(max((m.total_error for m in found if len(m.modes.frequency_hz)), default=np.nan))
    rejected = sum(len(m.rejected.reason) for m in found)
    return (
        ("Modes", str(result.found), several),
        (f"Rebuilt {nouns}", f"{error} %", f"off (RMS over all {nouns}); 0 is perfect"),
        ("Lowest MPC", lowest, "modal phase collinearity; 1: a real shape"),
        ("Rejected", str(rejected), "candidates"),
    )


def measurement_table(result: ModesResult) -> Table:
    """What was analysed; the decay of a window only where there was one."""
    found = list(result.measurements.values())
    decay = [m.frf.window_decay_per_s for m in found]
    columns = [
        words("Measurement", [m.name for m in found]),
        words("Joint angles", [angles(m.posture_deg, ".1f") or "not stated" for m in found], "°"),
        words(capital(result.noun.several), map(_analysed, found)),
        *([Column("Decay", "1/s", decay)] if any(decay) else []),
        Column("Modes", "", [len(m.modes.frequency_hz) for m in found], whole),
        Column("Error", "%", [m.total_error for m in found], percent),
    ]
    references = dict.fromkeys(", ".join(m.modes.references) for m in found)
    note = (
        f"{'Decay: of the exponential window on force and response. ' if any(decay) else ''}"
        f"Error: of the {result.noun.several} rebuilt from the modes. References: {'; '.join(references)}."
    )
    return Table("Measurements", columns, note)


def _analysed(m: AnalysedMeasurement) -> str:
    if m.output_only is None:
        return f"{count(len(m.frf.output), 'FRF')} ({m.frf.quantity}), {band(m.frf)}"
    return f"{len(m.frf.output)}, from {number(m.output_only.seconds)} s of responses, {band(m.frf)}"


def mode_table(m: AnalysedMeasurement) -> Table:
    """Frequencies and damping with their standard deviations, damping as the window showed it, and the
    quality of the shapes.
    """
    t, windowed = m.modes, bool(m.frf.window_decay_per_s)
    columns = [
        words("Mode", range(1, len(t.frequency_hz) + 1)),
        Column("Frequency", "Hz", t.frequency_hz, digits(6)),
        Column("± 95 %", "Hz", SIGMAS_95 * t.frequency_std_hz, digits(2)),
        Column("Damping ratio", "%", t.damping_ratio, percent),
        Column("± 95 %", "%", 100 * SIGMAS_95 * t.damping_std, digits(2)),
        *([Column("Seen through window", "%", t.seen_damping_ratio, percent)] if windowed else []),
        Column("MPC", "", t.mpc),
        Column("MPD", "°", t.mpd_deg, digits(3)),
        *([words("Doubtful", t.doubt)] if any(t.doubt) else []),
    ]
    note = (
        f"± 95 %: half a 95 % interval, {_scatter(m)}. MPC: modal phase collinearity, 1 for a real shape;"
        " MPD: mean phase deviation, 0 for a real shape."
    )
    return Table(f"Modes, {m.name}", columns, note + (_DOUBTFUL if any(t.doubt) else ""))


def _scatter(m: AnalysedMeasurement) -> str:
    """Where the intervals of modes come from, and what was done to their damping or shapes."""
    found, decay = m.output_only, m.frf.window_decay_per_s
    if found is None:
        window = f"the damping is corrected for an exponential window of {number(decay)} 1/s"
        return (
            "from noise, with scatter over orders where the residual exceeds noise; a bias may be added"
            f" there; {window if decay else 'no exponential window was stated'}"
        )
    unscaled = ", because modal masses need a force" if found.scaling is None else ""
    return (
        f"from {found.blocks} blocks of the records, left out one by one; shapes are unscaled, their largest"
        f" component is 1{unscaled}"
    )


def error_table(result: ModesResult) -> Table:
    """Errors of the rebuilt FRFs of every measurement at a glance."""
    found = list(result.measurements.values())
    worst = [int(worst_first(m.frf)[0]) for m in found]
    at_worst = list(zip(found, worst, strict=True))
    relative, area, frac = (
        [float(np.nanmedian(getattr(m.frf, name))) for m in found]
        for name in ("relative_error", "area_error", "frac")
    )
    columns = [
        words("Measurement", [m.name for m in found]),
        Column(f"All {result.noun.several}", "%", [m.total_error for m in found], percent),
        Column(f"Median {result.noun.one}", "%", relative, percent),
        Column(f"Worst {result.noun.one}", "%", [m.frf.relative_error[k] for m, k in at_worst], percent),
        words("Which", [pair_name(m.frf, k) for m, k in at_worst]),
        Column("Median area error", "%", area, percent),
        Column("Median FRAC", "", frac),
    ]
    note = f"Measured minus rebuilt, RMS over RMS measured, on the analysed lines. {AREA} {FRAC}"
    return Table(f"Errors of the rebuilt {result.noun.several}", columns, note)


def setup_table(m: AnalysedMeasurement) -> Table | None:
    """Each mode without moved sensors beside what setups showed; None where all was measured at once."""
    s = m.setups
    if s is None:
        return None
    rows, known = range(len(s.frequency_hz)), np.isfinite(s.own_hz)
    low, high = np.nanargmin(s.own_hz, axis=1), np.nanargmax(s.own_hz, axis=1)
    off = np.where(known, np.abs(s.own_hz / s.expected_hz - 1), -np.inf)
    columns = [
        Column("Frequency", "Hz", s.frequency_hz, digits(6)),
        Column("Setups", "", [f"{own.sum()} of {len(own)}" for own in known], ready),
        Column("Lowest", "Hz", s.own_hz[rows, low], digits(6)),
        words("In", [s.setup[k] for k in low]),
        Column("Highest", "Hz", s.own_hz[rows, high], digits(6)),
        words("In", [s.setup[k] for k in high]),
        Column("Unexplained", "%", 100 * off.max(axis=1), digits(2)),
    ]
    said = "Frequency: without roving sensors. Unexplained: largest shift of a pole that their mass leaves."
    if np.isfinite(s.sensor_kg):
        std = SIGMAS_95 * s.sensor_std_kg
        said += f" Mass of a roving sensor: {number(1e3 * s.sensor_kg)} ± {number(1e3 * std, 1)} g (95 %)."
    if s.together:
        said = "The modes are those of all FRFs at once; frequency: by setups."
    return Table(f"Setups, {m.name}", columns, said)


def mass_table(m: AnalysedMeasurement) -> Table | None:
    """Modal masses of modes from responses alone; None where nothing was given to tell them by."""
    scaling = None if m.output_only is None else m.output_only.scaling
    if scaling is None:
        return None
    columns = [
        words("Mode", range(1, len(scaling.reason) + 1)),
        Column("Frequency", "Hz", m.modes.frequency_hz, digits(6)),
        Column(f"With {scaling.method}", "Hz", scaling.partner_hz, digits(6)),
        Column("Modal mass", "kg", scaling.modal_mass_kg),
        Column("± 95 %", "kg", SIGMAS_95 * scaling.modal_mass_std_kg, digits(2)),
        words("Why it is not known", scaling.reason),
    ]
    note = (
        "Of the shape whose largest component is 1; a shape over the square root of its modal mass is of unit"
        " modal mass. ± 95 %: half a 95 % interval."
    )
    return Table(f"Modal masses, {m.name}", columns, note)


def tone_table(m: AnalysedMeasurement) -> Table | None:
    """Tones that were taken out of records of responses; None where there are none."""
    if m.output_only is None or not len(m.output_only.tones.frequency_hz):
        return None
    t = m.output_only.tones
    multiples = zip(t.multiple, t.speed_hz, strict=True)
    columns = [
        Column("Frequency", "Hz", t.frequency_hz, digits(5)),
        Column("Width", "Hz", t.width_hz, digits(2)),
        Column("Kurtosis", "", t.kurtosis, digits(3)),
        Column("Power", "%", t.share, percent),
        words("Multiple of the stated speed", [f"{n} x {number(hz)} Hz" if n else "" for n, hz in multiples]),
    ]
    note = (
        "Kurtosis: of the complex amplitude, 1 for a tone, 2 for noise. Power: of all channels of unit RMS."
    )
    return Table(f"Tones, {m.name}", columns, note)


def rejected_table(m: AnalysedMeasurement) -> Table:
    """Candidates that are no modes, by frequency, and why."""
    r = m.rejected
    columns = [
        Column("Frequency", "Hz", r.frequency_hz),
        Column("Damping ratio", "%", r.damping_ratio, percent),
        Column("In orders", "%", 100 * r.presence, digits(3)),
        Column("MPC", "", r.mpc, digits(3)),
        Column("MPD", "°", r.mpd_deg, digits(3)),
        words("Why it is no mode", r.reason),
    ]
    return Table(f"Rejected candidates, {m.name}", columns)


def reciprocity_table(result: ModesResult) -> Table | None:
    """Channels that were measured both ways; None where there are none."""
    rows = [
        (m.name, f"{a} / {b}", f"{b} / {a}", *numbers)
        for m in result.measurements.values()
        for r in (m.reciprocity,)
        for a, b, *numbers in zip(r.a, r.b, r.level, r.error, r.frac, strict=True)
    ]
    heads = [words("Measurement"), words("H"), words("and")]
    heads += [Column("Level"), Column("Error", "%", form=percent), Column("FRAC")]
    note = (
        "Level: ratio of the two, 1 where the structure is linear and the channels are right; negative: a"
        " wrong sign."
    )
    return Table.of("Reciprocity", heads, rows, note) if rows else None
