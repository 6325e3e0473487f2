"""Assembly of robot, posture and effects to a linear system whose matrices are affine in the parameters.

    M(p) = M_0 + sum_j p_j M_j,  C(p) = C_0 + sum_j p_j C_j,  K(p) = K_g + sum_j p_j (K_j + j H_j)

over the free coordinates only; a locked coordinate has no row.  Each M_j, C_j, K_j, H_j has low rank and
is kept as factors, so that sensitivities cost a product of thin matrices (`identify.model.frf`).  K is real
where there is no hysteretic damping H; where there is, the model holds for positive frequencies.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Complex, Index, Mask
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.model.compliances import Compliances
from identify.model.effects.base import Effect, Term, Torque, check_matrix, check_terms, errors_of
from identify.model.effects.site import Added, Site
from identify.model.effects.torque_law import TorqueLaw
from identify.model.stack import Stack
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.points import Point
from identify.robot.posture import AXES, Mechanism, at_posture

_ROLES = {"stiffness": (0, 1.0), "damping": (1, 1.0), "mass": (2, 1.0), "hysteretic": (0, 1.0j)}
"""Power of s and factor with which a term enters the dynamic stiffness."""
_NOTHING = 1e-12


@dataclass(frozen=True)
class Factors:
    """dZ/dp as a sum over columns r of weight_r s^power_r a_r a_r', each owned by one parameter.

    vectors (n, r); power (r,): 0 stiffness, 1 damping, 2 mass; weight (r,), imaginary for hysteretic damping;
    owner (r,): number of the parameter.
    """

    vectors: Array
    power: Index
    weight: Array | Complex
    owner: Index

    def columns(self, parameters: Index) -> Index:
        """Numbers of the columns that parameters with these numbers own."""
        wanted = np.zeros(1 + max(self.owner.max(initial=-1), parameters.max(initial=-1)), dtype=bool)
        wanted[parameters] = True
        return np.flatnonzero(wanted[self.owner])


class Change(NamedTuple):
    """What a unit of the parameter with the number `owner` adds to dZ: factor s^power times a symmetric
    matrix (n, n).
    """

    matrix: Array
    power: int
    owner: int
    factor: complex = 1.0


@dataclass(frozen=True)
class PlacedLaw:
    """A nonlinear torque at a coordinate, and the numbers of its parameters."""

    law: TorqueLaw
    coordinate: str
    numbers: Index


@dataclass(frozen=True)
class System:
    """The model at one posture.

    parameters: those of all effects in their order; coordinates: names of the n free coordinates; free: their
    numbers among those of the site; mass, stiffness (n, n): the parts that no parameter changes; terms: per
    role a stack (parameters, n, n); factors: the same as thin columns; effects: each with the numbers of its
    parameters; laws: nonlinear torques, which no matrix knows; coriolis (n, n): C_0 of a robot that moves,
    the only matrix without symmetry, or None; driven: numbers of the joints, from 1, whose motors' torques
    are inputs, so that nothing else holds their rotors.
    """

    site: Site
    parameters: tuple[Parameter, ...]
    coordinates: tuple[str, ...]
    free: Index
    mass: Array
    stiffness: Array
    terms: dict[str, Stack]
    factors: Factors
    effects: tuple[tuple[Effect, Index], ...]
    laws: tuple[PlacedLaw, ...] = ()
    coriolis: Array | None = None
    compliances: Compliances | None = None
    driven: frozenset[int] = frozenset()

    @cached_property
    def is_hysteretic(self) -> bool:
        """Whether anything is damped by hysteresis, which has no free motion in time."""
        return self.terms["hysteretic"].any()

    def matrices(self, values: Array) -> tuple[Array, Array, Array]:
        """M, C, K (..., n, n) at parameter values (..., parameters); K is complex where there is hysteretic
        damping.  Springs given by compliance are as stiff as numbers allow where they are rigid.
        """
        mass, damping, stiffness = self.bare(values)
        if self.compliances is None:
            return mass, damping, stiffness
        flat, held = values.reshape(-1, values.shape[-1]), mass.reshape(-1, *mass.shape[-2:])
        springs = [self.compliances.stiff(one, m) for one, m in zip(flat, held, strict=True)]
        k, c = (np.array(some).reshape(mass.shape) for some in zip(*springs, strict=True))
        return mass, damping + c, stiffness + k

    def bare(self, values: Array) -> tuple[Array, Array, Array]:
        """The same without springs that are given by compliance."""
        k, c, m = (self.terms[role].weighted(values) for role in ("stiffness", "damping", "mass"))
        if self.is_hysteretic:
            k = k + 1j * self.terms["hysteretic"].weighted(values)
        return self.mass + m, c if self.coriolis is None else c + self.coriolis, self.stiffness + k

    def with_more(self, mass: Array, stiffness: Array) -> System:
        """The system with more mass and stiffness, (n, n), or (m, n, n) for a population."""
        more = replace(self, mass=self.mass + mass, stiffness=self.stiffness + stiffness)
        vars(more)["is_hysteretic"] = self.is_hysteretic  # of the same terms
        return more

    def jacobian(self, frame: str, point: Array, where: str = "points") -> Array:
        """(6, n): motion of a point (3,), m, of a frame, in the frame's axes, per free coordinate."""
        return self.site.jacobian(frame, point, where)[:, self.free]

    def motor(self, joint: int, where: str) -> Array:
        """(n,): turn of a joint's motor at the gear output per free coordinate; InputError where no rotor
        turns by itself in the model.
        """
        name = rotor(joint)
        if name in self.site.coordinates and name not in self.coordinates:
            found = (
                f"channel joint{joint}:motor, but a rotor that is held fast, because its torque is no input"
            )
            raise InputError(where, found, "what holds it", "give `holding_stiffness: {}` in its effect")
        if name not in self.coordinates:
            effect = (
                f"{{kind: rotor-inertia, joints: [{joint}], gear_ratio: [100], inertia: {{initial: 1.0e-4}},"
            )
            raise InputError(
                where,
                f"channel joint{joint}:motor, but no rotor of joint {joint} that turns by itself",
                "a rotor in the model, with its friction",
                f"add `- {effect} friction: {{}}}}` to `effects`, with the data sheet's values",
            )
        return np.asarray(np.array(self.coordinates) == name, dtype=float)

    def base_jacobian(self, frame: str, point: Array) -> Array:
        """(3, n): translation of a point (3,), m, of a frame, in the base's axes, per free coordinate."""
        return self.site.base_jacobian(frame, point, "points")[:, self.free]


