"""Which places explain the gap: a few steps of the semi-parametric fit at all of them, more at those that
stay ahead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.discovery.places.predict import PlaceModel, ReadingModel, model_of
from identify.discovery.places.semiparametric import SemiParametricFit, fit_place
from identify.discovery.places.views import View
from identify.model.effects.place import Column, Place

_ROUNDS = ((3, 24), (5, 8), (8, 0))
"""Steps of each round, and how many places go on to the next one."""
_GLANCED = 6
"""Places of the measurement that get more than one linear step."""


@dataclass(frozen=True)
class PlaceFit:
    """A place, its model in the sets, and how its fit ended."""

    place: Place
    model: PlaceModel
    fit: SemiParametricFit


def screen_places(
    places: Sequence[Place],
    views: Sequence[View],
    scale: Scale,
    values: Array,
    done: Callable[[int, int], None] = lambda number, total: None,
) -> list[PlaceFit]:
    """The places in order of the gap they leave, from parameter values of the present model."""
    models = _models(places, views)
    readings = {place: model for place, model in models.items() if isinstance(model, ReadingModel)}
    glanced = _glanced(readings, scale, values)[:_GLANCED]
    left = [place for place in models if place not in readings] + glanced
    found: dict[Place, PlaceFit] = {}
    total, count = len(left) + sum(keep for _, keep in _ROUNDS), 0
    for steps, keep in _ROUNDS:
        for place in left:
            before = found.get(place)
            start = (values, None) if before is None else (before.fit.values, before.fit.unknown)
            fit = fit_place(models[place], scale, start[0], steps, start[1])
            found[place] = PlaceFit(place, models[place], fit)
            count += 1
            done(min(count, total), total)
        left = sorted(left, key=lambda place: found[place].fit.gap)[:keep]
    return sorted(found.values(), key=lambda one: one.fit.gap)


def _models(places: Sequence[Place], views: Sequence[View]) -> dict[Place, PlaceModel]:
    """The places that the sets have."""
    models: dict[Place, PlaceModel] = {}
    for place in places:
        try:
            models[place] = model_of(place, views)
        except InputError:
            continue
    return models


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
    np.add.at(gram, numbers, turned @ own)
    np.add.at(both, numbers, turned @ right)


def _projected(gram: Complex, both: Complex) -> Array:
    size = np.einsum("lmm->lm", gram).real
    least = 1e-10 * size.max(axis=1, initial=0.0)
    damped = gram + np.eye(gram.shape[1]) * np.where(least > 0, least, 1.0)[:, None, None]
    taken = np.conj(np.swapaxes(both, 1, 2)) @ np.linalg.solve(damped, both)
    return np.asarray(taken.sum(axis=0).real)
