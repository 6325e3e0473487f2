"""Where a joint moves at constant velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.correlated import effective_samples
from identify.measured.conditioning import ConditionedMotion


@dataclass(frozen=True)
class Phase:
    """One stretch of constant velocity (rad/s): angle (n,) rad, torque (n,) N m."""

    velocity: float
    angle: Array
    torque: Array

    def mean(self, lower: float, upper: float) -> tuple[float, float]:
        """Mean torque between two angles, and its standard deviation from what scatters about a parabola over
        the angle; NaN for few.
        """
        inside = (self.angle >= lower) & (self.angle <= upper)
        if inside.sum() < 8:
            return float("nan"), float("nan")
        angle, torque = self.angle[inside], self.torque[inside]
        parabola = np.polynomial.Polynomial.fit(angle, torque, 2)
        left = torque - parabola(angle)
        whole = parabola.integ()
        mean = (whole(upper) - whole(lower)) / (upper - lower)
        return float(mean), float(
            np.std(left) / np.sqrt(effective_samples(left, np.ones(len(left), dtype=bool)))
        )


def steady(motion: ConditionedMotion, joint: int, slow: float, tolerance: float, least_s: float) -> Mask:
    """Samples (samples,) about which the mean velocities over `least_s` before and after are above `slow` and
    alike within `tolerance`.
    """
    angle, half = motion.position[:, joint], max(1, round(least_s * motion.sample_rate_hz))
    found = np.zeros(len(angle), dtype=bool)
    if len(angle) > 2 * half:
        before, after = (angle[half:-half] - angle[: -2 * half]), (angle[2 * half :] - angle[half:-half])
        mean = np.abs(before + after) / 2
        found[half:-half] = (mean > slow * least_s) & (np.abs(after - before) < tolerance * mean)
    return found & motion.inside


def constant_phases(
    motion: ConditionedMotion, joint: int, slow: float, tolerance: float, least_s: float, settle_s: float
) -> list[Phase]:
    """Stretches of at least `least_s` with a steady velocity, without their first `settle_s`, in which the
    arm still swings.
    """
    edges = np.flatnonzero(
        np.diff(np.concatenate([[0], steady(motion, joint, slow, tolerance, least_s).astype(int), [0]]))
    )
    found, settled = [], round(settle_s * motion.sample_rate_hz)
    for start, last in edges.reshape(-1, 2):
        first = start + settled
        if last - first >= max(8.0, least_s * motion.sample_rate_hz):
            angle = motion.position[first:last, joint]
            velocity = float(angle[-1] - angle[0]) * motion.sample_rate_hz / (last - first - 1)
            found.append(Phase(velocity, angle, motion.torque[first:last, joint]))
    return found
