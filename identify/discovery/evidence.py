"""Which of several models the data support: likelihood in units of noise, a price per parameter, and data
that were not fitted.

The residuals are not independent (a window smears noise over lines, noise on the force is common to all
responses of an impact) and the best model may be wrong by more than noise.  So chi-square counts for less, by
how much wider than the naive covariance the sandwich covariance of the best model is (Huber 1967;
`identify.fitting.uncertainty`); the price of a parameter is that of Schwarz 1978.  Half a difference of this
criterion is the natural logarithm of the odds (Kass and Raftery 1995, section 4.1.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.parameters import Scale
from identify.core.thresholds import CLOSED
from identify.discovery.task import Trial
from identify.fitting.selection.gain import Gain
from identify.fitting.uncertainty import statuses
from identify.vibration.problem import Problem, with_effects
from identify.vibration.uncertainty import uncertainty

_NOISE_OFF = 0.05
"""By how much a noise level may be wrong: coherence from a few averages states it to some 5 %."""


@dataclass(frozen=True)
class EvidenceCriterion:
    """What evidence is measured with; variance_inflation: how many times too high chi-square counts."""

    variance_inflation: float

    def score(self, trial: Trial) -> float:
        """Quasi-BIC: less is better.  Data that were not fitted count as those that were: many parameters fit
        what one part has alone.  What was stated is no residual that may be correlated, and counts in full.
        """
        inflation = max(self.variance_inflation, 1.0)
        squares = trial.squares - trial.errors + (trial.squares_validation if trial.count_validation else 0.0)
        priced = trial.free * float(np.log(max(trial.count / inflation, 2.0)))
        return squares / inflation + trial.errors + priced

    def log_odds(self, before: Trial, after: Trial) -> float:
        """Natural logarithm of the odds for `after` over `before`."""
        return (self.score(before) - self.score(after)) / 2

    def gain(self, before: Trial, after: Trial) -> Gain:
        """What `after` gains."""
        return Gain(
            self.log_odds(before, after),
            removed(before.gap_everywhere, after.gap_everywhere),
            not after.count_validation or after.squares_validation < before.squares_validation,
        )


def closed(trial: Trial) -> bool:
    """Whether a model leaves nothing open, and data that were not fitted clearly no more than those that
    were: postures that resemble each other are fitted by wrong stiffnesses, which another posture shows.
    """
    open_elsewhere = trial.gap_validation >= max(CLOSED, trial.gap + _NOISE_OFF)
    return trial.gap < CLOSED and not open_elsewhere


def above_noise(gap: float) -> bool:
    """Whether a gap is larger than a noise level may be wrong by."""
    return gap >= 1 + _NOISE_OFF


def removed(before: float, after: float) -> float:
    """Fraction of the gap above noise that is gone: 1 - (after - 1) / (before - 1)."""
    return 1.0 - max(after - 1.0, 0.0) / max(before - 1.0, 1e-9)


def variance_inflation(problem: Problem, trial: Trial) -> float:
    """How many times too small the naive variance of the parameters is, for the worst of those that the data
    determine.
    """
    model = with_effects(problem, trial.task.effects, trial.values)
    # What forces disagree by is in every model alike: it widens intervals, but prefers none of the models.
    found = uncertainty(model.targets(), Scale(model.parameters), model.initial, disagreement=False)
    scale, values = Scale(model.of_effects), model.initial[: model.size]
    known = [status != "not determined" for status in statuses(scale, values, found.std)]
    ratio = (found.std / found.independent_std) ** 2
    return float(np.max(ratio, where=known, initial=1.0))