def rotor(joint: int) -> str:
    """The coordinate of a joint's rotor, where it turns by itself."""
    return f"joint{joint}.rotor"


def build_site(
    robot: Robot,
    posture: Array,
    effects: Sequence[Effect],
    first_detached: str | None = None,
    points: Mapping[int, Point] | None = None,
    reference: Site | None = None,
    engine: Engine | None = None,
) -> Site:
    """The robot at `posture` (joints,), rad, with the coordinates that effects add; links from
    `first_detached` on taken off.

    reference: the whole robot at the first posture, which scales start values; by default at this posture.
    engine: that of the same robot and links at this posture, if it is there already.
    """
    tested = robot
    if first_detached is not None:
        tested = robot.detach(first_detached, "detached")
        reference = reference or build_site(robot, posture, effects, points=points)
    engine = engine or Engine(at_posture(tested, posture[: len(tested.joints)]))
    mechanism = engine.mechanism
    gone = _gone(robot, tested)
    added, again = _added(robot, mechanism, effects)
    gone |= {one.name for one in added if one.link in gone}
    kept = [one for one in added if one.name not in gone]
    own = mechanism.coordinates
    _check_once([one.name for one in kept if one.name not in own])
    names = (*own, *(one.name for one in kept if one.name not in own))
    shapes, lifts = _shapes(mechanism, names, kept, gone)
    deformations = {names.index(one.name): (one.link, one.deformation) for one in kept if one.deformation}
    mass = shapes.T @ engine.mass_matrix() @ shapes
    there = {node: point for node, point in (points or {}).items() if point.link not in gone}
    site = Site(engine, names, shapes, lifts, mass, deformations, there, frozenset(gone), reference)
    return replace(site, mass=np.sum([mass, *_consistent_masses(robot, site, effects, again)], axis=0))


def _added(robot: Robot, mechanism: Mechanism, effects: Sequence[Effect]) -> tuple[list[Added], set[int]]:
    """What effects bring, and the numbers of those whose coordinates another has brought."""
    added, again = list[Added](), set[int]()
    for number, effect in enumerate(effects):
        with errors_of(effect, number):
            brought = effect.added_coordinates(robot, mechanism)
        _check_one_place(number, effect, brought, added)
        if brought and all(one in added for one in brought):
            again.add(number)
        else:
            added += brought
    return added, again


def _check_one_place(number: int, effect: Effect, brought: Sequence[Added], added: Sequence[Added]) -> None:
    """InputError where the springs of a bearing act at two places."""
    places = {one.name: one for one in added if one.lifts}
    if any(places.get(one.name, one) != one for one in brought if one.lifts):
        found = f"{effect.sentence()}, elsewhere than in an effect above"
        raise InputError(f"effects.{number}.at_m", found, "one place of the springs of a joint")


