"""What one model gains over another, on one scale for all analyses, and rules on it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from identify.core.arrays import Array


@dataclass(frozen=True)
class Gain:
    """What a model gains over another.

    log_odds: natural logarithm of the odds for it, NaN where only a first look was taken; explained: fraction
    of what could be explained that is gone, over all parts of the data; confirmed: whether data that were not
    fitted say so too; material: whether it is larger than what estimators and noise models get wrong.
    parts: the explained fraction of each part of the data, such as joints, NaN where untouched; chance: that
    the mean gain is none.  Both are empty or NaN where an analysis does not ask.
    """

    log_odds: float
    explained: float
    confirmed: bool = True
    material: bool = True
    parts: Array = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)
    chance: float = float("nan")

    @property
    def refitted(self) -> bool:
        """Whether it is more than a first look."""
        return not np.isnan(self.log_odds)


UNKNOWN = Gain(float("nan"), float("nan"), confirmed=False, material=False)
"""What a first look says of evidence."""


@dataclass(frozen=True)
class Rule:
    """What a gain must have at least: more than these log odds, this explained fraction, and what else is
    asked.
    """

    log_odds: float = -np.inf
    explained: float = -np.inf
    confirmed: bool = True
    material: bool = False

    def holds(self, gain: Gain) -> bool:
        """Whether a gain is enough."""
        return (
            gain.log_odds > self.log_odds
            and gain.explained >= self.explained
            and (gain.confirmed or not self.confirmed)
            and (gain.material or not self.material)
        )
