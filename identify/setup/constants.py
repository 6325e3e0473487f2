"""Factors that mistakes have: constants of units, and powers of ten."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.measured.units import GRAVITY, POUND_FORCE
from identify.robot.units import INCH_M, POUND_KG


@dataclass(frozen=True)
class Factor:
    """A factor of measured FRFs, value, in words, and what mistakes have it."""

    value: float
    words: str
    reasons: tuple[str, ...] = ()

    @property
    def known(self) -> bool:
        """Whether it is that of a mistake with a name."""
        return bool(self.reasons)


_G = "the responses are in m/s^2 where their unit says g"
_REASONS: dict[float, tuple[str, ...]] = {
    1 / GRAVITY: ("the responses are in g where their unit says m/s^2",),
    GRAVITY: (_G, "the forces are in kgf where their unit says N"),
    10.0: ("the sensitivity of the hammer or of the sensors is wrong by ten",),
    0.1: ("the sensitivity of the hammer or of the sensors is wrong by ten",),
    100.0: ("the sensitivity of the hammer or of the sensors is wrong by a hundred",),
    0.01: ("the sensitivity of the hammer or of the sensors is wrong by a hundred",),
    1000.0: (
        "the responses are in mm where their unit says m",
        "the forces are in kN where their unit says N",
        "masses and inertias of the robot file are in grams",
    ),
    0.001: ("the forces are in mN where their unit says N",),
    1 / INCH_M: ("the responses are in inches where their unit says m",),
    INCH_M: ("the responses are in m where their unit says inches",),
    GRAVITY * 1000: ("the responses are in mm/s^2 where their unit says g",),
    POUND_FORCE: ("the forces are in lbf where their unit says N",),
    1 / POUND_FORCE: ("the forces are in N where their unit says lbf",),
    1 / POUND_KG: ("masses and inertias of the robot file are in pounds",),
    POUND_KG: ("masses and inertias of the robot file are taken for pounds",),
    2 * np.pi: ("frequencies or velocities are mixed up with angular ones",),
    1 / (2 * np.pi): ("frequencies or velocities are mixed up with angular ones",),
    0.5: ("amplitudes are peaks on one side and peak to peak on the other",),
    2.0: ("amplitudes are peak to peak on one side and peaks on the other",),
}
"""By the factor that the measured FRFs have beyond what they should."""
NEAR = 0.12
"""A fitted factor is off by as much in its logarithm where masses are not quite as stated: of known ones that
are as near, the gap tells.
"""


def near(factor: float, within: float = NEAR) -> list[Factor]:
    """All known factors within a logarithm of one, or itself where there is none."""
    sign = float(np.sign(factor))
    found = [known for known in _REASONS if abs(np.log(known / abs(factor))) < within]
    return [_known(sign, one) for one in found] or [nearest(factor)]


def _known(sign: float, value: float) -> Factor:
    reversed_ = " with the other sign" if sign < 0 else ""
    return Factor(sign * value, f"{value:.4g} times{reversed_}", _REASONS[value])


def nearest(factor: float) -> Factor:
    """The known factor nearest to a fitted one, or the fitted one with two digits."""
    sign, size = np.sign(factor), abs(factor)
    best = min(_REASONS, key=lambda known: abs(np.log(known / size)))
    reversed_ = " with the other sign" if sign < 0 else ""
    if abs(np.log(best / size)) < NEAR:
        return _known(float(sign), best)
    return Factor(float(f"{sign * size:.2g}"), f"{size:.2g} times{reversed_}")
