"""Where a fitted robot stands, as a command says it."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.results.fit import FitResult
from identify.vibration.fitted_model import FittedModel


def posture_of(text: str | None, fit: FitResult, model: FittedModel) -> Array:
    """(joints,), rad, from angles in degrees, or the name of a measurement; default: that of the first.

    InputError for other texts.
    """
    names = list(fit.measurements)
    if text is None or text in names:
        return np.asarray(np.deg2rad(fit.measurements[text or names[0]].posture_deg))
    joints = len(model.robot.joints)
    try:
        angles = np.array([float(part) for part in text.split(",")])
    except ValueError:
        angles = np.array([])
    if angles.shape != (joints,) or not np.isfinite(angles).all():
        expected = f"{joints} angles in degrees such as 0,30,-60,0,45,0, or one of {', '.join(names)}"
        raise InputError("--posture", repr(text), expected)
    return np.asarray(np.deg2rad(angles))
