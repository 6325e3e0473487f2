"""Coupled wrist gears: a motor feels a share of the torque of its neighbour, as hollow-shaft wrists have
it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.recorded_motion import RecordedMotion

WRIST = 4
"""First joint of a wrist."""


@dataclass(frozen=True)
class GearCoupling(MotionEffect):
    """A share of the joint torque of `other` at the motor of `axis`."""

    other: int = 0
    kind: ClassVar[str] = "gear-coupling"
    of_load: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("share", "1"),)

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Every pair of examined wrist joints."""
        wrist = [axis for axis in scene.axes if axis >= WRIST]
        yield from (cls(axis, other) for axis in wrist for other in wrist if other != axis)

    @property
    def name(self) -> str:
        """`joint4.gear-coupling.joint5`."""
        return f"{super().name}.joint{self.other}"

    def sentence(self) -> str:
        """What this instance is."""
        return f"gear coupling: motor {self.axis} carries a share of the torque of joint {self.other}"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Load of the other joint at this motor."""
        return scene.on(self.axis, scene.load[:, self.other - 1] / scene.gear_ratio[self.axis - 1])
