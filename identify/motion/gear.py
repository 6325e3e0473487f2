"""Gears: ratio, and what makes their spring nonlinear: hardening (Nagoya Eq. 8), transmission error (Eq. 9)
and backlash.

The law of the spring is in `identify.model.laws.gear`; its linear part is `joint-compliance` about rz.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.model.laws.gear import GearSpring
from identify.motion.numbers import Number, quantity


class Ripple(Settings):
    """One component of the transmission error (Eq. 9): amplitude cos(order motor angle + phase)."""

    order: int = Field(ge=1, description="periods per turn of the motor")
    amplitude: Number = quantity("rad", "at the gear output", least=-np.inf)
    phase: Number = quantity("rad", "of the cosine", 0.0, least=-np.inf)


class Gear(Settings):
    """A gear per joint."""

    ratio: Number = quantity("", "turns of the motor per turn of the gear output", least=1.0)
    cubic_stiffness: Number = quantity("N m/rad^3", "A_3 of Eq. 8, hardening", 0.0)
    backlash: Number = quantity("rad", "free play at the gear output, from stop to stop", 0.0)
    transmission_error: list[Ripple] = Field([], description="components of Eq. 9")

    def sections(self) -> dict[str, Settings]:
        """The parts that hold numbers, by the name they have in parameters."""
        return {
            "gear": self,
            **{f"gear.transmission_error.{n}": ripple for n, ripple in enumerate(self.transmission_error)},
        }


def gear_spring(gear: Gear, numbers: Mapping[str, Array], stiffness: Array) -> GearSpring:
    """The springs with the numbers of the gears and the linear stiffness (lanes, joints), 0 where a joint is
    rigid.
    """
    ripples: Sequence[tuple[int, Array, Array]] = [
        (
            ripple.order,
            numbers[f"gear.transmission_error.{n}.amplitude"],
            numbers[f"gear.transmission_error.{n}.phase"],
        )
        for n, ripple in enumerate(gear.transmission_error)
    ]
    return GearSpring(
        numbers["gear.ratio"],
        stiffness,
        numbers["gear.cubic_stiffness"],
        numbers["gear.backlash"],
        tuple(ripples),
    )
