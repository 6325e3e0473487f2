"""What the step of integration does to a fit: the model at half the step beside that at the step, and how far
that moves the values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.core.thresholds import SIGMAS_95
from identify.fitting.uncertainty import Uncertainty
from identify.motion.trajectory import TrajectoryObjective

_PART = 0.25
"""Shift of a value, over half its 95 % interval, from which the step is not good enough: from there on fewer
than 92 of 100 intervals hold the truth.
"""


@dataclass(frozen=True)
class StepError:
    """mismatch: RMS of the error of the step, in units of the noise; shift: what it moves each free value by,
    over half its interval, (free,), in the order of `names`.
    """

    step_s: float
    mismatch: float
    names: tuple[str, ...]
    shift: Array

    @property
    def good(self) -> bool:
        """Whether no interval is off by much."""
        return bool(np.nanmax(np.abs(self.shift), initial=0.0) <= _PART)

    def sentence(self) -> str:
        """What a reader has to know."""
        said = f"the error of the step of {self.step_s:.3g} s is {self.mismatch:.2g} times the noise"
        if self.good:
            most = float(np.nanmax(np.abs(self.shift), initial=0.0))
            return f"{said} and moves no value by more than {most:.1g} of half its interval"
        row = int(np.nanargmax(np.abs(self.shift)))
        count = int(np.count_nonzero(np.abs(self.shift) > _PART))
        return (
            f"{said}, too much: it moves {count} of {len(self.names)} values by more than a quarter of half"
            f" their intervals, {self.names[row]} by {abs(self.shift[row]):.2g}; give a smaller `step_s`, or"
            " `extrapolate: true`"
        )


def step_error(
    objective: TrajectoryObjective,
    scale: Scale,
    values: Array,
    seen: tuple[Array, Array],
    trusted: Uncertainty,
) -> StepError:
    """The error of the step at values (parameters,), by simulation at half of it; seen: residuals and
    derivatives there.

    With an error in proportion to the step to the power p, p = 1 for dampers and dry friction (2 where
    extrapolated), m(h) is off by the difference to m(h/2) over 1 - 2^-p.  The values move by its
    least-squares projection on the derivatives.
    """
    residuals, slopes = seen
    order = 2 if objective.problem.file.study.extrapolate else 1
    finer = TrajectoryObjective(objective.problem.halved, objective.records, objective.noise)
    error = (residuals - finer.smooth(values)) / (1 - 0.5**order)
    j = slopes * scale.slope(scale.to_x(values))
    prior = scale.prior_information() / objective.count
    moved = np.linalg.solve(j.T @ j + np.diag(prior), j.T @ error)
    names = tuple(scale.parameters[number].name for number in scale.free)
    step_s = objective.problem.step_s
    return StepError(step_s, float(np.sqrt(np.sum(error**2))), names, moved / (SIGMAS_95 * trusted.std))
