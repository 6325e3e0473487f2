"""Assembly of robot, posture and effects to a linear system whose matrices are affine in the parameters.

    M(p) = M_0 + sum_j p_j M_j,  C(p) = sum_j p_j C_j,  K(p) = K_g + sum_j p_j K_j

over the released coordinates only; a locked coordinate has no row.  Each M_j, C_j, K_j has low rank and is kept as
factors, so that sensitivities cost a product of thin matrices (`identify.model.frf`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.effects.base import Contribution, Effect, Parameter, Site
from identify.errors import InputError
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.posture import at_posture

Array = NDArray[np.float64]
_ROLES = ("stiffness", "damping", "mass")


@dataclass(frozen=True)
class Factors:
    """dZ/dp as a sum over columns r of weight_r s^power_r a_r a_r', each owned by one parameter.

    vectors (n, r); power (r,): 0 stiffness, 1 damping, 2 mass; weight (r,); owner (r,): number of the parameter.
    """

    vectors: Array
    power: NDArray[np.intp]
    weight: Array
    owner: NDArray[np.intp]


@dataclass(frozen=True)
class System:
    """The model at one posture.

    coordinates: names of the n released coordinates; mass, stiffness (n, n): the parts that no parameter moves;
    terms: per role a (parameters, n, n) stack; factors: the same as thin columns.
    """

    site: Site
    coordinates: tuple[str, ...]
    released: NDArray[np.intp]
    mass: Array
    stiffness: Array
    terms: dict[str, Array]
    factors: Factors

    def matrices(self, values: Array) -> tuple[Array, Array, Array]:
        """M, C, K (..., n, n) at parameter values (..., parameters)."""
        k, c, m = (np.tensordot(values, self.terms[role], axes=1) for role in _ROLES)
        return self.mass + m, c, self.stiffness + k

    def jacobian(self, frame: str, point: Array, where: str = "points") -> Array:
        """(6, n): motion of a point (3,), m, of a frame, in the frame's axes, per released coordinate."""
        return self.site.jacobian(frame, point, where)[:, self.released]

    def base_jacobian(self, frame: str, point: Array) -> Array:
        """(3, n): translation of a point (3,), m, of a frame, in the base's axes, per released coordinate."""
        axes = self.site.engine.axes(frame)
        return np.asarray(axes @ self.jacobian(frame, point)[:3])


def build_site(robot: Robot, posture: Array, effects: Sequence[Effect], first_detached: str | None = None) -> Site:
    """The robot at `posture` (joints,), rad, with the bodies and coordinates that effects add; links from `first_detached` on taken off."""
    tested = robot if first_detached is None else robot.detach(first_detached, "detached")
    mechanism = at_posture(tested, posture[: len(tested.joints)])
    for effect in effects:
        mechanism = effect.attach(mechanism, tested)
    engine = Engine(mechanism)
    own = mechanism.coordinates
    added = {name: source for effect in effects for name, source in effect.added_coordinates(robot).items() if source in ("", *own)}
    shapes = np.eye(len(own), len(own) + len(added))
    for column, source in enumerate(added.values(), start=len(own)):
        if source:
            shapes[own.index(source), column] = 1.0
    gone = {link.name for link in robot.links[len(tested.links) :]} | (set(robot.frames) - set(tested.frames))
    return Site(engine, (*own, *added), shapes, shapes.T @ engine.mass_matrix() @ shapes, frozenset(gone))


def list_parameters(robot: Robot, site: Site, effects: Sequence[Effect]) -> list[Parameter]:
    """The parameters of all effects in their order; `site`, the whole robot at the first posture, scales defaults.

    Raises InputError where two effects claim the same parameter.
    """
    parameters: list[Parameter] = []
    for number, effect in enumerate(effects):
        new = effect.parameters(robot, site, f"effects.{number}")
        taken = {p.name for p in parameters} & {p.name for p in new}
        if taken:
            raise InputError(f"effects.{number}", f"parameter {min(taken)} is claimed by an effect above too", "each coordinate once")
        parameters += new
    return parameters


def assemble(robot: Robot, site: Site, effects: Sequence[Effect]) -> System:
    """The system at one posture; raises InputError where nothing is released."""
    names = {name for effect in effects for name in effect.released(robot)}
    released = np.array([index for index, name in enumerate(site.coordinates) if name in names], dtype=int)
    if not released.size:
        raise InputError("effects", "no coordinate is released, so nothing can move", "a compliance", "add `kind: joint-compliance`")
    contributions = [part for effect in effects for part in effect.contributions(robot, site)]
    return _reduce(site, released, contributions)


def _reduce(site: Site, released: NDArray[np.intp], contributions: list[Contribution]) -> System:
    pick = np.ix_(released, released)
    size = len(released)
    terms = {role: np.zeros((len(contributions), size, size)) for role in _ROLES}
    vectors, power, weight, owner = [], [], [], []
    for number, contribution in enumerate(contributions):
        for exponent, role in enumerate(_ROLES):
            matrix = getattr(contribution, role)
            if matrix is None:
                continue
            terms[role][number] = matrix[pick]
            eigenvalues, eigenvectors = np.linalg.eigh(matrix[pick])
            kept = np.abs(eigenvalues) > 1e-12 * np.abs(eigenvalues).max(initial=0.0)
            for value, vector in zip(eigenvalues[kept], eigenvectors[:, kept].T, strict=True):
                vectors.append(vector)
                power.append(exponent)
                weight.append(value)
                owner.append(number)
    factors = Factors(np.array(vectors).reshape(-1, size).T, np.array(power, int), np.array(weight, float), np.array(owner, int))
    stiffness = site.shapes.T @ site.engine.gravity_stiffness() @ site.shapes
    names = tuple(site.coordinates[index] for index in released)
    return System(site, names, released, site.mass[pick], stiffness[pick], terms, factors)
