"""Channels that are left out of a fit because they cannot have been connected: they have nothing but noise
where the model moves.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.measured.frf_set import FrfSet
from identify.measured.silent import noise_alone, without
from identify.vibration.costs.target import FrfTarget

_BEYOND = 2.0
"""RMS that the model has at its start values, over that of noise alone, from which a channel counts as dead:
as much would be seen in a few lines, and start values are only about right."""


def without_noise(target: FrfTarget, values: Array) -> FrfSet:
    """The data without channels of noise alone that the model moves at values (parameters,); those that it
    hardly moves say that they stand still, and stay.
    """
    data = target.data
    outputs, inputs = noise_alone(data)
    if not outputs and not inputs:
        return data
    model, seen = (np.where(data.measured, np.abs(h) ** 2, 0.0) for h in (target.predict(values), data.frf))
    gone_outputs, gone_inputs = (
        [c for n, c in enumerate(channels) if c in some and _moved(model, seen, axis)[n]]
        for axis, channels, some in ((1, data.outputs, outputs), (2, data.inputs, inputs))
    )
    reason = "is nothing but noise although the model moves there, like a sensor that is not connected"
    return without(data, gone_outputs, gone_inputs, reason)


def _moved(model: Array, seen: Array, axis: int) -> Array:
    """Which channels the model moves by far more than they show, of squares (lines, outputs, inputs)."""
    over = (0, 3 - axis)
    return np.asarray(model.sum(axis=over) > _BEYOND**2 * seen.sum(axis=over))
