"""The tables of a modal analysis, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.core.text import capital, count
from identify.core.thresholds import SIGMAS_95
from identify.reports.shared.measurement_tables import band, pair_name
from identify.reports.shared.pick import worst_first
from identify.reports.kit.cells import Column, Table, number, percent, words
from identify.results.modes import AnalysedMeasurement, ModesResult

DIAGRAM_NOTE = (
    "Poles of every model order over the complex mode indicator function (CMIF). Stable: in a cluster of"
    " poles that is present in enough orders. Dotted lines: the chosen modes. Framed or crossed out: clusters"
    " that were kept or dropped by hand, or that explain less than a mode must."
)


def tiles(result: ModesResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first: (what, value, what it means)."""
    found = list(result.measurements.values())
    collinear = np.concatenate([m.modes.mpc for m in found])
    several = f"in {count(len(found), 'measurement')}" if len(found) > 1 else "of the measured structure"
    errors = [m.total_error for m in found if len(m.modes.frequency_hz)]
    return (
        ("Modes", str(result.found), several),
        (
            f"Rebuilt {result.noun.several}",
            f"{percent(max(errors, default=np.nan))} %",
            f"off (RMS over all {result.noun.several}); 0 is perfect",
        ),
        (
            "Lowest MPC",
            number(collinear.min(initial=1.0) if len(collinear) else np.nan),
            "modal phase collinearity; 1: a real shape",
        ),
        ("Rejected", str(sum(len(m.rejected.reason) for m in found)), "candidates that are no modes"),
    )


def measurement_table(result: ModesResult) -> Table:
    """What was analysed; the decay of a window only where there was one."""
    windowed = any(m.frf.window_decay_per_s for m in result.measurements.values())
    columns = (
        words("Measurement"),
        words("Joint angles", "°"),
        words(capital(result.noun.several)),
        *([Column("Decay", "1/s")] if windowed else []),
        Column("Modes"),
        Column("Error", "%"),
    )
    rows = [
        (
            m.name,
            ", ".join(f"{angle:.1f}" for angle in m.posture_deg) or "not told",
            _analysed(m),
            *([number(m.frf.window_decay_per_s)] if windowed else []),
            str(len(m.modes.frequency_hz)),
            percent(m.total_error),
        )
        for m in result.measurements.values()
    ]
    references = dict.fromkeys(", ".join(m.modes.references) for m in result.measurements.values())
    note = (
        f"{'Decay: of the exponential window on force and response. ' if windowed else ''}"
        f"Error: of the {result.noun.several} rebuilt from the modes. References: {'; '.join(references)}."
    )
    return Table("Measurements", columns, tuple(rows), note)


def _analysed(m: AnalysedMeasurement) -> str:
    if m.output_only is None:
        return f"{count(len(m.frf.output), 'FRF')} ({m.frf.quantity}), {band(m.frf)}"
    return f"{len(m.frf.output)}, from {number(m.output_only.seconds)} s of responses, {band(m.frf)}"


def mode_table(m: AnalysedMeasurement) -> Table:
    """Frequencies and damping with their standard deviations, damping as the window showed it, and the
    quality of the shapes.
    """
    columns = (
        words("Mode"),
        Column("Frequency", "Hz"),
        Column("± 95 %", "Hz"),
        Column("Damping ratio", "%"),
        Column("± 95 %", "%"),
        *([Column("Seen through window", "%")] if m.frf.window_decay_per_s else []),
        Column("MPC"),
        Column("MPD", "°"),
        *([words("Doubtful")] if any(m.modes.doubt) else []),
    )
    t = m.modes
    rows = [
        (
            str(i + 1),
            number(t.frequency_hz[i], 6),
            number(SIGMAS_95 * t.frequency_std_hz[i], 2),
            percent(t.damping_ratio[i]),
            number(100 * SIGMAS_95 * t.damping_std[i], 2),
            *([percent(t.seen_damping_ratio[i])] if m.frf.window_decay_per_s else []),
            number(t.mpc[i]),
            number(t.mpd_deg[i], 3),
            *([t.doubt[i]] if any(t.doubt) else []),
        )
        for i in range(len(t.frequency_hz))
    ]
    decay = m.frf.window_decay_per_s
    window = (
        f"an exponential window of {number(decay)} 1/s was taken out of the damping"
        if decay
        else "no exponential window was told"
    )
    scatter = (
        "from noise, with scatter over orders where more than noise is left; there a bias may come on top;"
        f" {window}"
    )
    if m.output_only is not None:
        scatter = (
            f"from {m.output_only.blocks} blocks of the records, left out one by one; shapes are unscaled,"
            " their largest component is 1"
        )
        if m.output_only.scaling is None:
            scatter += ", for without a force there is no modal mass"
    note = (
        f"± 95 %: half a 95 % interval, {scatter}. MPC: modal phase collinearity, 1 for a real shape; MPD:"
        " mean phase deviation, 0 for a real shape."
    )
    if any(t.doubt):
        note += (
            " Doubtful: a frequency whose interval is wider than the resonance, a damping whose interval"
            " holds 0, a shape more complex than those of candidates may be."
        )
    return Table(f"Modes, {m.name}", columns, tuple(rows), note)


