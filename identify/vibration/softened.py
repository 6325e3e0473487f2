"""The way to the likelihood where errors of what was told are fitted along.

With noise far below those errors the valley is narrow and bent.  Residuals that count for little at first
leave the errors near what was stated, and the minimum moves on as they count for more (continuation).
"""

from __future__ import annotations

from identify.fitting.optimizers.levenberg_marquardt import LevenbergMarquardt
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.costs.target import Targets

SOFTNESS = (100.0, 30.0, 10.0, 3.0)
SOFT_STAGE = LevenbergMarquardt(steps=10, tolerance=1e-2)
"""By how much less residuals count, in turn, and how each of them is minimised: roughly."""


def softened(targets: Targets) -> list[PosteriorObjective]:
    """The likelihood with residuals that count for ever more."""
    return [PosteriorObjective(FrfLeastSquares(), targets, softness) for softness in SOFTNESS]
