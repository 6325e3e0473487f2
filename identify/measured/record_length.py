"""How long the records behind FRFs were, as far as a file, the user and the lines say.

Lines of a spectrum are multiples of one over the record's length T, but not all of them need have been
exported. So T is a multiple of one over their spacing: the least by which every line is a multiple of 1 / T,
or some multiple of that where every second or third line of those was left out, which only the likelihood of
a model can tell (`identify.vibration.records`).
"""

from __future__ import annotations

import numpy as np

from identify.measured.frf_set import FrfSet

_MOST = 6
"""Largest multiple that is looked for: lines that fit none were not those of a plain spectrum."""
_OFF = 0.003
"""Part of a line's spacing by which it may be off a multiple, as of frequencies with few digits."""


def shortest_record(data: FrfSet) -> float | None:
    """The shortest length, s, of records that have all lines of a set; None of a single line."""
    frequency = data.frequency_hz
    if len(frequency) < 2:
        return None
    spacing = float(np.median(np.diff(frequency)))
    if np.ptp(np.diff(frequency)) > _OFF * spacing:
        spacing = float(np.diff(frequency).min())
    else:
        spacing = float(frequency[-1] - frequency[0]) / (len(frequency) - 1)
    for times in range(1, _MOST + 1):
        lines = frequency * times / spacing
        if np.all(np.abs(lines - np.round(lines)) <= _OFF * times):
            return times / spacing
    return 1 / spacing


def record_length(data: FrfSet) -> float | None:
    """The length, s, of records of impacts whose end FRFs show: as stated, else the shortest where an
    exponential window says that there were impacts; else None.
    """
    if data.record_s is not None or data.window_decay_per_s <= 0:
        return data.record_s
    return shortest_record(data)
