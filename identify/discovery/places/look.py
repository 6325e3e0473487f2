"""The first look at candidates: which places explain the gap, and what each candidate would leave there by
the law that it says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.core.arrays import Array
from identify.discovery.places.catalogue import places_of
from identify.discovery.places.job import Glance, Known, Start, Steps
from identify.discovery.places.screen import Job, PlaceFit, screen_places
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.workers import Workers
from identify.model.effects.base import Effect
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.place import Beside, Column, Place, Release, Rows
from identify.vibration.problem import Problem

_NEAR, _FEWEST, _MOST = 30.0, 0.1, 8
"""How many times the best place's gap above noise a place may leave for its effects to be looked at, which
gap above noise counts as none, and how many places at most."""
_UNKNOWN = 2
"""At how many of the best places a law that no effect has is tried."""


@dataclass(frozen=True)
class Looked:
    """A candidate after the first look: the gap that it would leave, NaN where nothing can be said without
    trying; values to start it from, by name.
    """

    effect: Effect
    gap: float
    values: Mapping[str, float] = field(default_factory=dict)


class PooledFitter:
    """Fits places in the processes of a pool."""

    def __init__(self, workers: Workers, known: Known, done: Callable[[], None]) -> None:
        self._workers, self._known, self._done = workers, known, done

    def glance(self, places: Sequence[Place], values: Array) -> list[Place]:
        """In one process."""
        [order] = self._workers.places(self._known, [Glance(tuple(places), values)])
        return list(order)

    def fit(self, jobs: Sequence[Job], steps: int) -> list[SemiParametricFit | None]:
        """All at once."""
        return self._workers.places(self._known, [Steps(job, steps) for job in jobs], self._done)


def look(
    workers: Workers,
    problem: Problem,
    known: Known,
    candidates: Sequence[Effect],
    done: Callable[[], None] = lambda: None,
    least: float = -np.inf,
) -> tuple[list[PlaceFit], list[Looked]]:
    """Places, best first, and candidates, best first, those without a place last; problem has the known
    linear effects.  None of either where no place makes the gap smaller by `least`.
    """
    names = [p.name for p in problem.of_effects]
    values = np.array([known.values[name] for name in names])
    fitter = PooledFitter(workers, known, done)
    ranked = screen_places(places_of(problem, candidates), fitter, values, least)
    if not any(one.fit.fall >= least for one in ranked):
        return [], []
    return ranked, candidates_at(workers, problem, known, ranked, candidates, done)


def candidates_at(
    workers: Workers,
    problem: Problem,
    known: Known,
    ranked: Sequence[PlaceFit],
    candidates: Sequence[Effect],
    done: Callable[[], None] = lambda: None,
) -> list[Looked]:
    """What candidates would leave at the best of the places; those without a place last."""
    names = [p.name for p in problem.of_effects]
    near = _near(ranked)
    pairs, unplaced, fitted = [], [], {one.place for one in ranked}
    for effect in candidates:
        places = effect.places(problem.robot, problem.points)
        own = [found for found in near if found.place in places]
        pairs += [(effect, found) for found in own]
        if not any(place in fitted or isinstance(place, (Rows, Column)) for place in places):
            unplaced.append(Looked(effect, float("nan"), {}))
    starts = workers.places(known, [Start(effect, found) for effect, found in pairs], done)
    best: dict[str, Looked] = {}
    for (effect, found), start in zip(pairs, starts, strict=True):
        fit = found.fit
        gap = fit.gap if start is None else float(np.sqrt(start.squares / fit.count))
        own_values = dict(zip(names, map(float, fit.values), strict=True)) if start is None else start.values
        key = effect.model_dump_json()
        if key not in best or gap < best[key].gap:
            best[key] = Looked(effect, gap, own_values)
    return [*sorted(best.values(), key=lambda one: one.gap), *unplaced]


def unknown_laws(ranked: Sequence[PlaceFit]) -> list[Effect]:
    """A measured dynamic stiffness at each of the best places that are coordinates."""
    found: list[Effect] = []
    for one in _near(ranked)[:_UNKNOWN]:
        if isinstance(one.place, (Release, Beside)):
            names, free = list(one.place.coordinates), isinstance(one.place, Release)
            if all(name.split(".")[0].startswith(("joint", "base")) for name in names):
                found.append(MeasuredImpedance(at=names, released=free, branches=2))
    return found


def _near(ranked: Sequence[PlaceFit]) -> list[PlaceFit]:
    least = max(ranked[0].fit.gap - 1, _FEWEST) if ranked else 0.0
    return [one for one in ranked[:_MOST] if one.fit.gap - 1 <= _NEAR * least]
