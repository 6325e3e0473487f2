"""The modes of a measurement in several setups: what each showed, and what moved sensors explain."""

from __future__ import annotations

import numpy as np

from identify.core.thresholds import SIGMAS_95
from identify.reports.kit.cells import Column, Table, number, words
from identify.results.modes import AnalysedMeasurement


def setup_table(m: AnalysedMeasurement) -> Table | None:
    """Each mode without moved sensors beside what setups showed; None where all was measured at once."""
    s = m.setups
    if s is None:
        return None
    columns = (
        Column("Frequency", "Hz"),
        Column("Setups"),
        Column("Lowest", "Hz"),
        words("In"),
        Column("Highest", "Hz"),
        words("In"),
        Column("Unexplained", "%"),
    )
    rows = []
    for r, hz in enumerate(s.frequency_hz):
        known = np.isfinite(s.own_hz[r])
        low, high = int(np.nanargmin(s.own_hz[r])), int(np.nanargmax(s.own_hz[r]))
        off = np.abs(s.own_hz[r] / s.expected_hz[r] - 1)[known]
        ends = [cell for k in (low, high) for cell in (number(s.own_hz[r, k], 6), s.setup[k])]
        left = number(100 * float(np.max(off)), 2)
        rows.append((number(hz, 6), f"{known.sum()} of {len(known)}", *ends, left))
    if s.together:
        said = "The modes are those of all FRFs at once; frequency: by setups."
    else:
        said = "Frequency: without moved sensors. Unexplained: what their mass leaves of a pole, at most."
        if np.isfinite(s.sensor_kg):
            std = SIGMAS_95 * s.sensor_std_kg
            said += f" Mass of a moved sensor: {number(1e3 * s.sensor_kg)} ± {number(1e3 * std, 1)} g (95 %)."
    return Table(f"Setups, {m.name}", columns, tuple(rows), said)
