"""The tables of measurements: modes, postures, FRF errors.

How well a model does at the measured modes: frequency, damping and magnitude (fast chirp, Table I), and
the amplitude of each link (Kobe, section 4.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from identify.core.arrays import Array
from identify.core.text import capital, count
from identify.reports.kit.cells import Column, Table, angles, number, percent, ready, signed, words
from identify.reports.shared.pick import is_drive_point, mac_of, partner, shown_modes, worst_first
from identify.results.fit import FitResult, FrfComparison, MeasurementResult, ModePairs

MODES_TERMINAL = (
    "Mode",
    "Frequency",
    "Damping ratio",
    "Model",
    "Measured",
    "Error",
    "Model damping",
    "Measured damping",
    "MAC",
)
"""The columns of the table of modes that a terminal has room for."""
DIFFERENCE = partial(signed, digits=3)
"""How differences of frequency and damping are written, per cent."""
FRAC = "FRAC: frequency response assurance criterion, blind to level."
AREA = "Area error: area between the magnitudes over the area below the measured one."


def mode_table(m: MeasurementResult) -> Table:
    """Modes of the model, beside the measured ones where there are any, by frequency."""
    shown, total = shown_modes(m), len(m.modes.frequency_hz)
    more = f"{count(total - shown, 'higher mode')} of the model are in the result file only."
    title, note = f"Modes, {m.name}", "" if shown == total else more
    if m.pairs is None:
        columns = [
            words("Mode", range(1, shown + 1)),
            Column("Frequency", "Hz", m.modes.frequency_hz[:shown]),
            Column("Damping ratio", "%", m.modes.damping_ratio[:shown], percent),
        ]
        return Table(title, columns, note)
    heads = [
        words("Mode"),
        Column("Model", "Hz"),
        Column("Measured", "Hz"),
        Column("Error", "%", form=DIFFERENCE),
        Column("Model damping", "%", form=percent),
        Column("Measured damping", "%", form=percent),
        Column("Difference", "points", form=DIFFERENCE),
        Column("MAC"),
    ]
    about = f"Measured: {m.pairs.origin}. Errors are model minus measured; damping in points of per cent."
    return Table.of(title, heads, _paired_modes(m, m.pairs, shown), f"{about} {note}".strip())


def _paired_modes(m: MeasurementResult, pairs: ModePairs, shown: int) -> list[tuple[str | float, ...]]:
    """The modes of the model with their partners, and measured ones without any, by frequency."""
    keyed = []
    for row in range(shown):
        mode, own, ratio = partner(pairs, row), m.modes.frequency_hz[row], m.modes.damping_ratio[row]
        hz = np.nan if mode is None else pairs.measured_frequency_hz[mode]
        measured = np.nan if mode is None else pairs.measured_damping_ratio[mode]
        errors = 100 * (own / hz - 1), ratio, measured, 100 * (ratio - measured), mac_of(pairs, row)
        keyed.append((own, (str(row + 1), own, hz, *errors)))
    for mode in np.setdiff1d(np.arange(len(pairs.measured_frequency_hz)), pairs.measured):
        hz, ratio = pairs.measured_frequency_hz[mode], pairs.measured_damping_ratio[mode]
        keyed.append((hz, ("no pair", np.nan, hz, np.nan, np.nan, ratio, np.nan, np.nan)))
    return [row for _, row in sorted(keyed, key=lambda one: one[0])]


def measurement_table(result: FitResult) -> Table:
    """What was measured: file, use, posture."""
    found = list(result.measurements.values())
    columns = [
        words("Measurement", [m.name for m in found]),
        words("Use", map(use, found)),
        words("Joint angles", [angles(m.posture_deg, ".1f") for m in found], "°"),
        words("Data", map(_data, found)),
        Column("Gap", "", [m.gap for m in found]),
    ]
    return Table("Postures and measurements", columns)


def use(measurement: MeasurementResult) -> str:
    """Whether a measurement was fitted."""
    return {"fit": "fitted", "validate": "validation only"}.get(measurement.use, measurement.use)


def _data(measurement: MeasurementResult) -> str:
    frf = measurement.frf
    if frf is None:
        modes = 0 if measurement.pairs is None else len(measurement.pairs.measured_frequency_hz)
        return count(modes, "measured mode")
    sigma = frf.window_decay_per_s
    window = f", window decaying by {number(sigma)} 1/s" if sigma else ""
    return f"{count(len(frf.output), 'FRF')} ({frf.quantity}), {band(frf)}{window}"


def band(frf: FrfComparison) -> str:
    """Lines and band of an FRF set."""
    low, high = number(frf.frequency_hz[0]), number(frf.frequency_hz[-1])
    return f"{count(len(frf.frequency_hz), 'line')} from {low} to {high} Hz"


def error_table(result: FitResult) -> Table:
    """FRF errors of every measurement at a glance."""
    found = [(m, m.frf) for m in result.measurements.values() if m.frf is not None]
    gaps = [np.full(1, np.nan) if frf.gap is None else frf.gap for _, frf in found]
    columns = [
        words("Measurement", [m.name for m, _ in found]),
        words("Use", [use(m) for m, _ in found]),
        Column("Gap", "", [m.gap for m, _ in found]),
        Column("Median gap", "", map(_median, gaps)),
        Column("Worst gap", "", map(np.max, gaps)),
        words("Worst FRF", [pair_name(frf, int(worst_first(frf)[0])) for _, frf in found]),
        Column("Median relative error", "%", [_median(frf.relative_error) for _, frf in found], percent),
        Column("Median area error", "%", [_median(frf.area_error) for _, frf in found], percent),
        Column("Median FRAC", "", [_median(frf.frac) for _, frf in found]),
    ]
    note = f"Gap: RMS residual over noise. Relative error: RMS difference over RMS measured. {AREA} {FRAC}"
    return Table("FRF errors", columns, note)


def frf_table(name: str, frf: FrfComparison, at_modes: Array | None = None) -> Table:
    """Every FRF of the measurement of that name, worst first; with the gap where the noise is known.

    at_modes (pairs,): errors of the magnitudes at the measured modes, NaN where there are none.
    """
    order = worst_first(frf)
    columns = [
        words("Output", [frf.output[i] for i in order]),
        words("Input", [frf.input[i] for i in order]),
        *([] if frf.gap is None else [Column("Gap", "", frf.gap[order])]),
        Column("Relative error", "%", frf.relative_error[order], percent),
        Column("Area error", "%", frf.area_error[order], percent),
        *(
            [Column("Magnitude error at modes", "%", at_modes[order], percent)]
            if at_modes is not None and np.isfinite(at_modes).any()
            else []
        ),
        Column("FRAC", "", frf.frac[order]),
        words("Remark", [_remark(frf, int(i)) for i in order]),
    ]
    return Table(f"{capital(frf.noun.one)} errors, {name}, {frf.quantity}, {band(frf)}", columns)


def pair_errors(frf: FrfComparison, pair: int) -> str:
    """The errors of one FRF in a line."""
    parts = [] if frf.gap is None else [f"gap {number(frf.gap[pair])}"]
    parts += [f"relative error {percent(frf.relative_error[pair])} %", _remark(frf, pair)]
    return ", ".join(filter(None, parts))


def _remark(frf: FrfComparison, pair: int) -> str:
    if not frf.moved[pair]:
        return "the model does not move here"
    return "drive point" if is_drive_point(frf, pair) and frf.noun.one == "FRF" else ""


def pair_name(frf: FrfComparison, pair: int) -> str:
    """Output and input of one FRF."""
    return f"{frf.output[pair]} / {frf.input[pair]}"


def _median(values: Array) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else float("nan")


NEAR = 0.05
"""Of a measured mode's frequency, within which a model's peak is its own."""


def mode_error_table(measurements: Sequence[MeasurementResult]) -> Table | None:
    """A row per measurement with modes: mean errors over its paired modes, and of magnitudes over all."""
    rows = [_row(m) for m in measurements if m.pairs is not None and len(m.pairs.measured)]
    if not rows:
        return None
    heads = [
        words("Measurement"),
        Column("Paired modes", form=ready),
        Column("Frequency error", "%", form=percent),
        Column("Damping error", "%", form=percent),
        Column("Magnitude error", "%", form=percent),
    ]
    note = (
        "Means of absolute errors, model over measured. Magnitude: of the highest line within"
        f" {100 * NEAR:g} % of each measured mode, over modes and FRFs that the model moves."
    )
    return Table.of("Errors at the measured modes", heads, rows, note)


def _row(m: MeasurementResult) -> tuple[str | float, ...]:
    assert m.pairs is not None
    p = m.pairs
    own = m.modes.frequency_hz[p.model] / p.measured_frequency_hz[p.measured] - 1
    damping = m.modes.damping_ratio[p.model] / p.measured_damping_ratio[p.measured] - 1
    ratios = magnitude_ratios(m, m.frf) if m.frf is not None else np.full((1, 1), np.nan)
    size = _mean(np.abs(ratios - 1).ravel())
    return m.name, str(len(p.measured)), _mean(np.abs(own)), _mean(np.abs(damping)), size


def amplitude_tables(measurements: Sequence[MeasurementResult]) -> list[Table]:
    """A table per measurement at points of several links: amplitude of the model over the measured one at
    each measured mode, by link, where a mode is within the band.
    """
    return [table for m in measurements if m.frf is not None for table in _amplitudes(m, m.frf)]


def _amplitudes(m: MeasurementResult, frf: FrfComparison) -> list[Table]:
    of = dict(zip(map(str, m.geometry.nodes), m.geometry.point_links, strict=True))
    own = np.array([of.get(output.split(":")[0], "") for output in frf.output])
    modes, (model, measured) = _modes(m, frf), _heights(m, frf)
    links = [link for link in dict.fromkeys(m.geometry.point_links) if link in own[frf.moved]]
    if len(links) < 2 or not len(modes):
        return []
    of_link = [frf.moved & (own == link) for link in links]
    ratios = [model[:, some].mean(axis=1) / measured[:, some].mean(axis=1) for some in of_link]
    columns = [
        Column("Measured mode", "Hz", modes),
        *(
            Column(link, "", [f"{r:.2f}" for r in row], ready)
            for link, row in zip(links, ratios, strict=True)
        ),
    ]
    note = "Mean over the measured directions of each link's points; 1 is perfect."
    return [Table(f"Amplitude of the model over the measured one, {m.name}", columns, note)]


def magnitude_ratios(m: MeasurementResult, frf: FrfComparison) -> Array:
    """(modes, pairs): height of the model over the measured one at the measured modes within the band, NaN
    where the model does not move.
    """
    model, measured = _heights(m, frf)
    return np.where(frf.moved, model / measured, np.nan)


def magnitude_errors(m: MeasurementResult, frf: FrfComparison) -> Array:
    """Mean error of the magnitude of each FRF (pairs,) over the measured modes, NaN where there is none."""
    ratios = magnitude_ratios(m, frf)
    return np.abs(ratios - 1).mean(axis=0) if len(ratios) else np.full(len(frf.output), np.nan)


def _heights(m: MeasurementResult, frf: FrfComparison) -> tuple[Array, Array]:
    """(modes, pairs): highest lines of model and measured FRFs near each measured mode."""
    modes = _modes(m, frf)
    model, measured = np.empty((2, len(modes), len(frf.output)))
    for n, mode in enumerate(modes):
        away = np.abs(frf.frequency_hz / mode - 1)
        near = away <= max(NEAR, away.min())  # at least the nearest line
        model[n], measured[n] = (np.abs(h[near]).max(axis=0) for h in (frf.fitted, frf.measured))
    return model, measured


def _modes(m: MeasurementResult, frf: FrfComparison) -> Array:
    """Frequencies of measured modes within the band of the FRFs, Hz."""
    known = m.pairs.measured_frequency_hz if m.pairs is not None else np.zeros(0)
    return np.asarray(known[(known >= frf.frequency_hz[0]) & (known <= frf.frequency_hz[-1])])


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")
