"""The tables of measurements, as finished text: modes, postures, FRF errors; HTML and PDF print the same
ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.core.text import capital, count
from identify.reports.fit.pick import is_drive_point, mac_of, partner, shown_modes, worst_first
from identify.reports.kit.cells import NONE, Column, Table, number, percent, signed, words
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


def mode_table(measurement: MeasurementResult) -> Table:
    """Modes of the model, beside the measured ones where there are any, by frequency."""
    shown, total = shown_modes(measurement), len(measurement.modes.frequency_hz)
    note = (
        ""
        if shown == total
        else f"{count(total - shown, 'higher mode')} of the model are in the result file only."
    )
    title = f"Modes, {measurement.name}"
    if measurement.pairs is None:
        rows = [(str(i + 1), *_model_mode(measurement, i)) for i in range(shown)]
        return Table(
            title, (words("Mode"), Column("Frequency", "Hz"), Column("Damping ratio", "%")), tuple(rows), note
        )
    pairs = measurement.pairs
    columns = (
        words("Mode"),
        Column("Model", "Hz"),
        Column("Measured", "Hz"),
        Column("Error", "%"),
        Column("Model damping", "%"),
        Column("Measured damping", "%"),
        Column("Difference", "points"),
        Column("MAC"),
    )
    keyed = [(measurement.modes.frequency_hz[i], _pair_row(measurement, pairs, i)) for i in range(shown)]
    alone = np.setdiff1d(np.arange(len(pairs.measured_frequency_hz)), pairs.measured)
    keyed += [(pairs.measured_frequency_hz[i], _unpaired_row(pairs, int(i))) for i in alone]
    about = f"Measured: {pairs.origin}. Errors are model minus measured; damping in points of per cent."
    note = f"{about} {note}".strip()
    return Table(title, columns, tuple(row for _, row in sorted(keyed)), note)


def _model_mode(measurement: MeasurementResult, row: int) -> tuple[str, str]:
    return number(measurement.modes.frequency_hz[row]), percent(measurement.modes.damping_ratio[row])


def _pair_row(measurement: MeasurementResult, pairs: ModePairs, row: int) -> tuple[str, ...]:
    frequency, damping = _model_mode(measurement, row)
    mode = partner(pairs, row)
    if mode is None:
        return str(row + 1), frequency, NONE, NONE, damping, NONE, NONE, NONE
    hz, ratio = pairs.measured_frequency_hz[mode], pairs.measured_damping_ratio[mode]
    error = signed(100 * (measurement.modes.frequency_hz[row] / hz - 1), 3)
    points = signed(100 * (measurement.modes.damping_ratio[row] - ratio), 3)
    return (
        str(row + 1),
        frequency,
        number(hz),
        error,
        damping,
        percent(ratio),
        points,
        number(mac_of(pairs, row)),
    )


def _unpaired_row(pairs: ModePairs, mode: int) -> tuple[str, ...]:
    hz, ratio = pairs.measured_frequency_hz[mode], pairs.measured_damping_ratio[mode]
    return "no pair", NONE, number(hz), NONE, NONE, percent(ratio), NONE, NONE


def measurement_table(result: FitResult) -> Table:
    """What was measured: file, use, posture."""
    columns = (words("Measurement"), words("Use"), words("Joint angles", "°"), words("Data"), Column("Gap"))
    rows = [
        (m.name, use(m), ", ".join(f"{angle:.1f}" for angle in m.posture_deg), _data(m), number(m.gap))
        for m in result.measurements.values()
    ]
    return Table("Postures and measurements", columns, tuple(rows))


def use(measurement: MeasurementResult) -> str:
    """Whether a measurement was fitted."""
    return {"fit": "fitted", "validate": "validation only"}.get(measurement.use, measurement.use)


def _data(measurement: MeasurementResult) -> str:
    frf = measurement.frf
    if frf is None:
        modes = 0 if measurement.pairs is None else len(measurement.pairs.measured_frequency_hz)
        return count(modes, "measured mode")
    return f"{count(len(frf.output), 'FRF')} ({frf.quantity}), {band(frf)}"


def band(frf: FrfComparison) -> str:
    """Lines and band of an FRF set."""
    return (
        f"{count(len(frf.frequency_hz), 'line')} from {number(frf.frequency_hz[0])} to"
        f" {number(frf.frequency_hz[-1])} Hz"
    )


def error_table(result: FitResult) -> Table:
    """FRF errors of every measurement at a glance."""
    columns = (
        words("Measurement"),
        words("Use"),
        Column("Gap"),
        Column("Median gap"),
        Column("Worst gap"),
        words("Worst FRF"),
        Column("Median relative error", "%"),
        Column("Median area error", "%"),
        Column("Median FRAC"),
    )
    rows = []
    for m in result.measurements.values():
        if m.frf is None:
            continue
        gaps = np.full(1, np.nan) if m.frf.gap is None else m.frf.gap
        medians = (
            percent(_median(m.frf.relative_error)),
            percent(_median(m.frf.area_error)),
            number(_median(m.frf.frac)),
        )
        worst = pair_name(m.frf, int(worst_first(m.frf)[0]))
        rows.append(
            (m.name, use(m), number(m.gap), number(_median(gaps)), number(np.max(gaps)), worst, *medians)
        )
    note = (
        "Gap: RMS residual over noise. Relative error: RMS difference over RMS measured. Area error: area"
        " between the magnitudes over the area below the measured one. FRAC: frequency response assurance"
        " criterion, blind to level."
    )
    return Table("FRF errors", columns, tuple(rows), note)


def frf_table(name: str, frf: FrfComparison) -> Table:
    """Every FRF of the measurement of that name, worst first; with the gap where the noise is known."""
    gap_column = () if frf.gap is None else (Column("Gap"),)
    columns = (
        words("Output"),
        words("Input"),
        *gap_column,
        Column("Relative error", "%"),
        Column("Area error", "%"),
        Column("FRAC"),
        words("Remark"),
    )
    rows = [
        (
            frf.output[i],
            frf.input[i],
            *(() if frf.gap is None else (number(frf.gap[i]),)),
            percent(frf.relative_error[i]),
            percent(frf.area_error[i]),
            number(frf.frac[i]),
            _remark(frf, int(i)),
        )
        for i in worst_first(frf)
    ]
    return Table(
        f"{capital(frf.noun.one)} errors, {name}, {frf.quantity}, {band(frf)}",
        columns,
        tuple(rows),
    )


def pair_errors(frf: FrfComparison, pair: int) -> str:
    """The errors of one FRF in a line."""
    parts = [] if frf.gap is None else [f"gap {number(frf.gap[pair])}"]
    parts += [f"relative error {percent(frf.relative_error[pair])} %", _remark(frf, pair)]
    return ", ".join(filter(None, parts))


def _remark(frf: FrfComparison, pair: int) -> str:
    if not np.any(frf.fitted[:, pair]):
        return "the model does not move here"
    return "drive point" if is_drive_point(frf, pair) and frf.noun.one == "FRF" else ""


def pair_name(frf: FrfComparison, pair: int) -> str:
    """Output and input of one FRF."""
    return f"{frf.output[pair]} / {frf.input[pair]}"


def _median(values: NDArray[np.float64]) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else float("nan")
