"""Assembly of robot, posture and effects to a linear system whose matrices are affine in the parameters.

    M(p) = M_0 + sum_j p_j M_j,  C(p) = C_0 + sum_j p_j C_j,  K(p) = K_g + sum_j p_j (K_j + j H_j)

over the released coordinates only; a locked coordinate has no row.  Each M_j, C_j, K_j, H_j has low rank and
is kept as factors, so that sensitivities cost a product of thin matrices (`identify.model.frf`).  K is real
where there is no hysteretic damping H; where there is, the model holds for positive frequencies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.model.effects.base import Contribution, Effect
from identify.model.effects.nonlinear import NonlinearEffect, PlacedLaw
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.points import Point
from identify.robot.posture import AXES, at_posture

_ROLES = {"stiffness": (0, 1.0), "damping": (1, 1.0), "mass": (2, 1.0), "hysteretic": (0, 1.0j)}
"""Power of s and factor with which a contribution enters the dynamic stiffness."""


@dataclass(frozen=True)
class Factors:
    """dZ/dp as a sum over columns r of weight_r s^power_r a_r a_r', each owned by one parameter.

    vectors (n, r); power (r,): 0 stiffness, 1 damping, 2 mass; weight (r,), imaginary for hysteretic damping;
    owner (r,): number of the parameter.
    """

    vectors: Array
    power: NDArray[np.intp]
    weight: Array | NDArray[np.complex128]
    owner: NDArray[np.intp]


@dataclass(frozen=True)
class System:
    """The model at one posture.

    coordinates: names of the n released coordinates; mass, stiffness (n, n): the parts that no parameter
    moves; terms: per role a (parameters, n, n) stack; factors: the same as thin columns; effects: each with
    the numbers of its parameters; laws: nonlinear torques, which no matrix knows; coriolis (n, n): C_0 of a
    robot that moves, the only matrix without symmetry, or None.
    """

    site: Site
    coordinates: tuple[str, ...]
    released: NDArray[np.intp]
    mass: Array
    stiffness: Array
    terms: dict[str, Array]
    factors: Factors
    effects: tuple[tuple[Effect, NDArray[np.intp]], ...]
    laws: tuple[PlacedLaw, ...] = ()
    coriolis: Array | None = None

    def matrices(self, values: Array) -> tuple[Array, Array, Array]:
        """M, C, K (..., n, n) at parameter values (..., parameters); K is complex where there is hysteretic
        damping.
        """
        k, c, m = (
            np.tensordot(values, self.terms[role], axes=1) for role in ("stiffness", "damping", "mass")
        )
        if np.any(self.terms["hysteretic"]):
            k = k + 1j * np.tensordot(values, self.terms["hysteretic"], axes=1)
        return self.mass + m, c if self.coriolis is None else c + self.coriolis, self.stiffness + k

    def jacobian(self, frame: str, point: Array, where: str = "points") -> Array:
        """(6, n): motion of a point (3,), m, of a frame, in the frame's axes, per released coordinate."""
        return self.site.jacobian(frame, point, where)[:, self.released]

    def base_jacobian(self, frame: str, point: Array) -> Array:
        """(3, n): translation of a point (3,), m, of a frame, in the base's axes, per released coordinate."""
        return self.site.base_jacobian(frame, point, "points")[:, self.released]


