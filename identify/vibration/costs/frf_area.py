"""The area between measured and simulated FRFs (Kobe, IJAT 15-5, 2021, Eq. 10)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Complex, Index, logarithm
from identify.fitting.objective import Objective
from identify.vibration.costs.base import Cost, FrfObjective, real_rows
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget

_DECIBEL = 20 / np.log(10)


class FrfArea(Cost):
    """F = sum over lines and FRFs of |H_sim - H_exp|, of magnitudes (as published) or complex, linear or in
    decibels.

    On the linear scale, complex differences of channels the model cannot move count in full; decibels leave
    them out.
    """

    kind: Literal["frf-area"] = "frf-area"
    scale: Literal["linear", "log"] = Field("linear", description="`log`: in dB")
    compare: Literal["magnitude", "complex"] = Field("magnitude", description="`complex`: with the phase")

    def objective(self, targets: Targets) -> Objective:
        """The cost for FRF sets."""
        return FrfAreaObjective(self, targets)


class FrfAreaObjective(FrfObjective[FrfArea]):
    """Sum of absolute differences; gradient methods minimise the sum of their squares instead, which has the
    same zero.
    """

    def _difference(self, h: Complex, measured: Complex) -> Complex:
        if self.cost.compare == "magnitude":
            h, measured = np.abs(h).astype(complex), np.abs(measured).astype(complex)
        return h - measured if self.cost.scale == "linear" else _DECIBEL * logarithm(h / measured)

    def sums(self, target: FrfTarget, candidates: Array) -> Array:
        """Sum of absolute differences; in decibels, a channel that the model cannot move is left out."""
        difference = np.abs(self._difference(target.predict_pairs(candidates), target.measured))
        if self.cost.scale == "log":
            difference = difference[..., target.observable]
        return np.asarray(np.sum(difference, axis=(-2, -1)))

    def parts(self, target: FrfTarget, values: Array, free: Index) -> tuple[Array, Array]:
        """The differences themselves, and their slopes."""
        h, slope = target.gradient_pairs(values, free)
        measured = target.measured
        if self.cost.scale == "log":
            h, slope, measured = (
                h[:, target.observable],
                slope[:, target.observable],
                measured[:, target.observable],
            )
            slope = slope / h[..., None] * _DECIBEL
        elif self.cost.compare == "magnitude":
            slope = slope * np.exp(-1j * np.angle(h))[..., None]
        difference = self._difference(h, measured)
        if self.cost.compare == "complex":
            return real_rows(difference, slope)
        return difference.real.ravel(), slope.real.reshape(-1, slope.shape[-1])
