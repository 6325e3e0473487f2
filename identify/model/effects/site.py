"""A robot at a posture, ready for effects to act on: every coordinate by name, what it moves, and the points
of the measurement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from identify.core.arrays import Array
from identify.robot.engine import Engine
from identify.robot.points import Point

Deformation = Callable[[Array], Array]
_LEAST_CARRIED = 1 / 30
"""Of the inertia that a drive is made for, by that of the drive before it."""


@dataclass(frozen=True)
class Added:
    """A coordinate that an effect brings, and what one unit of it moves; or one of the engine's own, and what
    else moves along with it.

    link: the link it belongs to; it is gone where that link was taken off for a test. engine: the engine's
    coordinates that follow it, and how far each; those of links taken off do not count. deformation:
    displacement and rotation (6,) of a point (3,), m, of the link, all in the link's axes, where the link
    itself deforms.  lifts: second derivatives of the engine's coordinates, which the weight of what moves
    feels.
    """

    name: str
    link: str
    engine: Mapping[str, float] = field(default_factory=dict)
    deformation: Deformation | None = None
    lifts: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Site:
    """A mechanism with every coordinate by name.

    shapes (engine coordinates, n): motion of the engine's coordinates per coordinate, lifts (engine
    coordinates, n): second derivatives by each coordinate; deformations: the link
    that a coordinate, by its number, deforms, and how; mass (n, n): the mass matrix before any parameter;
    points: the measurement points by node. Where links were detached for the test, the names of their
    coordinates and frames are in `detached`: they contribute nothing. first: the whole robot at the first
    posture, where that is another site.
    """

    engine: Engine
    coordinates: tuple[str, ...]
    shapes: Array
    lifts: Array
    mass: Array = field(repr=False)
    deformations: Mapping[int, tuple[str, Deformation]] = field(default_factory=dict)
    points: Mapping[int, Point] = field(default_factory=dict)
    detached: frozenset[str] = frozenset()
    first: Site | None = field(default=None, repr=False)

    @property
    def reference(self) -> Site:
        """The whole robot at the first posture, whose inertia scales start values."""
        return self.first or self

    def number(self, coordinate: str) -> int:
        """Number of a coordinate; one that does not exist is an InputError."""
        if coordinate in self.coordinates:
            return self.coordinates.index(coordinate)
        return self.engine.mechanism.coordinate(coordinate, "effects")  # says why there is none

    def vector(self, coordinate: str) -> Array:
        """(n,) with a one at `coordinate`; zero where that is detached."""
        vector = np.zeros(len(self.coordinates))
        if coordinate not in self.detached:
            vector[self.number(coordinate)] = 1.0
        return vector

    def unit(self, coordinate: str) -> Array:
        """(n, n) with a single one on the diagonal, at `coordinate`; zero where that is detached."""
        return np.diag(self.vector(coordinate))

    def inertia(self, coordinate: str) -> float:
        """The inertia that the coordinate moves at the reference when all others are locked, kg or kg m^2."""
        index = self.reference.number(coordinate)
        return float(self.reference.mass[index, index])

    def carried(self, coordinate: str) -> float:
        """The inertia that a spring there is made for, kg or kg m^2: of a drive at least a share of that of
        the drive before it, because a flange without a tool carries next to nothing.
        """
        own, (body, _, axis) = self.inertia(coordinate), coordinate.partition(".")
        number = body.removeprefix("joint")
        before = f"joint{int(number) - 1}.rz" if number.isdigit() and axis == "rz" else ""
        if before not in self.reference.coordinates:
            return own
        return max(own, _LEAST_CARRIED * self.carried(before))

    @cached_property
    def _deformed(self) -> dict[str, list[tuple[int, Deformation]]]:
        """The columns that deform each link, and how."""
        found = dict[str, list[tuple[int, Deformation]]]()
        for column, (link, deformation) in self.deformations.items():
            found.setdefault(link, []).append((column, deformation))
        return found

    @cached_property
    def gravity_stiffness(self) -> Array:
        """K_g (n, n): derivative of the generalised gravity forces of everything that has a weight without a
        parameter.
        """
        own = self.shapes.T @ self.engine.gravity_stiffness() @ self.shapes
        return np.asarray(own + np.diag(self.engine.gravity_forces() @ self.lifts))

    def jacobian(self, frame: str, point: Array, where: str) -> Array:
        """(6, n): motion of a point (3,) of a frame, in the frame's axes, per coordinate."""
        if frame in self.detached:
            return np.zeros((6, len(self.coordinates)))
        motion = self.engine.jacobian(frame, point, where) @ self.shapes
        mechanism = self.engine.mechanism
        body, pose = mechanism.frame(frame, where)
        for link, columns in self._deformed.items():
            owner, link_pose = mechanism.frames[link]
            if owner == body:
                inside = link_pose[:3, :3].T @ (pose[:3, :3] @ point + pose[:3, 3] - link_pose[:3, 3])
                turn = pose[:3, :3].T @ link_pose[:3, :3]
                for column, deformation in columns:
                    motion[:, column] += (deformation(inside).reshape(2, 3) @ turn.T).ravel()
        return np.asarray(motion)

    def base_jacobian(self, frame: str, point: Array, where: str) -> Array:
        """(3, n): translation of a point (3,) of a frame, in the base's axes, per coordinate."""
        if frame in self.detached:
            return np.zeros((3, len(self.coordinates)))
        motion = self.jacobian(frame, point, where)[:3]
        return self.engine.axes(frame) @ motion

    def gravity(self, frame: str) -> Array:
        """(3,), m/s^2, in the axes of a frame; zero where that is detached."""
        if frame in self.detached:
            return np.zeros(3)
        return self.engine.axes(frame).T @ self.engine.mechanism.gravity

    def weight_stiffness(self, frame: str, point: Array, where: str) -> Array:
        """(n, n) per kg: gravity stiffness of a point mass at a point (3,) of a frame that does not
        deform.
        """
        if frame in self.detached:
            return np.zeros((len(self.coordinates),) * 2)
        own = self.shapes.T @ self.engine.weight_stiffness(frame, point, where) @ self.shapes
        held = -self.gravity(frame) @ self.engine.jacobian(frame, point, where)[:3]
        return np.asarray(own + np.diag(held @ self.lifts))