def _check_once(names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError("effects", f"two effects bring {name}", "one with all its axes", "merge them")


def _shapes(
    mechanism: Mechanism, names: Sequence[str], kept: Sequence[Added], gone: set[str]
) -> tuple[Array, Array]:
    """Motion of the engine's coordinates per coordinate, of which its own are the first, and its second
    derivatives.
    """
    shapes = np.eye(len(mechanism.coordinates), len(names))
    lifts = np.zeros(shapes.shape)
    for one in kept:
        for matrix, moved in ((shapes, one.engine), (lifts, one.lifts)):
            for name, amount in moved.items():
                if name not in gone:
                    matrix[mechanism.coordinate(name, "effects"), names.index(one.name)] = amount
    return shapes, lifts


def _gone(robot: Robot, tested: Robot) -> set[str]:
    """Names of the links, frames and joint coordinates that were taken off for a test."""
    joints = range(len(tested.joints) + 1, len(robot.joints) + 1)
    links = {link.name for link in robot.links[len(tested.links) :]}
    frames = set(robot.frames) - set(tested.frames)
    return links | frames | {f"joint{number}.{axis}" for number in joints for axis in AXES}


def _consistent_masses(
    robot: Robot, site: Site, effects: Sequence[Effect], again: Collection[int]
) -> list[Array]:
    """again: numbers of effects whose coordinates another has brought, as two springs of one mount do: the
    body that moves with them counts once, and has to be the same one.
    """
    masses: list[Array] = []
    for number, effect in enumerate(effects):
        with errors_of(effect, number):
            matrix = effect.consistent_mass(robot, site)
            check_matrix(effect, "the consistent mass", matrix, len(site.coordinates))
        if matrix is None:
            continue
        if number not in again:
            masses.append(matrix)
        elif not any(np.array_equal(matrix, one) for one in masses):
            found = f"{effect.sentence()}, elsewhere than in an effect above"
            raise InputError(f"effects.{number}", found, "one place of what they carry")
    return masses


def list_parameters(robot: Robot, site: Site, effects: Sequence[Effect]) -> list[Parameter]:
    """The parameters of all effects in their order, as `assemble` has them."""
    return [term.parameter for terms in _terms(robot, site, effects) for term in terms]


def _terms(robot: Robot, site: Site, effects: Sequence[Effect]) -> list[list[Term]]:
    """The terms of each effect; InputError where two effects claim the same parameter."""
    found: list[list[Term]] = []
    taken: set[str] = set()
    for number, effect in enumerate(effects):
        with errors_of(effect, number):
            terms = effect.terms(robot, site, f"effects.{number}")
            check_terms(effect, terms, len(site.coordinates))
        names = {term.parameter.name for term in terms}
        if taken & names:
            problem = f"parameter {min(taken & names)} is claimed by an effect above too"
            raise InputError(f"effects.{number}", problem, "each coordinate once")
        taken |= names
        found.append(terms)
    return found


def free_coordinates(robot: Robot, effects: Sequence[Effect]) -> set[str]:
    """The coordinates that effects let move."""
    free: set[str] = set()
    for number, effect in enumerate(effects):
        with errors_of(effect, number):
            free.update(effect.free_coordinates(robot))
    return free


def assemble(
    robot: Robot,
    site: Site,
    effects: Sequence[Effect],
    rates: Array | None = None,
    driven: frozenset[int] = frozenset(),
    since: int = 0,
) -> System:
    """The system at one posture, with joint rates (joints,), rad/s, if the robot moves, and the torques of
    the motors of some joints as inputs; raises InputError where nothing can move, or where two effects claim
    the same parameter.

    since: number of the first effect whose parameters and terms it has; those before let coordinates move
    and no more.
    """
    loose = frozenset(rotor(joint) for joint in driven)
    names = free_coordinates(robot, effects)
    names -= {name for effect in effects for name in effect.held_fast(robot)} - loose
    free = np.array([index for index, name in enumerate(site.coordinates) if name in names], dtype=int)
    if not free.size:
        raise InputError(
            "effects",
            "no coordinate is free, so nothing can move",
            "a compliance",
            "add `kind: joint-compliance`",
        )
    by_effect = _terms(robot, site, effects[since:])
    every = [_let_go(term, site, loose) for terms in by_effect for term in terms]
    last = np.cumsum([len(terms) for terms in by_effect])
    pick = np.ix_(free, free)
    stacks, factors = _reduce(every, pick)
    return System(
        site,
        tuple(term.parameter for term in every),
        tuple(site.coordinates[index] for index in free),
        free,
        site.mass[pick],
        site.gravity_stiffness[pick],
        stacks,
        factors,
        tuple(
            (effect, np.arange(end - len(terms), end))
            for effect, terms, end in zip(effects[since:], by_effect, last, strict=True)
        ),
        _placed(every),
        None if rates is None else _coriolis(site, rates)[pick],
        _compliant(every, free),
        driven,
    )


def _let_go(term: Term, site: Site, loose: frozenset[str]) -> Term:
    """A term without the torques by which it holds a rotor that is loose."""
    if term.holds not in loose:
        return term
    rest = 1.0 - site.vector(term.holds)

    def without(matrix: Array | None) -> Array | None:
        return None if matrix is None else matrix * np.outer(rest, rest)

    return replace(term, stiffness=without(term.stiffness), damping=without(term.damping), compliance=None)


def _compliant(terms: Sequence[Term], free: Index) -> Compliances | None:
    """The springs that are given by compliance, over the free coordinates."""
    pick = np.ix_(free, free)
    given = [(n, term.compliance[pick]) for n, term in enumerate(terms) if term.compliance is not None]
    if not given:
        return None
    springs = np.array([number for number, _ in given])
    owner, amount, vectors = _thin(np.array([matrix for _, matrix in given]))
    kept = amount > 0
    columns = vectors[kept].T * np.sqrt(amount[kept])
    return Compliances(columns, owner[kept], springs, springs + 1)


def _placed(terms: Sequence[Term]) -> tuple[PlacedLaw, ...]:
    """The nonlinear torques with the numbers of their parameters."""
    numbers: dict[Torque, list[int]] = {}
    for number, term in enumerate(terms):
        if term.torque is not None:
            numbers.setdefault(term.torque, []).append(number)
    return tuple(PlacedLaw(one.law, one.coordinate, np.array(own)) for one, own in numbers.items())


def _coriolis(site: Site, rates: Array) -> Array:
    """(n, n): Coriolis and centrifugal forces per rate of the coordinates, linearised where the joints turn
    at rates (joints,).
    """
    own = site.engine.mechanism.coordinates
    turning = np.zeros(len(own))
    for number, rate in enumerate(rates, start=1):
        if f"joint{number}.rz" in own:
            turning[own.index(f"joint{number}.rz")] = rate
    return np.asarray(site.shapes.T @ site.engine.coriolis(turning) @ site.shapes)


def _reduce(every: Sequence[Term], pick: tuple[Index, ...]) -> tuple[dict[str, Stack], Factors]:
    """The terms over the free coordinates, as stacks and as thin columns."""
    size = pick[0].size
    terms, changes = dict[str, Stack](), list[Change]()
    for role, (exponent, factor) in _ROLES.items():
        given = [(number, getattr(term, role)) for number, term in enumerate(every)]
        own = [(number, matrix[pick]) for number, matrix in given if matrix is not None]
        terms[role] = Stack.of(own, len(every), size)
        changes += [Change(matrix, exponent, number, factor) for number, matrix in own]
    return terms, factored(changes, size)


def factored(changes: Iterable[Change], size: int) -> Factors:
    """Changes of so many coordinates as thin columns: the eigenvectors of each matrix, without those whose
    eigenvalue is nothing beside its largest.
    """
    every = list(changes)
    power, owner = (np.array([getattr(one, name) for one in every], dtype=int) for name in ("power", "owner"))
    factor = np.array([one.factor for one in every])
    if not np.any(np.imag(factor)):
        factor = np.real(factor)
    change, weight, vectors = _thin(np.array([one.matrix for one in every]).reshape(-1, size, size))
    return Factors(vectors.T, power[change], weight * factor[change], owner[change])


def _thin(matrices: Array) -> tuple[Index, Array, Array]:
    """Number of the matrix (columns,), eigenvalue (columns,) and eigenvector (columns, n) of each column, of
    matrices (m, n, n) which touch few coordinates each: decomposed over these, those that touch as many at
    once.
    """
    touched: Mask = np.any(matrices, axis=1)
    count, size = touched.sum(axis=1), matrices.shape[-1]
    found = [(np.zeros(0, dtype=int), np.zeros(0), np.zeros((0, size)))]
    for some in np.unique(count[count > 0]):
        own = np.flatnonzero(count == some)
        at = np.nonzero(touched[own])[1].reshape(-1, some)
        values, directions = np.linalg.eigh(matrices[own[:, None, None], at[:, :, None], at[:, None, :]])
        kept = np.abs(values) > _NOTHING * np.abs(values).max(axis=1, keepdims=True)
        which = np.nonzero(kept)[0]
        vectors = np.zeros((len(which), size))
        np.put_along_axis(vectors, at[which], np.swapaxes(directions, 1, 2)[kept], axis=1)
        found.append((own[which], values[kept], vectors))
    change, weight, vectors = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.argsort(change, kind="stable")
    return change[order], weight[order], vectors[order]
