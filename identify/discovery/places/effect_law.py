"""The dynamic stiffness that an effect says for its place, as a law of its own parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.parameters import Scale
from identify.discovery.places.law import LawFit, Whitened, fit_law
from identify.discovery.places.predict import StructuralModel
from identify.discovery.places.semiparametric import SemiParametricFit
from identify.discovery.places.views import View
from identify.model.effects.base import Effect, Term
from identify.model.effects.place import Attachment, Release
from identify.model.effects.site import Site
from identify.model.system import build_site
from identify.vibration.problem import Problem

_ROLES = (("stiffness", 0, 1.0), ("damping", 1, 1.0), ("mass", 2, 1.0), ("hysteretic", 0, 1.0j))


@dataclass(frozen=True)
class EffectStart:
    """Values by name from which an effect is refitted, and the gap that its law would leave."""

    values: Mapping[str, float]
    squares: float


def start_of(
    effect: Effect,
    model: StructuralModel,
    fit: SemiParametricFit,
    problem: Problem,
    band_hz: tuple[float, float],
) -> EffectStart:
    """An effect at its place: its parameters fitted to the measured dynamic stiffness, the known ones
    adjusted.
    """
    view = model.views[0]
    site = _site(effect, view, problem)
    terms = effect.terms(problem.robot, site, f"effects.{len(problem.file.study.effects)}")
    if len(model.place.directions if isinstance(model.place, Attachment) else ()) == 3:
        terms = [
            t if t.parameter.initial else _held(t) for t in terms
        ]  # levers turn, which forces do not show
    scale = Scale(tuple(term.parameter for term in terms))
    stiffness = _law(effect, terms, model, view, site, problem)
    s = model.lines(fit.values)

    def law(x: Array) -> Complex:
        return stiffness(scale.to_values(x), s)

    grid = effect.initial_values(terms, band_hz)
    found = fit_law(Whitened(fit, model.sign), law, scale.to_x(grid), *scale.bounds())
    known = Scale(problem.of_effects)
    values = dict(
        zip((t.parameter.name for t in terms), map(float, scale.to_values(found.values)), strict=True)
    )
    return EffectStart({**_known(known, fit, found, problem), **values}, fit.squares + found.squares)


def law_of(
    effect: Effect, model: StructuralModel, problem: Problem, values: Mapping[str, float], s: Complex
) -> Complex:
    """(l, d, d): the dynamic stiffness that an effect says for a place with values by parameter name."""
    view = model.views[0]
    site = _site(effect, view, problem)
    terms = effect.terms(problem.robot, site, f"effects.{len(problem.file.study.effects)}")
    own = np.array([values[term.parameter.name] for term in terms])
    return _law(effect, terms, model, view, site, problem)(own, s)


def _held(term: Term) -> Term:
    return replace(term, parameter=replace(term.parameter, free=False))


def _known(known: Scale, fit: SemiParametricFit, found: LawFit, problem: Problem) -> dict[str, float]:
    lower, upper = known.bounds()
    x = np.clip(known.to_x(fit.values) + np.clip(found.change, -0.5, 0.5), lower, upper)
    return dict(zip((p.name for p in problem.of_effects), map(float, known.to_values(x)), strict=True))


def _site(effect: Effect, view: View, problem: Problem) -> Site:
    """The first posture's, with the coordinates that the effect brings."""
    site = view.system.site
    if not effect.changes_site:
        return site
    m = next(m for m in problem.measurements if m.name == view.target.name)
    effects = [*problem.file.study.effects, effect]
    at = (problem.robot, m.given.posture, effects, m.settings.detached, problem.points)
    return build_site(*at, engine=site.engine)


def _law(
    effect: Effect, terms: list[Term], model: StructuralModel, view: View, site: Site, problem: Problem
) -> Callable[[Array, Complex], Complex]:
    """(values, s) -> dynamic stiffness (l, d, d)."""
    place, through = model.place, None
    if isinstance(place, Release):
        names: Sequence[str] = place.coordinates
    else:
        names = [view.system.coordinates[n] for n in view.known]
        through = np.linalg.pinv(view.directions(place))
    inner = [name for name in effect.free_coordinates(problem.robot) if name not in names]
    own = np.array([site.number(name) for name in inner], dtype=int)
    outer = np.array([site.number(name) for name in names], dtype=int)
    stacks, inertia = _stacks(terms, np.concatenate([outer, own])), site.mass[np.ix_(own, own)]

    def law(values: Array, s: Complex) -> Complex:
        z = _sum(stacks, values, s)
        z[:, len(outer) :, len(outer) :] += (s**2)[:, None, None] * inertia
        left = _condensed(z, len(outer))
        return left if through is None else np.asarray(through.T @ left @ through)

    return law


def _stacks(terms: list[Term], chosen: Index) -> list[tuple[int, complex, Array]]:
    """Power of s, factor, and the matrices (terms, n, n) of each role that any term has."""
    pick, result = np.ix_(chosen, chosen), []
    for role, power, factor in _ROLES:
        matrices = [getattr(term, role) for term in terms]
        if any(matrix is not None for matrix in matrices):
            empty = np.zeros((len(chosen), len(chosen)))
            stack = np.array([empty if matrix is None else matrix[pick] for matrix in matrices])
            result.append((power, factor, stack))
    return result


def _sum(stacks: list[tuple[int, complex, Array]], values: Array, s: Complex) -> Complex:
    size = stacks[0][2].shape[1]
    total = np.zeros((len(s), size, size), dtype=complex)
    for power, factor, stack in stacks:
        total += (factor * s**power)[:, None, None] * np.tensordot(values, stack, axes=1)
    return total


def _condensed(z: Complex, known: int) -> Complex:
    """What an effect opposes at the known coordinates, its own ones free."""
    if z.shape[1] == known:
        return z
    inner = np.linalg.solve(z[:, known:, known:], z[:, known:, :known])
    return np.asarray(z[:, :known, :known] - z[:, :known, known:] @ inner)
