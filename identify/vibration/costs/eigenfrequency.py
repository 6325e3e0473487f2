"""Natural frequencies and damping ratios (UMONS, ICSV25 2018, Eq. 2), with conditions such as "mode 4 above
100 Hz".
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy
from pydantic import Field

from identify.core.arrays import Array, Index
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.fitting.objective import Objective
from identify.modal.mac import macx
from identify.model.modes import ComplexModes, complex_modes
from identify.vibration.costs.base import Cost
from identify.vibration.costs.make_target import ModalTarget, Targets


class Condition(Settings):
    """A bound on the frequency of a model mode, counted from 1 in order of frequency; what is missing to it
    adds to J in Hz.
    """

    mode: int = Field(ge=1, description="number of the mode")
    above_hz: float = Field(0.0, description="its frequency must be at least this")
    below_hz: float = Field(float("inf"), description="its frequency must be at most this")


class Eigenfrequency(Cost):
    """J = sum |f_sim - f_exp| in Hz + sum |zeta_sim - zeta_exp| in percent, over all measured modes.

    With shapes, each measured mode is compared with the model mode of highest total MAC and nearness in
    frequency (one to one); without, the first with the first.  `relative` compares per cent of each value
    instead.
    """

    kind: Literal["eigenfrequency"] = "eigenfrequency"
    damping: bool = Field(True, description="false: frequencies only")
    scale: Literal["absolute", "relative"] = Field(
        "absolute", description="Hz and points of damping, or per cent of each"
    )
    conditions: list[Condition] = Field([], description="bounds on model modes that were not measured")

    def objective(self, targets: Targets) -> Objective:
        """The cost for modal tables."""
        return EigenfrequencyObjective(self, targets)


class EigenfrequencyObjective(Objective):
    """Sum of absolute differences; gradient methods minimise the sum of their squares instead, which has the
    same zero.
    """

    def __init__(self, cost: Eigenfrequency, targets: Targets) -> None:
        if not targets.modal:
            raise InputError(
                "cost",
                "eigenfrequency compares modes, and no measurement to be fitted has any",
                "`measurements` with `modes`",
            )
        self.cost, self.targets = cost, targets.modal

    def costs(self, candidates: Array) -> Array:
        """J of each candidate; infinite where the model has too few modes."""
        nothing = np.zeros(0, dtype=int)
        return np.array([np.abs(self.residuals(values, nothing)[0]).sum() for values in candidates])

    def residuals(self, values: Array, free: Index) -> tuple[Array, Array]:
        """Differences in Hz and points (or per cent), then what is missing to each condition in Hz."""
        parts = [self._one(target, values, free) for target in self.targets]
        return np.concatenate([r for r, _ in parts]), np.concatenate([j for _, j in parts])

    def _one(self, target: ModalTarget, values: Array, free: Index) -> tuple[Array, Array]:
        system, own = target.at(values)
        matrices = system.matrices(own)
        needed = max([len(target.data), *(condition.mode for condition in self.cost.conditions)])
        modes = complex_modes(*matrices) if all(np.isfinite(matrix).all() for matrix in matrices) else None
        if modes is None or len(modes.eigenvalues) < needed:
            rows = len(target.data) * (2 if self.cost.damping else 1) + len(self.cost.conditions)
            return np.full(rows, np.inf), np.zeros((rows, len(free)))
        slopes = target.slopes(modes, values, free)
        residual, slope = self._differences(target, modes, slopes)
        missing, missing_slope = self._missing(modes, slopes[0])
        return np.concatenate([residual, missing]), np.concatenate([slope, missing_slope])

    def _differences(
        self, target: ModalTarget, modes: ComplexModes, slopes: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        data, order = target.data, pair_all(target, modes)
        relative = self.cost.scale == "relative"
        scale = 100 / data.frequency_hz if relative else np.ones(len(data))
        residual, slope = (
            (modes.frequency_hz[order] - data.frequency_hz) * scale,
            slopes[0][order] * scale[:, None],
        )
        if not self.cost.damping:
            return residual, slope
        known = ~np.isnan(data.damping_ratio)
        percent = 100 / data.damping_ratio if relative else np.full(len(data), 100.0)
        damping = np.where(known, (modes.damping_ratio[order] - data.damping_ratio) * percent, 0.0)
        damping_slope = np.where(known[:, None], slopes[1][order] * percent[:, None], 0.0)
        return np.concatenate([residual, damping]), np.concatenate([slope, damping_slope])

    def _missing(self, modes: ComplexModes, slope: Array) -> tuple[Array, Array]:
        missing, slopes = (
            np.zeros(len(self.cost.conditions)),
            np.zeros((len(self.cost.conditions), slope.shape[1])),
        )
        for row, condition in enumerate(self.cost.conditions):
            frequency = modes.frequency_hz[condition.mode - 1]
            for excess, sign in (
                (condition.above_hz - frequency, -1.0),
                (frequency - condition.below_hz, 1.0),
            ):
                if excess > 0:
                    missing[row], slopes[row] = excess, sign * slope[condition.mode - 1]
        return missing, slopes


def pair_all(target: ModalTarget, modes: ComplexModes) -> Index:
    """The model mode (measured modes,) of each measured mode: by MAC and nearness in frequency with shapes,
    by order without.
    """
    if target.out is None or target.data.shapes is None:
        return np.arange(len(target.data))
    apart = np.abs(np.log(modes.frequency_hz[None, :] / target.data.frequency_hz[:, None]))
    cost = 1 - macx(target.data.shapes, modes.shapes @ target.out.T) + apart
    return np.asarray(scipy.optimize.linear_sum_assignment(cost)[1])
