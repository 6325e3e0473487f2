"""Which effects may be tried on a target."""

from __future__ import annotations

from collections.abc import Sequence

from identify.core.plugin import left_out_where_broken
from identify.explain.effects.base import MOTION_EFFECTS, MotionEffect, Target
from identify.explain.recorded_motion import RecordedMotion


def candidates(
    target: Target, scene: RecordedMotion, kinds: Sequence[str] | None = None
) -> list[MotionEffect]:
    """One effect for each kind and place that fits the target; kinds: only those (default: all that are
    registered).
    """
    found: list[MotionEffect] = []
    chosen = (
        MOTION_EFFECTS.usable()
        if kinds is None
        else {kind: MOTION_EFFECTS.get(kind, "effects") for kind in kinds}
    )
    for cls in chosen.values():
        with left_out_where_broken():
            found += cls.instances(scene) if cls.target == target else []
    return found
