"""Modal masses of modes from responses alone, from FRFs (`by_frfs`) or a mass (`by_added_mass`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Texts
from identify.core.thresholds import SIGMAS_95

_TOLD = 0.25
"""Relative standard deviation from which on a modal mass is not given."""


@dataclass(frozen=True)
class ModalMasses:
    """Of modes (m,): kg, of shapes whose largest component is 1, NaN where not determined, with standard
    deviations; partner_hz: frequency of the mode that determined it, NaN without one; reason: why it is not
    determined.

    Of a complex shape it is the size of modal a over 2 omega_d, which does not depend on the shape's phase.
    """

    kg: Array
    std_kg: Array
    partner_hz: Array
    reason: Texts


class MassesByMode:
    """1 / m of modes, 1/kg, one by one."""

    def __init__(self, count: int, reason: str) -> None:
        self._inverse, self._std, self._partner_hz = np.full((3, count), np.nan)
        self._reason = [reason] * count

    def add(self, mode: int, partner_hz: float, inverse: float, std: float) -> None:
        """1 / m of a mode with its standard deviation, if that is small enough."""
        self._partner_hz[mode] = partner_hz
        self._reason[mode] = ""
        if not std < _TOLD * inverse:
            half = f"{SIGMAS_95 * std / abs(inverse):.0%}" if inverse else "100%"
            negative = ", and negative" if inverse < 0 else ""
            self._reason[mode] = f"it would be known to no better than {half}{negative}"
        else:
            self._inverse[mode], self._std[mode] = inverse, std

    def refuse(self, mode: int, partner_hz: float, reason: str) -> None:
        """No mass of a mode, and why."""
        self._partner_hz[mode], self._reason[mode] = partner_hz, reason

    @property
    def masses(self) -> ModalMasses:
        """Of all of them."""
        kg = 1 / self._inverse
        return ModalMasses(kg, kg**2 * self._std, self._partner_hz, tuple(self._reason))
