"""How well a model does at the measured modes: frequency, damping and magnitude (fast chirp, Table I), and
the amplitude of each link (Kobe, section 4.2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit.cells import Column, Table, percent, ready, words
from identify.results.fit import FrfComparison, MeasurementResult

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
