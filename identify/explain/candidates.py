"""Which effects may be tried on a target, and how much an effect is worth on a record that was not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import log_likelihood_gain, mean_above_zero
from identify.explain.effects.base import MOTION_EFFECTS, MotionEffect, Target
from identify.explain.recorded_motion import RecordedMotion
from identify.explain.regression import Case, Fit, aligned

_TOUCH = 1e-6
"""Share of its residual by which a joint must change to count as touched."""


def candidates(
    target: Target, scene: RecordedMotion, kinds: Sequence[str] | None = None
) -> list[MotionEffect]:
    """One effect for each kind and place that fits the target; kinds: only those (default: all that are
    registered).
    """
    found: list[MotionEffect] = []
    for kind in kinds if kinds is not None else MOTION_EFFECTS.names():
        cls = MOTION_EFFECTS.get(kind, "effects")
        if cls.target == target:
            found += cls.instances(scene)
    return found


@dataclass(frozen=True)
class Worth:
    """What a fit gains over another on a record.

    evidence: natural logarithm of the likelihood ratio of correlated residuals on a record that was not
    fitted; chance: that the mean gain is none, from blocks; share (joints,): part of each joint's sum of
    squares that goes, NaN where untouched.
    """

    evidence: float
    chance: float
    share: Array

    @property
    def total(self) -> float:
        """The shares of all joints together."""
        return float(np.nansum(self.share))


def worth(case: Case, before: Fit, after: Fit) -> Worth:
    """The gain of `after` over `before` on a record that neither was fitted to.

    Parameters need no price of their own; a phase that is turned to the record's own beginning does (Schwarz
    1978).
    """
    old, new = aligned(case, before).residual(case), aligned(case, after).residual(case)
    size = np.abs(old).max(axis=0)
    touched = [
        joint
        for joint in range(old.shape[1])
        if np.abs(old - new)[:, joint].max() > _TOUCH * size[joint] and case.used[:, joint].any()
    ]
    evidence, share, gain = 0.0, np.full(old.shape[1], np.nan), np.zeros(len(old))
    for joint in touched:
        used = case.used[:, joint]
        one, other = float((old[:, joint] ** 2).sum()), float((new[:, joint] ** 2).sum())
        share[joint] = 1 - other / one
        more, fall = log_likelihood_gain(old[:, joint], new[:, joint], used)
        evidence += more
        gain += fall
    if not touched:
        return Worth(0.0, 1.0, share)
    if case.scene.relative:
        turned = sum(effect.wave for effect in after.effects) - sum(effect.wave for effect in before.effects)
        evidence -= turned / 2 * np.log(case.used[:, touched].sum())
    return Worth(float(evidence), mean_above_zero(gain[case.used[:, touched].any(axis=1)]), share)
