"""Which of several models the data support: likelihood in units of noise, a price per parameter, and data
that were not fitted.

The residuals are not independent (a window smears noise over lines, noise on the force is common to all
responses of a blow) and the best model may be wrong by more than noise.  So chi-square counts for less, by
how much wider than the naive covariance the sandwich covariance of the best model is (Huber 1967;
`identify.fitting.uncertainty`); the price of a parameter is that of Schwarz 1978.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.thresholds import CONVINCING
from identify.discovery.trial import Trial

HALF, MOST = 0.5, 0.8
"""Share of what is above noise that an addition must remove, and that several must remove together which do
not explain enough one by one: less is a patch on something else that is missing."""
_PARTLY = 0.3
"""The same on data that were not fitted, whose own noise level is not known as well."""
_MATERIAL = 0.015
"""A smaller fall of the gap than this is within what estimators and noise models get wrong."""


@dataclass(frozen=True)
class EvidenceCriterion:
    """What evidence is measured with; inflation: how many times too high chi-square counts."""

    inflation: float

    def score(self, trial: Trial) -> float:
        """Quasi-BIC: less is better.  Data that were not fitted count as those that were: many parameters fit
        what one part has alone.
        """
        worth = max(self.inflation, 1.0)
        squares = trial.squares + (trial.squares_validation if trial.count_validation else 0.0)
        return squares / worth + trial.free * float(np.log(max(trial.count / worth, 2.0)))

    def evidence(self, before: Trial, after: Trial) -> float:
        """By how much `after` is better than `before`."""
        return self.score(before) - self.score(after)


def confirmed(before: Trial, after: Trial) -> bool:
    """Whether data that were not fitted say so too; True where there are none."""
    return not after.count_validation or after.squares_validation < before.squares_validation


def removed(before: float, after: float) -> float:
    """Share of the gap above noise that is gone: 1 - (after - 1) / (before - 1)."""
    return 1.0 - max(after - 1.0, 0.0) / max(before - 1.0, 1e-9)


def convinces(judge: EvidenceCriterion, before: Trial, after: Trial, share: float = HALF) -> bool:
    """Whether `after` is not only better but explains: most of what was above noise is gone, on fitted and on
    other data.
    """
    if (
        judge.evidence(before, after) <= CONVINCING
        or not confirmed(before, after)
        or before.gap - after.gap < _MATERIAL
    ):
        return False
    elsewhere = not after.count_validation or removed(before.gap_validation, after.gap_validation) >= _PARTLY
    return removed(before.gap, after.gap) >= share and elsewhere