def build_site(
    robot: Robot,
    posture: Array,
    effects: Sequence[Effect],
    first_detached: str | None = None,
    points: Mapping[int, Point] | None = None,
) -> Site:
    """The robot at `posture` (joints,), rad, with the bodies and coordinates that effects add; links from
    `first_detached` on taken off.
    """
    tested = robot if first_detached is None else robot.detach(first_detached, "detached")
    mechanism = at_posture(tested, posture[: len(tested.joints)])
    for effect in effects:
        mechanism = effect.attach(mechanism, tested)
    gone = {link.name for link in robot.links[len(tested.links) :]} | (set(robot.frames) - set(tested.frames))
    gone |= {
        f"joint{number}.{axis}"
        for number in range(len(tested.joints) + 1, len(robot.joints) + 1)
        for axis in AXES
    }
    added = [one for effect in effects for one in effect.added_coordinates(robot, mechanism)]
    gone |= {one.name for one in added if one.link in gone}
    kept = [one for one in added if one.name not in gone]
    own = mechanism.coordinates
    shapes = np.eye(len(own), len(own) + len(kept))
    for column, one in enumerate(kept, start=len(own)):
        for name, amount in one.engine.items():
            if name not in gone:
                shapes[mechanism.coordinate(name, "effects"), column] = amount
    deformations = {
        n: (one.link, one.deformation) for n, one in enumerate(kept, start=len(own)) if one.deformation
    }
    engine = Engine(mechanism)
    mass = shapes.T @ engine.mass_matrix() @ shapes
    there = {node: point for node, point in (points or {}).items() if point.link not in gone}
    names = (*own, *(one.name for one in kept))
    site = Site(engine, names, shapes, mass, deformations, there, frozenset(gone))
    brought = [matrix for effect in effects if (matrix := effect.consistent_mass(robot, site)) is not None]
    return replace(site, mass=np.sum([mass, *brought], axis=0))


def list_parameters(robot: Robot, site: Site, effects: Sequence[Effect]) -> list[Parameter]:
    """The parameters of all effects in their order; `site`, the whole robot at the first posture, scales
    defaults.

    Raises InputError where two effects claim the same parameter.
    """
    parameters: list[Parameter] = []
    for number, effect in enumerate(effects):
        new = effect.parameters(robot, site, f"effects.{number}")
        taken = {p.name for p in parameters} & {p.name for p in new}
        if taken:
            raise InputError(
                f"effects.{number}",
                f"parameter {min(taken)} is claimed by an effect above too",
                "each coordinate once",
            )
        parameters += new
    return parameters


def assemble(robot: Robot, site: Site, effects: Sequence[Effect], rates: Array | None = None) -> System:
    """The system at one posture, with joint rates (joints,), rad/s, if the robot moves; raises InputError
    where nothing is released.
    """
    free = {name for effect in effects for name in effect.free_coordinates(robot)}
    released = np.array([index for index, name in enumerate(site.coordinates) if name in free], dtype=int)
    if not released.size:
        raise InputError(
            "effects",
            "no coordinate is released, so nothing can move",
            "a compliance",
            "add `kind: joint-compliance`",
        )
    parts = [effect.contributions(robot, site) for effect in effects]
    last = np.cumsum([len(part) for part in parts])
    owners = tuple(
        (effect, np.arange(end - len(part), end))
        for effect, part, end in zip(effects, parts, last, strict=True)
    )
    pick = np.ix_(released, released)
    terms, factors = _reduce([contribution for part in parts for contribution in part], pick)
    names = tuple(site.coordinates[index] for index in released)
    laws = [
        law
        for effect, numbers in owners
        if isinstance(effect, NonlinearEffect)
        for law in effect.placed(robot, numbers)
    ]
    moving = None if rates is None else _coriolis(site, rates)[pick]
    return System(
        site,
        names,
        released,
        site.mass[pick],
        site.gravity_stiffness[pick],
        terms,
        factors,
        owners,
        tuple(laws),
        moving,
    )


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


def _reduce(
    contributions: list[Contribution], pick: tuple[NDArray[np.intp], ...]
) -> tuple[dict[str, Array], Factors]:
    """The contributions over the released coordinates, as stacks and as thin columns."""
    size = pick[0].size
    terms = {role: np.zeros((len(contributions), size, size)) for role in _ROLES}
    vectors, power, weight, owner = [], [], [], []
    for number, contribution in enumerate(contributions):
        for role, (exponent, factor) in _ROLES.items():
            matrix = getattr(contribution, role)
            if matrix is None:
                continue
            terms[role][number] = matrix[pick]
            eigenvalues, eigenvectors = np.linalg.eigh(matrix[pick])
            kept = np.abs(eigenvalues) > 1e-12 * np.abs(eigenvalues).max(initial=0.0)
            for value, vector in zip(eigenvalues[kept], eigenvectors[:, kept].T, strict=True):
                vectors.append(vector)
                power.append(exponent)
                weight.append(value * factor)
                owner.append(number)
    return terms, Factors(
        np.array(vectors).reshape(-1, size).T, np.array(power, int), np.array(weight), np.array(owner, int)
    )
