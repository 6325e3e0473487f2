"""`check` looks at an FRF set before a fit and says what an engineer would say; the single checks are beside
this file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.measured import quality_channels as channels
from identify.measured import quality_noise as noise
from identify.measured import quality_physics as physics
from identify.measured.finding import Finding, worst_first
from identify.measured.frf_set import FrfSet


def check(
    frf_set: FrfSet, points: Mapping[int, str], band_hz: tuple[float, float] | None = None
) -> list[Finding]:
    """What is wrong (fail), doubtful (warn) or worth knowing (info) about a set, in this order.

    points maps node numbers to names of points on the robot; band_hz (Hz) limits what is looked at.  Bad data
    make findings, not errors.
    """
    chosen = frf_set if band_hz is None else frf_set.band(*band_hz)
    if len(chosen.frequency_hz) == 0:
        low, high = band_hz or (0.0, 0.0)
        span = (
            f"{frf_set.frequency_hz[0]:.4g} to {frf_set.frequency_hz[-1]:.4g} Hz"
            if len(frf_set.frequency_hz)
            else "no line at all"
        )
        sentence = f"No line lies in the band from {low:.4g} to {high:.4g} Hz: the data have {span}."
        return [Finding("fail", "no-data-in-band", (), sentence, 0)]
    findings = [
        *(Finding("warn", "not-read", (), f"In the file, {note}.") for note in frf_set.notes),
        *channels.points_explain(chosen, points),
        *channels.frequency_axis(chosen),
        *channels.pairs_complete(chosen),
    ]
    usable = _whole(chosen)
    if usable.measured.any():
        for one in (
            channels.doubled,
            channels.dead,
            noise.coherence,
            noise.noisy_channels,
            noise.poor_forces,
            noise.quiet_channels,
            physics.drive_points,
            physics.reciprocity,
            physics.size,
        ):
            findings.extend(one(usable))
    else:
        findings.append(Finding("fail", "no-data", (), "No FRF has a number at every line of the band.", 0))
    return worst_first(findings)


def _whole(frf_set: FrfSet) -> FrfSet:
    """The FRFs that are numbers at every line, with the outputs and inputs that have any; the others have
    findings of their own.
    """
    broken: NDArray[np.bool_] = np.asarray(np.isnan(frf_set.frf).any(axis=0))
    whole = replace(frf_set, frf=np.where(broken, np.nan, frf_set.frf))
    return whole.pairs(
        np.flatnonzero(~broken.all(axis=1)).tolist(), np.flatnonzero(~broken.all(axis=0)).tolist()
    )
