"""Which of several models the data support: likelihood in units of noise, a price per parameter, and data
that were not fitted.

The residuals are not independent (a window smears noise over lines, noise on the force is common to all
responses of an impact) and the best model may be wrong by more than noise.  So chi-square counts for less, by
how much wider than the naive covariance the sandwich covariance of the best model is (Huber 1967;
`identify.fitting.uncertainty`); the price of a parameter is that of Schwarz 1978.  Half a difference of this
criterion is the natural logarithm of the odds (Kass and Raftery 1995, section 4.1.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.parameters import Scale
from identify.core.thresholds import CONVINCING, MATERIAL
from identify.discovery.task import Trial
from identify.fitting.selection.gain import Gain, Rule
from identify.fitting.selection.policy import Policy
from identify.fitting.uncertainty import Uncertainty, statuses
from identify.vibration.problem import Problem, with_effects
from identify.vibration.uncertainty import fitted_errors, uncertainty

_CONFIRMED_FRACTION = 0.3
"""Fraction of what is above noise that an addition must remove from data that were not fitted, whose own
noise level is not known as well."""
CLOSED = 1.1
"""Below this gap nothing is added unless data that were not fitted say more than their own noise level may be
wrong by: `_CONFIRMED_FALL`."""
FAR = 5.0
"""Gap, over that of the best model known, that no other start would bring down."""
SMALL = 1.5
"""Below this gap little is left."""
_NEARER = 0.9
"""Share of a large gap that is clearly less."""
_CONFIRMED_FALL = 0.05
"""Fall of the gap on data that were not fitted, and how much more than the others they must show for a gap to
be open there: coherence from a few averages states noise to some 5 %."""

POLICY = Policy(
    admit=Rule(CONVINCING),
    retain=(Rule(CONVINCING, explained=1 / 11),),
    settle=Rule(CONVINCING, explained=0.5, material=True),
    settle_several=Rule(CONVINCING, explained=0.8, material=True),
    rival_log_odds=CONVINCING,
    parsimony=0.97,
    parsimony_below=0.9,
    pair_below=0.9,
    most=6,
    patience=2,
    tentative=0.2,
    nearly=0.9,
    many=8,
)
"""Half of what is above noise must go with an addition, and 80 % with several that do not explain enough one
by one: less is compensating for something else that is missing."""


@dataclass(frozen=True)
class EvidenceCriterion:
    """What evidence is measured with; variance_inflation: how many times too high chi-square counts."""

    variance_inflation: float

    def score(self, trial: Trial) -> float:
        """Quasi-BIC: less is better.  Data that were not fitted count as those that were: many parameters fit
        what one part has alone.
        """
        inflation = max(self.variance_inflation, 1.0)
        squares = trial.squares + (trial.squares_validation if trial.count_validation else 0.0)
        return squares / inflation + trial.free * float(np.log(max(trial.count / inflation, 2.0)))

    def log_odds(self, before: Trial, after: Trial) -> float:
        """Natural logarithm of the odds for `after` over `before`."""
        return (self.score(before) - self.score(after)) / 2

    def gain(self, before: Trial, after: Trial) -> Gain:
        """What `after` gains: material where the gap falls by more than noise models get wrong, on data that
        were not fitted too.
        """
        elsewhere = (
            _silent(before, after)
            or removed(before.gap_validation, after.gap_validation) >= _CONFIRMED_FRACTION
        )
        fell = before.gap_validation - after.gap_validation if after.count_validation else 0.0
        needless = before.gap < CLOSED and fell < _CONFIRMED_FALL
        return Gain(
            self.log_odds(before, after),
            removed(before.gap_everywhere, after.gap_everywhere),
            confirmed(before, after),
            before.gap - after.gap >= MATERIAL and elsewhere and not needless,
        )


def closed(trial: Trial) -> bool:
    """Whether a model leaves nothing open, and data that were not fitted clearly no more than those that
    were: postures that resemble each other are fitted by wrong stiffnesses, which another posture shows.
    """
    open_elsewhere = trial.gap_validation >= max(CLOSED, trial.gap + _CONFIRMED_FALL)
    return trial.gap < CLOSED and not open_elsewhere


def above_noise(gap: float) -> bool:
    """Whether a gap is larger than a noise level may be wrong by."""
    return gap >= 1 + _CONFIRMED_FALL


def nearly_closed(trial: Trial) -> bool:
    """Whether a model leaves something open, but little."""
    return not closed(trial) and trial.gap < SMALL


def clearly_nearer(trials: Sequence[Trial], gap: float) -> list[Trial]:
    """Those that come near the data, or clearly nearer than a gap that is far from them: what more parameters
    gain while something else is missing says little.
    """
    return [trial for trial in trials if trial.gap <= max(FAR, _NEARER * gap)]


def confirmed(before: Trial, after: Trial) -> bool:
    """Whether data that were not fitted say so too; True where they can say nothing."""
    return _silent(before, after) or after.squares_validation < before.squares_validation


def _silent(before: Trial, after: Trial) -> bool:
    """Whether there are no data that were not fitted, or neither model leaves anything open there: errors of
    what was told that turn a sensor round predict as well as a reversed channel does.
    """
    worse = after.gap_validation - before.gap_validation
    return not after.count_validation or (not above_noise(before.gap_validation) and worse < MATERIAL)


def removed(before: float, after: float) -> float:
    """Fraction of the gap above noise that is gone: 1 - (after - 1) / (before - 1)."""
    return 1.0 - max(after - 1.0, 0.0) / max(before - 1.0, 1e-9)


def variance_inflation(problem: Problem, trial: Trial) -> float:
    """How many times too small the naive variance of the parameters is, for the worst of those that the data
    determine.
    """
    # What forces disagree by is in every model alike: it widens intervals, but prefers none of the models.
    found, known = _uncertainty(problem, trial, disagreement=False)
    ratio = (found.std / found.independent_std) ** 2
    return float(np.max(ratio, where=known, initial=1.0))


def disagreement(problem: Problem, trial: Trial) -> float:
    """How many times the variance that noise gives the parameters the forces of a test disagree by, on
    average over those that the data determine; 1 where no errors of what was told are fitted along.
    """
    found, known = _uncertainty(problem, trial, disagreement=True)
    if found.joint is None or not known.any():
        return 1.0
    return float(np.mean(found.joint.widening[known] ** 2))


def errors_of(problem: Problem, trial: Trial) -> tuple[Array, Array]:
    """(e, e) each: covariance and scatter of errors of what was told after a fit (`fitted_errors`)."""
    model = with_effects(problem, trial.task.effects, trial.values)
    return fitted_errors(model, model.initial)


def _uncertainty(problem: Problem, trial: Trial, *, disagreement: bool) -> tuple[Uncertainty, Mask]:
    """That of a trial's parameters, and which of these the data determine."""
    model = with_effects(problem, trial.task.effects, trial.values)
    found = uncertainty(model.targets(), Scale(model.parameters), model.initial, disagreement=disagreement)
    scale, values = Scale(model.of_effects), model.initial[: model.size]
    told = statuses(scale, values, found.std)
    return found, np.array([status != "not determined" for status in told])
