"""Which places explain the gap: a few steps of the semi-parametric fit at all of them, more at those that
stay ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.discovery.places.predict import PlaceModel, ReadingModel, Unknown, misalignments, model_of
from identify.discovery.places.semiparametric import SemiParametricFit, fit_place
from identify.discovery.places.views import views_of
from identify.model.effects.place import Column, Place, Rows
from identify.vibration.problem import Problem

_ROUNDS = ((3, 20), (4, 8), (8, 0))
"""Steps of each round, and how many places go on to the next one."""
_GLANCED = 6
"""Places of the measurement that get more than one linear step."""


@dataclass(frozen=True)
class PlaceFit:
    """A place and how its fit ended."""

    place: Place
    fit: SemiParametricFit


@dataclass(frozen=True)
class Job:
    """A place to be fitted from parameter values and an unknown (None: nothing is missing)."""

    place: Place
    values: Array
    unknown: Unknown | None = None


class Fitter(Protocol):
    """What fits places, here or in other processes."""

    def glance(self, places: Sequence[Place], values: Array) -> list[Place]:
        """The places of the measurement among these, best first."""

    def fit(self, jobs: Sequence[Job], steps: int) -> list[SemiParametricFit | None]:
        """Each job's end; None where no set has the place."""


class PlaceFitter:
    """Fits places in the sets of a problem, in this process."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.views = problem, views_of(problem)
        self._models: dict[Place, PlaceModel | None] = {}

    def model(self, place: Place) -> PlaceModel | None:
        """A place in the sets; None where none has it."""
        if place not in self._models:
            try:
                self._models[place] = model_of(place, self.views)
            except InputError:
                self._models[place] = None
        return self._models[place]

    def glance(self, places: Sequence[Place], values: Array) -> list[Place]:
        """By what one linear step would leave."""
        models = {place: self.model(place) for place in places}
        readings = {place: model for place, model in models.items() if isinstance(model, ReadingModel)}
        return _glanced(readings, Scale(self.problem.of_effects), values)

    def fit(self, jobs: Sequence[Job], steps: int) -> list[SemiParametricFit | None]:
        """One by one."""
        return [self._fit(job, steps) for job in jobs]

    def _fit(self, job: Job, steps: int) -> SemiParametricFit | None:
        model = self.model(job.place)
        if model is None:
            return None
        return fit_place(model, self.scale(job.place), job.values, steps, job.unknown)

    def scale(self, place: Place) -> Scale:
        """Of the parameters, then of how far the axis of a place is misaligned."""
        return Scale((*self.problem.of_effects, *misalignments(place)))


def screen_places(places: Sequence[Place], fitter: Fitter, values: Array) -> list[PlaceFit]:
    """The places in order of the gap they leave, from parameter values of the present model."""
    readings = [place for place in places if isinstance(place, (Rows, Column))]
    left = [place for place in places if place not in readings]
    left += fitter.glance(readings, values)[:_GLANCED]
    found: dict[Place, PlaceFit] = {}
    for steps, keep in _ROUNDS:
        ends = fitter.fit([_job(place, found.get(place), values) for place in left], steps)
        found |= {place: PlaceFit(place, fit) for place, fit in zip(left, ends, strict=True) if fit}
        left = sorted(
            (p for p in left if p in found),
            key=lambda place: found[place].fit.gap_before - found[place].fit.fall,
        )[:keep]
    return sorted(found.values(), key=lambda one: one.fit.gap_before - one.fit.fall)


def _job(place: Place, before: PlaceFit | None, values: Array) -> Job:
    return Job(place, values) if before is None else Job(place, before.fit.values, before.fit.unknown)


def _glanced(models: dict[Place, ReadingModel], scale: Scale, values: Array) -> list[Place]:
    """Places of the measurement, best first, by what one linear step would leave; the present model is
    evaluated once for all.
    """
    if not models:
        return []
    any_model = next(iter(models.values()))
    whole = ReadingModel(Column(), any_model.views)
    start = whole.start(values)
    parts = whole.predict(start, values, scale.free, whole.rests(start, values))
    slope = scale.slope(scale.to_x(values))
    every = [np.concatenate([p.by_parameter * slope, p.residual[..., None]], axis=3) for p in parts]
    read = [p.by_unknown[..., 0] for p in parts]
    total = np.asarray(sum(_product(e.reshape(-1, e.shape[-1])) for e in every))
    lines, count = [view.lines for view in any_model.views], len(start.values)
    left: dict[Place, float] = {}
    for place, model in models.items():
        matrix = total - _taken(place, model, every, read, lines, count)
        information, gradient = matrix[:-1, :-1], matrix[:-1, -1]
        damped = information + np.diag(1e-8 * np.diag(total)[:-1] + 1e-12)
        left[place] = float(matrix[-1, -1] - gradient @ np.linalg.solve(damped, gradient))
    return sorted(left, key=lambda place: left[place])


def _product(rows: Complex) -> Array:
    return np.asarray((np.conj(rows).T @ rows).real)


def _taken(
    place: Place,
    model: ReadingModel,
    every: Sequence[Complex],
    read: Sequence[Complex],
    lines: Sequence[Index],
    count: int,
) -> Array:
    """What the unknowns of a place take out of the products of derivatives and residual."""
    size, columns = model.size, every[0].shape[-1]
    if isinstance(place, Column):
        gram, both = np.zeros((count, 1, 1), dtype=complex), np.zeros((count, 1, columns), dtype=complex)
        for one, h, chosen, numbers in zip(every, read, model.chosen, lines, strict=True):
            own = h[:, :, chosen].reshape(len(h), -1, 1)
            _add(gram, both, numbers, own, one[:, :, chosen].reshape(len(h), -1, columns))
        return _projected(gram, both)
    result, weights = np.zeros((columns, columns)), [_filled(view.weight) for view in model.views]
    for row in range(size):
        gram, both = (
            np.zeros((count, size, size), dtype=complex),
            np.zeros((count, size, columns), dtype=complex),
        )
        for one, h, chosen, numbers, weight in zip(every, read, model.chosen, lines, weights, strict=True):
            if len(chosen):
                own = np.swapaxes(h[:, chosen] / weight[:, chosen] * weight[:, chosen[row]][:, None], 1, 2)
                _add(gram, both, numbers, own, one[:, chosen[row]])
        result += _projected(gram, both)
    return result


def _filled(weight: Array) -> Array:
    return np.where(weight > 0, weight, 1.0)


def _add(gram: Complex, both: Complex, numbers: Index, own: Complex, right: Complex) -> None:
    turned = np.conj(np.swapaxes(own, 1, 2))
    gram[numbers] += turned @ own  # a set has each line once
    both[numbers] += turned @ right


def _projected(gram: Complex, both: Complex) -> Array:
    size = np.einsum("lmm->lm", gram).real
    least = 1e-10 * size.max(axis=1, initial=0.0)
    damped = gram + np.eye(gram.shape[1]) * np.where(least > 0, least, 1.0)[:, None, None]
    taken = np.conj(np.swapaxes(both, 1, 2)) @ np.linalg.solve(damped, both)
    return np.asarray(taken.sum(axis=0).real)
