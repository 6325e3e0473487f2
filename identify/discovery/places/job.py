"""Work on places as a process of the pool gets it: which model, and what to do with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.discovery.places.effect_law import EffectStart, start_of
from identify.discovery.places.predict import StructuralModel
from identify.discovery.places.screen import Job, PlaceFit, PlaceFitter
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.model.effects.base import Effect
from identify.model.effects.place import Place


@dataclass(frozen=True)
class Known:
    """The present model: effects and values by name."""

    effects: tuple[Effect, ...]
    values: Mapping[str, float]


@dataclass(frozen=True)
class Glance:
    """Order places of the measurement by one linear step."""

    places: tuple[Place, ...]
    values: Array

    def run(self, fitter: PlaceFitter, band_hz: tuple[float, float]) -> list[Place]:
        """Best first."""
        return fitter.glance(self.places, self.values)


@dataclass(frozen=True)
class Steps:
    """Some steps of one place."""

    job: Job
    steps: int

    def run(self, fitter: PlaceFitter, band_hz: tuple[float, float]) -> SemiParametricFit | None:
        """None where no set has the place."""
        return fitter.fit([self.job], self.steps)[0]


@dataclass(frozen=True)
class Start:
    """Where to start an effect at a place that has been fitted."""

    effect: Effect
    found: PlaceFit

    def run(self, fitter: PlaceFitter, band_hz: tuple[float, float]) -> EffectStart | None:
        """None where the effect is no law of frequency at that place."""
        model = fitter.model(self.found.place)
        if not isinstance(model, StructuralModel) or self.effect.of_amplitude:
            return None
        try:
            return start_of(self.effect, model, self.found.fit, fitter.problem, band_hz)
        except (InputError, np.linalg.LinAlgError):
            return None


PlaceJob = Glance | Steps | Start