def error_table(result: ModesResult) -> Table:
    """Errors of the rebuilt FRFs of every measurement at a glance."""
    columns = (
        words("Measurement"),
        Column(f"All {result.noun.several}", "%"),
        Column(f"Median {result.noun.one}", "%"),
        Column(f"Worst {result.noun.one}", "%"),
        words("Which"),
        Column("Median area error", "%"),
        Column("Median FRAC"),
    )
    rows = []
    for m in result.measurements.values():
        worst = int(worst_first(m.frf)[0])
        medians = (
            float(np.nanmedian(values)) for values in (m.frf.relative_error, m.frf.area_error, m.frf.frac)
        )
        relative, area, correlation = medians
        of_worst = percent(m.frf.relative_error[worst]), pair_name(m.frf, worst)
        rows.append(
            (m.name, percent(m.total_error), percent(relative), *of_worst, percent(area), number(correlation))
        )
    note = (
        "Measured minus rebuilt, RMS over RMS measured, on the analysed lines. Area error: area between the"
        " magnitudes over the area below the measured one. FRAC: frequency response assurance criterion,"
        " blind to level."
    )
    return Table(f"Errors of the rebuilt {result.noun.several}", columns, tuple(rows), note)


def mass_table(m: AnalysedMeasurement) -> Table | None:
    """Modal masses of modes from responses alone; None where nothing was given to tell them by."""
    scaling = None if m.output_only is None else m.output_only.scaling
    if scaling is None:
        return None
    columns = (
        words("Mode"),
        Column("Frequency", "Hz"),
        Column(f"With {scaling.method}", "Hz"),
        Column("Modal mass", "kg"),
        Column("± 95 %", "kg"),
        words("Why it is not known"),
    )
    rows = [
        (
            str(r + 1),
            number(m.modes.frequency_hz[r], 6),
            number(scaling.partner_hz[r], 6),
            number(scaling.modal_mass_kg[r], 4),
            number(SIGMAS_95 * scaling.modal_mass_std_kg[r], 2),
            scaling.reason[r],
        )
        for r in range(len(scaling.reason))
    ]
    note = (
        "Of the shape whose largest component is 1; a shape over the square root of its modal mass is of unit"
        " modal mass. ± 95 %: half a 95 % interval."
    )
    return Table(f"Modal masses, {m.name}", columns, tuple(rows), note)


def tone_table(m: AnalysedMeasurement) -> Table | None:
    """Tones that were taken out of records of responses; None where there are none."""
    if m.output_only is None or not len(m.output_only.tones.frequency_hz):
        return None
    t = m.output_only.tones
    columns = (
        Column("Frequency", "Hz"),
        Column("Width", "Hz"),
        Column("Kurtosis"),
        Column("Power", "%"),
        words("Multiple of what was told"),
    )
    rows = [
        (
            number(t.frequency_hz[i], 5),
            number(t.width_hz[i], 2),
            number(t.kurtosis[i], 3),
            percent(t.share[i]),
            f"{t.multiple[i]} x {number(t.speed_hz[i])} Hz" if t.multiple[i] else "",
        )
        for i in range(len(t.frequency_hz))
    ]
    note = (
        "Kurtosis: of the complex amplitude, 1 for a tone, 2 for noise. Power: of all channels of unit RMS."
    )
    return Table(f"Tones, {m.name}", columns, tuple(rows), note)


def rejected_table(m: AnalysedMeasurement) -> Table:
    """Candidates that are no modes, by frequency, and why."""
    columns = (
        Column("Frequency", "Hz"),
        Column("Damping ratio", "%"),
        Column("In orders", "%"),
        Column("MPC"),
        Column("MPD", "°"),
        words("Why it is no mode"),
    )
    r = m.rejected
    rows = [
        (
            number(r.frequency_hz[i]),
            percent(r.damping_ratio[i]),
            number(100 * r.presence[i], 3),
            number(r.mpc[i], 3),
            number(r.mpd_deg[i], 3),
            r.reason[i],
        )
        for i in range(len(r.reason))
    ]
    return Table(f"Rejected candidates, {m.name}", columns, tuple(rows))


def reciprocity_table(result: ModesResult) -> Table | None:
    """Channels that were measured both ways; None where there are none."""
    columns = (
        words("Measurement"),
        words("H"),
        words("and"),
        Column("Level"),
        Column("Error", "%"),
        Column("FRAC"),
    )
    rows = []
    for m in result.measurements.values():
        r = m.reciprocity
        for i, (a, b) in enumerate(zip(r.a, r.b, strict=True)):
            rows.append(
                (
                    m.name,
                    f"{a} / {b}",
                    f"{b} / {a}",
                    number(r.level[i]),
                    percent(r.error[i]),
                    number(r.frac[i]),
                )
            )
    note = (
        "Level: ratio of the two, 1 where the structure is linear and the channels are right; negative: a"
        " wrong sign."
    )
    return Table("Reciprocity", columns, tuple(rows), note) if rows else None
