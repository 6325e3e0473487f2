"""Normalised responses to several forces at once, weighted around modes (fast chirp, Eqs. 2 and 10).

A rotating offset mass pushes in x and, a quarter turn later, in y.  The responses divided by the force
amplitude A are X/A = H_xx + H_xy e^{-j pi/2} and so on (Eq. 2, whose printed indices are wrong): a fixed
combination of the columns of H.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Index
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.fitting.objective import Objective
from identify.measured.channel import Channel
from identify.vibration.costs.base import Cost, FrfObjective, real_rows
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget


class ResonanceWeights(Settings):
    """W(f) = 1 + (height - 1) sum over modes of exp(-(f - f_mode)^2 / 2 width^2)."""

    modes_hz: list[float] = Field(min_length=1, description="where the weight peaks, Hz")
    width_hz: float = Field(1.0, gt=0, description="standard deviation of each bell, Hz")
    height: float = Field(5.0, ge=1, description="weight at a mode; 1 elsewhere")

    def at(self, frequency_hz: Array) -> Array:
        """W (lines,)."""
        distance = (frequency_hz[:, None] - np.asarray(self.modes_hz)) / self.width_hz
        return np.asarray(1 + (self.height - 1) * np.exp(-(distance**2) / 2).sum(axis=1))


class NormalizedResponse(Cost):
    """sum over lines and outputs of W |(X/A)_sim - (X/A)_exp|, as the modulus of the complex difference."""

    kind: Literal["normalized-response"] = "normalized-response"
    excitation: dict[str, float] = Field(
        min_length=1, description="force channel -> phase in degrees, such as {14:+X: 0, 14:+Y: -90}"
    )
    weights: ResonanceWeights | None = Field(None, description="where modes are; default: all lines alike")

    def objective(self, targets: Targets) -> Objective:
        """The cost for FRF sets that have all the force channels."""
        return NormalizedResponseObjective(self, targets)


class NormalizedResponseObjective(FrfObjective[NormalizedResponse]):
    """Weighted sum of moduli; gradient methods minimise the weighted sum of squares instead."""

    def __init__(self, cost: NormalizedResponse, targets: Targets) -> None:
        super().__init__(cost, targets)
        self.phasors = [self._phasor(target) for target in self.targets]

    def _phasor(self, target: FrfTarget) -> np.ndarray:
        phasor = np.zeros(len(target.data.inputs), dtype=complex)
        for text, phase_deg in self.cost.excitation.items():
            channel = Channel.parse(text, "cost.excitation")
            if channel not in target.data.inputs:
                known = ", ".join(map(str, target.data.inputs))
                raise InputError(
                    "cost.excitation", f"force channel {channel} is not in {target.name}", f"one of {known}"
                )
            phasor[target.data.inputs.index(channel)] = np.exp(1j * np.deg2rad(phase_deg))
        if np.isnan(target.data.frf[..., phasor != 0]).any():
            raise InputError(
                target.name,
                "an FRF of an excited channel is missing",
                "every output measured from every force channel",
            )
        return phasor

    def _weight(self, target: FrfTarget) -> Array:
        return (
            np.ones(len(target.data.s))
            if self.cost.weights is None
            else self.cost.weights.at(target.data.frequency_hz)
        )

    def _measured(self, target: FrfTarget) -> tuple[np.ndarray, np.ndarray]:
        phasor = self.phasors[self.targets.index(target)]
        return phasor, np.nan_to_num(target.data.frf) @ phasor

    def sums(self, target: FrfTarget, candidates: Array) -> Array:
        """W |difference| over lines and outputs."""
        phasor, measured = self._measured(target)
        difference = np.abs(target.predict(candidates) @ phasor - measured)
        return np.asarray(np.einsum("l,mlo->m", self._weight(target), difference))

    def parts(self, target: FrfTarget, values: Array, free: Index) -> tuple[Array, Array]:
        """W times the complex differences."""
        phasor, measured = self._measured(target)
        weight = self._weight(target)[:, None]
        h, gradient = target.gradient(values, free)
        return real_rows(
            weight * (h @ phasor - measured), weight[..., None] * np.einsum("loip,i->lop", gradient, phasor)
        )
