"""Which effects may be tried on a target."""

from __future__ import annotations

from collections.abc import Sequence

from identify.explain.effects.base import MOTION_EFFECTS, MotionEffect, Target
from identify.explain.recorded_motion import RecordedMotion


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
