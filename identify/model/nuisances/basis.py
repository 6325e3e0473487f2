"""What a robot at a posture changes by where links, joint angles and link lengths are not as stated: matrices
over the engine's coordinates, which no effect changes, so that they are computed once for each measurement.

Small rotations by rotation vectors, and their exact derivatives (right Jacobian of SO(3); Chirikjian
2012).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from identify.core.arrays import Array, Index, cross_matrix
from identify.model.effects.rigid_body import rigid_body
from identify.model.nuisances.inertia import moments
from identify.robot.description import Link, Robot
from identify.robot.engine import Engine
from identify.robot.points import Point
from identify.robot.posture import at_posture

_ANGLE, _LENGTH = 1e-3, 1e-4
"""Changes, rad and m, for central differences; what they leave out is 1e-6 of a derivative."""
WEIGHTED = 4
"""Of the ten inertial parameters of a link, the first four have a weight."""
Variant = tuple[tuple[Robot, Array], tuple[Robot, Array], float]
_SMALL = 1e-4
"""Angle, rad, below which series replace quotients of vanishing numbers."""


@dataclass(frozen=True)
class Geometry:
    """Change of a robot at a posture per unit of something stated of its geometry: M and K_g (n, n), motion
    of points (points, 6, n) as `Engine.jacobian` has it.
    """

    mass: Array
    stiffness: Array
    motion: Array

    @cached_property
    def heavy(self) -> bool:
        """Whether it changes M or K_g, not only how points move."""
        return bool(np.any(self.mass) or np.any(self.stiffness))

    @cached_property
    def moving(self) -> bool:
        """Whether it changes how points move."""
        return bool(np.any(self.motion))


@dataclass(frozen=True)
class Basis:
    """links: those with inertia; mass (links, 10, n, n): mass matrix per unit of each inertial parameter;
    weight (links, 4, n, n): gravity stiffness per unit of the first four; zero for links that were taken off.
    geometry: per unit of each angle (rad) of a joint, then of each coordinate (m) of a joint's place in its
    parent link, where asked for.
    """

    links: tuple[Link, ...]
    mass: Array
    weight: Array
    geometry: tuple[Geometry, ...]

    @cached_property
    def nominal(self) -> Array:
        """Inertial parameters (links, 10) as stated."""
        return moments(self.links, np.zeros((len(self.links), 10)))[0]

    @cached_property
    def heavy(self) -> Index:
        """Numbers of the changes of geometry that change M or K_g."""
        return np.array([n for n, one in enumerate(self.geometry) if one.heavy], dtype=int)

    def added(self, off: Array) -> tuple[Array, Array]:
        """What inertial parameters (..., links, 10) off what was stated add to M and K_g, (..., n, n)
        each.
        """
        return np.tensordot(off, self.mass, axes=2), np.tensordot(off[..., :WEIGHTED], self.weight, axes=2)


def basis(
    robot: Robot,
    posture: Array,
    points: Sequence[Point],
    detached: str | None,
    *,
    angles: bool,
    lengths: bool,
) -> Basis:
    """The basis of a robot at a posture (joints,), rad; angles, lengths: which part of the geometry is
    uncertain.
    """
    tested = robot if detached is None else robot.detach(detached, "detached")
    engine = Engine(at_posture(tested, posture[: len(tested.joints)]))
    links = tuple(link for link in robot.links if link.mass > 0)
    there = {link.name for link in tested.links}
    size = len(engine.mechanism.coordinates)
    mass, weight = np.zeros((len(links), 10, size, size)), np.zeros((len(links), WEIGHTED, size, size))
    for number, link in enumerate(links):
        if link.name in there:
            motion = engine.jacobian(link.name, np.zeros(3))
            mass[number] = rigid_body(motion[:3], motion[3:])
            weight[number] = _weights(engine, link.name)
    known = [*there, *tested.frames]
    variants = _variants(tested, posture[: len(tested.joints)], len(robot.joints), angles, lengths)
    own = [point if point.link in known else None for point in points]
    return Basis(links, mass, weight, tuple(_difference(pair, own, size) for pair in variants))


def _weights(engine: Engine, link: str) -> Array:
    """(4, n, n): gravity stiffness of a unit mass at the origin of a link, and per unit of first moments."""
    here, *there = engine.weight_stiffnesses(link, np.vstack([np.zeros(3), np.eye(3)]))
    return np.array([here, *(one - here for one in there)])


def _variants(robot: Robot, posture: Array, joints: int, angles: bool, lengths: bool) -> list[Variant | None]:
    """Robots and postures to either side, with the distance between them; None for a joint that was taken
    off.
    """
    found: list[Variant | None] = []
    for number in range(joints if angles else 0):
        if number >= len(posture):
            found.append(None)
            continue
        step = _ANGLE * np.eye(len(posture))[number]
        found.append(((robot, posture + step), (robot, posture - step), 2 * _ANGLE))
    for number in range(joints if lengths else 0):
        for axis in range(3):
            if number >= len(posture):
                found.append(None)
                continue
            up, down = (moved(robot, number, axis, sign * _LENGTH) for sign in (1, -1))
            found.append(((up, posture), (down, posture), 2 * _LENGTH))
    return found


def moved(robot: Robot, number: int, axis: int, amount: float) -> Robot:
    """The robot with the place of a joint in its parent link moved."""
    joint = robot.joints[number]
    origin = joint.origin.copy()
    origin[axis, 3] += amount
    joints = list(robot.joints)
    joints[number] = replace(joint, origin=origin)
    return replace(robot, joints=tuple(joints))


def _difference(pair: Variant | None, points: Sequence[Point | None], size: int) -> Geometry:
    if pair is None:
        return Geometry(np.zeros((size, size)), np.zeros((size, size)), np.zeros((len(points), 6, size)))
    up, down, distance = pair
    engines = [Engine(at_posture(*one)) for one in (up, down)]
    masses, weights, motions = (
        [of(engine) for engine in engines]
        for of in (Engine.mass_matrix, Engine.gravity_stiffness, lambda engine: _motion(engine, points, size))
    )
    return Geometry(*((two[0] - two[1]) / distance for two in (masses, weights, motions)))


def _motion(engine: Engine, points: Sequence[Point | None], size: int) -> Array:
    """(points, 6, n): motion of points in the axes of their links."""
    rows = [
        np.zeros((6, size)) if point is None else engine.jacobian(point.link, point.position)
        for point in points
    ]
    return np.array(rows).reshape(len(points), 6, size)


def reduced(basis: Basis, shapes: Array) -> Basis:
    """The basis over other coordinates; shapes (engine coordinates, n): what a unit of each moves."""

    def both(matrices: Array) -> Array:
        return np.asarray(shapes.T @ matrices @ shapes)

    geometry = tuple(
        Geometry(both(one.mass), both(one.stiffness), one.motion @ shapes) for one in basis.geometry
    )
    return Basis(basis.links, both(basis.mass), both(basis.weight), geometry)


def turn_slope(turn: Array) -> tuple[Array, Array]:
    """R (n, 3, 3) of rotation vectors (n, 3), rad, and Jr (n, 3, 3) with d(R u) = -R (u x Jr d turn)."""
    angle, cross = np.linalg.norm(turn, axis=-1)[:, None, None], cross_matrix(turn)
    small = angle < _SMALL
    far = np.where(small, 1.0, angle)
    first = np.where(small, 0.5, (1 - np.cos(far)) / far**2)
    second = np.where(small, 1 / 6, (far - np.sin(far)) / far**3)
    rotation = scipy.spatial.transform.Rotation.from_rotvec(turn).as_matrix()
    return rotation, np.eye(3) - first * cross + second * cross @ cross
