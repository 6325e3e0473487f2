"""Whether the records behind FRFs seem to begin before the impact, which a study has to say for a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.model.effects.pre_trigger import PRE_TRIGGER
from identify.vibration.costs.target import FrfTarget

_EARLIER_S = np.arange(0.0, 0.101, 0.004)
_MATERIAL = 0.015
"""A smaller fall of the gap is within what estimators and noise models get wrong."""


def record_notes(targets: Sequence[FrfTarget], values: Array) -> list[str]:
    """A sentence where the gap falls once the records end that much sooner after the impact, all else at
    parameter values (parameters,) held.
    """
    ended = [one for one in targets if one.record is not None and one.noise is not None]
    known = {p.name for one in ended for p in one.system.parameters}
    if not ended or PRE_TRIGGER in known or any(one.simulated is not None for one in ended):
        return []
    gaps = [_gap(ended, values, early) for early in _EARLIER_S]
    best = int(np.argmin(gaps))
    if gaps[0] - gaps[best] < _MATERIAL:
        return []
    return [
        f"the gap would be {gaps[best]:.3g} instead of {gaps[0]:.3g} if the records began"
        f" {1e3 * _EARLIER_S[best]:.0f} ms before the impacts, as with a pre-trigger: add"
        " `- {kind: pre-trigger}` to the effects to have the time fitted along"
    ]


def _gap(targets: Sequence[FrfTarget], values: Array, early: float) -> float:
    squares = count = 0.0
    for one in targets:
        assert one.record is not None
        sooner = replace(one, record=one.record - early)
        off = np.abs((sooner.predict_pairs(values) - one.measured) / one.sigma) ** 2
        squares, count = squares + float(off.sum()), count + 2 * off.size
    return float(np.sqrt(squares / count))
