"""The measured sets as every place sees them: each posture's robot with all its coordinates, and arrays of
FRFs over noise whose lines are shared by all sets.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.measured.frf_set import POWER
from identify.model.effects.base import Effect, Term
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.place import Attachment, Beside
from identify.model.effects.site import Site
from identify.model.system import Factors, System, assemble, build_site
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.vibration.costs.make_target import channel_rows, needed_channels
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.placed import state
from identify.vibration.problem import Measurement, Problem

_JITTER = 1e-11
"""Share of the size of each coordinate's motion in the outputs that keeps those that no output sees apart."""


class Unlocked(Effect):
    """Lets every coordinate of a site move, without a spring: not an effect of a study."""

    kind: Literal["unlocked"] = "unlocked"
    names: tuple[str, ...]

    def sentence(self) -> str:
        """For errors only."""
        return "all coordinates"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Nowhere."""
        return iter(())

    def free_coordinates(self, robot: Robot) -> list[str]:
        """All of them."""
        return list(self.names)

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """None."""
        return []


@dataclass(frozen=True, eq=False)
class View:
    """One FRF set and the robot at its posture with every coordinate unlocked.

    target: data, noise and readings; system: over all coordinates; known: numbers of those that the model
    frees; out (channels, n), force (n, inputs): the set's channels over all coordinates; lines: for each of
    its lines the number among the lines that all sets share; weight (lines, outputs, inputs): one over the
    noise, 0 where nothing was measured.
    """

    target: FrfTarget
    system: System
    known: Index
    out: Array
    force: Array
    lines: Index
    weight: Array

    @property
    def power(self) -> int:
        """Of s in H."""
        return POWER[self.target.data.quantity]

    @cached_property
    def gram(self) -> tuple[Array, Complex, Array]:
        """(lines, inputs, n, n), (lines, inputs, n) and (lines, inputs): products of the outputs with each
        other and with what was measured, and of that with itself, all over noise.
        """
        square = np.swapaxes(self.weight, 1, 2) ** 2
        measured = np.swapaxes(np.where(self.weight > 0, self.target.data.frf, 0.0), 1, 2)
        weighted = square[..., None] * self.out
        return (
            np.swapaxes(weighted, 2, 3) @ self.out,
            np.einsum("lion,lio->lin", weighted, measured),
            np.sum(square * np.abs(measured) ** 2, axis=2),
        )

    def compressed(self, chosen: Index) -> tuple[Array, Complex, float]:
        """F (lines, inputs, n, n), w (lines, inputs, n) and a rest: |residual / noise|^2 of motions y is
        |F y - w|^2 + rest, over some of the coordinates.
        """
        gram, along, whole = self.gram
        own = gram[:, :, chosen[:, None], chosen]
        size = np.sqrt(np.einsum("linn->lin", own))
        size = np.where(size > 0, size, 1.0)
        scaled = own / (size[..., :, None] * size[..., None, :]) + _JITTER * np.eye(len(chosen))
        lower = np.linalg.cholesky(scaled)
        wanted = np.linalg.solve(lower.astype(complex), (along[:, :, chosen] / size)[..., None])[..., 0]
        rest = float(np.sum(whole) - np.sum(np.abs(wanted) ** 2))
        return np.asarray(np.swapaxes(lower, 2, 3) * size[..., None, :]), np.asarray(wanted), rest

    def numbers(self, names: Sequence[str]) -> Index:
        """Numbers of coordinates by name; those that a posture does not have are left out."""
        present = [name for name in names if name in self.system.coordinates]
        return np.array([self.system.coordinates.index(name) for name in present], dtype=int)

    def over(self, chosen: Index) -> tuple[System, Array, Array]:
        """The system, outputs and forces over some of the coordinates."""
        return restricted(self.system, chosen), self.out[:, chosen], self.force[chosen]

    def directions(self, place: Attachment | Beside) -> Array:
        """(d, known): rows along which something attached pushes, over what the model frees."""
        if isinstance(place, Beside):
            return np.array([self.system.site.vector(name)[self.system.free] for name in place.coordinates])[
                :, self.known
            ]
        site, point = self.system.site, np.array(place.at_m)
        motion = site.jacobian(place.link, point, "place")
        if place.frame == "base" and place.link not in site.detached:
            turn = site.engine.axes(place.link)
            motion = np.concatenate([turn @ motion[:3], turn @ motion[3:]])
        if place.along is not None:
            chosen = np.asarray(place.along)[None] @ motion[:3]
        else:
            rows = ["x", "y", "z", "rx", "ry", "rz"]
            chosen = motion[[rows.index(axis) for axis in place.axes]]
        return np.asarray(chosen[:, self.system.free][:, self.known])


def restricted(system: System, chosen: Index) -> System:
    """A system over some of its coordinates; the others are locked."""
    pick = np.ix_(chosen, chosen)
    factors = system.factors
    return replace(
        system,
        coordinates=tuple(system.coordinates[n] for n in chosen),
        free=system.free[chosen],
        mass=system.mass[pick],
        stiffness=system.stiffness[pick],
        terms={role: terms.over(chosen) for role, terms in system.terms.items()},
        factors=Factors(factors.vectors[chosen], factors.power, factors.weight, factors.owner),
        coriolis=None if system.coriolis is None else system.coriolis[pick],
    )


def views_of(problem: Problem, use: str = "fit") -> list[View]:
    """The FRF sets of a use; sets whose impacts differ in strength do not share lines, because what is
    missing may depend on the amplitude.
    """
    chosen = [m for m in problem.measurements if m.settings.use == use and isinstance(m.target, FrfTarget)]
    keys: dict[tuple[float, complex], int] = {}
    return [_view(problem, m, keys) for m in chosen]


def count_of(views: Sequence[View]) -> int:
    """How many lines there are in all."""
    return 1 + max(int(view.lines.max()) for view in views)


def _view(problem: Problem, m: Measurement, keys: dict[tuple[float, complex], int]) -> View:
    assert isinstance(m.target, FrfTarget)
    target, effects = m.target, tuple(problem.file.study.effects)
    links = [
        e for e in LinkFlexibility.instances(problem.robot, problem.points) if not _bends(effects, e.link)
    ]
    site = build_site(
        problem.robot,
        m.given.posture,
        [*effects, *links],
        m.settings.detached,
        problem.points,
        m.system.site.reference,
        m.system.site.engine,
    )
    every = Unlocked(names=site.coordinates)
    system = assemble(problem.robot, site, [*effects, every], driven=m.system.driven)
    level = 0.0 if m.given.impact is None else m.given.impact.peak
    lines = [keys.setdefault((level, complex(s)), len(keys)) for s in target.data.s]
    known = np.array([system.coordinates.index(name) for name in m.system.coordinates], dtype=int)
    target, system, out, force = _observed(problem, m, target, system)
    noise = np.full(target.data.frf.shape, np.nan) if target.noise is None else target.noise
    there = np.isfinite(target.data.frf) & (noise > 0) & target.data.measured
    return View(
        target,
        replace(system, coriolis=None),
        known,
        out,
        force,
        np.array(lines, dtype=int),
        np.divide(1.0, noise, out=np.zeros(noise.shape), where=there),
    )


def _observed(
    problem: Problem, m: Measurement, target: FrfTarget, system: System
) -> tuple[FrfTarget, System, Array, Array]:
    """A set's target, the system over more coordinates, its outputs (channels, n) and forces (n, inputs),
    with nuisance parameters as they are in the problem.
    """
    channels, inputs = needed_channels(target.data, system, problem.points), target.data.inputs
    errors = problem.initial[problem.size :]
    if m.uncertain is None or not len(errors):
        out, force = (channel_rows(system, problem.points, some, m.name) for some in (channels, inputs))
        return target, system, out, force.T
    at = state(m.uncertain(system, channels, inputs), errors)
    return _held(target, errors), system.with_more(at.mass, at.stiffness), at.out, at.force


def _held(target: FrfTarget, errors: Array) -> FrfTarget:
    """A target with no nuisance parameters, as they are in it; late responses are made early."""
    there, delay = target.realised(errors)
    early = np.exp(delay * there.data.s)[:, None, None]
    return replace(there, data=replace(there.data, frf=there.data.frf * early))


def _bends(effects: Sequence[Effect], link: str) -> bool:
    return any(isinstance(effect, LinkFlexibility) and effect.link == link for effect in effects)


def whitened(view: View, h: Complex) -> Complex:
    """(lines, outputs, inputs, ...) over noise, 0 where nothing was measured."""
    weight = view.weight.reshape(*view.weight.shape, *[1] * (h.ndim - 3))
    return np.asarray(np.where(weight > 0, h, 0.0) * weight)
