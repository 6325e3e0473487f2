"""A place of the structure as far as it comes from the law that a model has there, with the direction of its
axis where that may differ.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.discovery.places.catalogue import with_misalignment
from identify.discovery.places.effect_law import law_of
from identify.discovery.places.predict import StructuralModel, Unknown
from identify.discovery.places.screen import Job, PlaceFitter
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.places.update import a_of, triangle
from identify.model.effects.base import Effect
from identify.model.effects.place import Place
from identify.vibration.problem import Problem

_STEPS = 10


@dataclass(frozen=True)
class Settled:
    """The place in the fitted sets and how it ended; scale: of the parameters and of how far its axis is
    misaligned;
    law (l, d, d): what the effect says that it began with, None without one.
    """

    model: StructuralModel
    scale: Scale
    fit: SemiParametricFit
    law: Complex | None


def settled(
    problem: Problem, place: Place, effect: Effect | None, values: Mapping[str, float]
) -> Settled | None:
    """From what an effect says with values by name, or from nothing; problem is without that effect, and may
    be without the place.
    """
    fitter, place = PlaceFitter(problem), with_misalignment(place, problem)
    model, scale, law = fitter.model(place), fitter.scale(place), None
    if model is None:
        return None
    assert isinstance(model, StructuralModel)
    began = np.array([p.initial for p in scale.parameters])
    if effect is not None and not effect.of_amplitude:
        law = law_of(effect, model, problem, values, model.lines(began))
    [fit] = fitter.fit([Job(place, began, None if law is None else _unknown(model, began, law))], _STEPS)
    assert fit is not None
    return Settled(model, scale, fit, law)


def _unknown(model: StructuralModel, values: Array, law: Complex) -> Unknown:
    """What a law says."""
    reference = model.start(values).reference
    return Unknown(triangle(a_of(law, reference, model.sign)), reference)
