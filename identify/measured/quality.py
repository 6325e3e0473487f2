"""`check` looks at an FRF set before a fit and says what an engineer would say; the single checks are beside this file."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from identify.measured import quality_channels as channels
from identify.measured import quality_physics as physics
from identify.measured.finding import Finding
from identify.measured.frf_set import FrfSet

_ORDER = {"fail": 0, "warn": 1, "info": 2}


def check(frf_set: FrfSet, points: Mapping[int, str], band_hz: tuple[float, float] | None = None) -> list[Finding]:
    """What is wrong (fail), doubtful (warn) or worth knowing (info) about a set, in this order.

    points maps node numbers to names of points on the robot; band_hz (Hz) limits what is looked at.  Bad data make findings, not errors.
    """
    chosen = frf_set if band_hz is None else frf_set.band(*band_hz)
    if len(chosen.frequency_hz) == 0:
        low, high = band_hz or (0.0, 0.0)
        span = f"{frf_set.frequency_hz[0]:.4g} to {frf_set.frequency_hz[-1]:.4g} Hz" if len(frf_set.frequency_hz) else "no line at all"
        sentence = f"No line lies in the band from {low:.4g} to {high:.4g} Hz: the data have {span}."
        return [Finding("fail", "no-data-in-band", (), sentence, 0)]
    findings = [*channels.points_explain(chosen, points), *channels.frequency_axis(chosen), *channels.pairs_complete(chosen)]
    if chosen.measured.any():
        usable = _measured_only(chosen)
        for one in (channels.doubled, channels.dead, physics.coherence, physics.drive_points, physics.reciprocity, physics.size):
            findings.extend(one(usable))
    else:
        findings.append(Finding("fail", "no-data", (), "No FRF has a number at every line of the band.", 0))
    return sorted(findings, key=lambda finding: _ORDER[finding.level])


def _measured_only(frf_set: FrfSet) -> FrfSet:
    """The set without outputs and inputs of which no FRF is whole; those have findings of their own."""
    measured = frf_set.measured
    return frf_set.pairs(np.flatnonzero(measured.any(axis=1)).tolist(), np.flatnonzero(measured.any(axis=0)).tolist())
