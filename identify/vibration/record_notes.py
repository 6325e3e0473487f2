"""Whether the records behind FRFs seem to begin before the impact, which a study has to say for a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import MATERIAL
from identify.model.effects.pre_trigger import PRE_TRIGGER, valleys
from identify.vibration.costs.target import FrfTarget
from identify.vibration.costs.targets import Targets
from identify.vibration.uncertainty import gap


def record_notes(targets: Targets, values: Array) -> list[str]:
    """A sentence where the gap falls once the records end that much sooner after the impact, all else at
    values (unknowns,) held.
    """
    known = {p.name for one in targets.frf for p in one.system.parameters}
    ended = any(one.record is not None for one in targets.frf)
    if not ended or PRE_TRIGGER in known or targets.simulated:
        return []
    times = valleys()
    gaps = [
        gap(replace(targets, frf=tuple(_sooner(one, early) for one in targets.frf)), values)
        for early in times
    ]
    best = int(np.argmin(gaps))
    if not gaps[0] - gaps[best] >= MATERIAL:  # nor where noise is not known
        return []
    return [
        f"the gap would be {gaps[best]:.3g} instead of {gaps[0]:.3g} if the records began"
        f" {1e3 * times[best]:.0f} ms before the impacts, as with a pre-trigger: add"
        " `- {kind: pre-trigger}` to the effects to have the time fitted along"
    ]


def _sooner(target: FrfTarget, early: float) -> FrfTarget:
    return target if target.record is None else replace(target, record=target.record - early)
