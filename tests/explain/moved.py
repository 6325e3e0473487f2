"""Records for tests of the regression alone: one joint on a known path, without a robot."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from identify.explain.recorded_motion import RecordedMotion
from identify.explain.regression import Datum, RegressionProblem
from identify.robot.inverse_dynamics import RigidArm

Array = NDArray[np.float64]
RATE, RATIO = 125.0, 120.0


def moved(seconds: float = 12.0, relative: bool = False) -> RecordedMotion:
    """One joint to and fro over more than a turn, with a load that follows its angle."""
    time = np.arange(int(seconds * RATE)) / RATE
    w, a = 2 * np.pi * np.array([0.25, 0.4]), np.array([1.9, 1.7])
    angle = np.sin(np.outer(time, w)) @ a
    speed, acceleration = np.cos(np.outer(time, w)) @ (a * w), -np.sin(np.outer(time, w)) @ (a * w**2)
    load = 900 * np.cos(angle)
    history = [one[:, None] for one in (angle, speed, acceleration, load)]
    no_arm = cast(RigidArm, None)
    ratio, payload = np.array([RATIO]), ("link1", (0.0, 0.0, 0.0))
    return RecordedMotion(
        time, *history, history[3] / RATIO, None, no_arm, (1,), ratio, 0.01, relative, payload
    )


def problem(scene: RecordedMotion, history: Array, datum: Datum = "none") -> RegressionProblem:
    """The history (samples,) of the joint as what is to be explained, all samples counting."""
    return RegressionProblem("made", scene, history[:, None], np.ones((len(history), 1), dtype=bool), datum)
