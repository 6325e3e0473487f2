"""Which places explain what is left, whatever acts there, and the law that is measured at the best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identify.core.arrays import Array
from identify.discovery.places.catalogue import places_of
from identify.discovery.places.job import Glance, Known, Start, Steps
from identify.discovery.places.screen import Job, PlaceFit, screen_places
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.workers import Workers
from identify.model.effects.base import Effect
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.place import Beside, Place, Release
from identify.vibration.problem import Problem

_NEAR, _FEWEST, _MOST = 30.0, 0.1, 8
"""How many times the best place's gap above noise a place may leave for its effects to be looked at, which
gap above noise counts as none, and how many places at most."""
_UNKNOWN = 2
"""At how many of the best places a law that no effect has is tried."""


class PooledFitter:
    """Fits places in the processes of a pool."""

    def __init__(self, workers: Workers, known: Known) -> None:
        self._workers, self._known = workers, known

    def glance(self, places: Sequence[Place], values: Array) -> list[Place]:
        """In one process."""
        [order] = self._workers.places(self._known, [Glance(tuple(places), values)])
        return list(order)

    def fit(self, jobs: Sequence[Job], steps: int) -> list[SemiParametricFit | None]:
        """All at once."""
        return self._workers.places(self._known, [Steps(job, steps) for job in jobs])


def look(workers: Workers, problem: Problem, known: Known) -> list[PlaceFit]:
    """Every place beside the known effects, best first; problem has the linear ones of these."""
    values = np.array([known.values[p.name] for p in problem.of_effects])
    return screen_places(places_of(problem), PooledFitter(workers, known), values)


def unknown_laws(
    workers: Workers, known: Known, ranked: Sequence[PlaceFit]
) -> list[tuple[Effect, Mapping[str, float]]]:
    """A measured dynamic stiffness at each of the best places that are coordinates, with the values that its
    curve says.
    """
    found = list[tuple[Effect, PlaceFit]]()
    for one in _near(ranked)[:_UNKNOWN]:
        if isinstance(one.place, (Release, Beside)):
            names, free = list(one.place.coordinates), isinstance(one.place, Release)
            if all(name.split(".")[0].startswith(("joint", "base")) for name in names):
                found.append((MeasuredImpedance(at=names, released=free, branches=2), one))
    starts = workers.places(known, [Start(effect, one) for effect, one in found])
    return [(one, start.values) for (one, _), start in zip(found, starts, strict=True) if start is not None]


def _near(ranked: Sequence[PlaceFit]) -> list[PlaceFit]:
    least = max(ranked[0].fit.gap - 1, _FEWEST) if ranked else 0.0
    return [one for one in ranked[:_MOST] if one.fit.gap - 1 <= _NEAR * least]
