"""Rotations and mass properties of simple solids."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def turn(axis: ArrayLike, angle: float) -> Array:
    """Rotation matrix (3, 3) by `angle` (rad) about `axis` (3,) of any length (Rodrigues)."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + sin(angle) * cross + (1 - cos(angle)) * cross @ cross)


def from_rpy(rpy: ArrayLike) -> Array:
    """Rotation matrix of a URDF's roll, pitch, yaw (rad): about the fixed x, then y, then z."""
    roll, pitch, yaw = np.asarray(rpy, dtype=float)
    return turn([0, 0, 1], yaw) @ turn([0, 1, 0], pitch) @ turn([1, 0, 0], roll)


def to_rpy(rotation: Array) -> Array:
    """Roll, pitch, yaw (3,), rad, of a rotation matrix; roll is 0 where pitch is +-90 degrees."""
    pitch = atan2(-rotation[2, 0], hypot(rotation[0, 0], rotation[1, 0]))
    if abs(cos(pitch)) < 1e-9:
        return np.array([0.0, pitch, atan2(-rotation[0, 1], rotation[1, 1])])
    return np.array([atan2(rotation[2, 1], rotation[2, 2]), pitch, atan2(rotation[1, 0], rotation[0, 0])])


def frame_with_z(axis: ArrayLike) -> Array:
    """A rotation matrix whose third column is `axis` (3,); its first is the coordinate axis most
    perpendicular to it, made square.
    """
    z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    x = np.eye(3)[np.argmin(np.abs(z))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@dataclass(frozen=True)
class Inertia:
    """Mass (kg), centre of mass (3,) (m) and inertia tensor (3, 3) (kg m^2) about that centre, in one
    frame.
    """

    mass: float
    centre: Array
    tensor: Array

    def __add__(self, other: Inertia) -> Inertia:
        """Both as one rigid body (parallel-axis theorem)."""
        mass = self.mass + other.mass
        centre = (self.mass * self.centre + other.mass * other.centre) / mass
        return Inertia(mass, centre, self.about(centre) + other.about(centre))

    def about(self, point: ArrayLike) -> Array:
        """Inertia tensor (3, 3) about `point` (3,)."""
        d = self.centre - np.asarray(point, dtype=float)
        return np.asarray(self.tensor + self.mass * (d @ d * np.eye(3) - np.outer(d, d)))

    def seen_from(self, rotation: Array, position: ArrayLike) -> Inertia:
        """The same body in another frame, in which this one has `rotation` (3, 3) and `position` (3,)."""
        return Inertia(
            self.mass,
            rotation @ self.centre + np.asarray(position, dtype=float),
            rotation @ self.tensor @ rotation.T,
        )

    def about_axis(self, point: ArrayLike, axis: ArrayLike) -> float:
        """Moment of inertia (kg m^2) about the line through `point` along `axis`."""
        unit = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
        return float(unit @ self.about(point) @ unit)


def ball(mass: float, centre: ArrayLike, radius: float) -> Inertia:
    """A solid sphere."""
    return Inertia(mass, np.asarray(centre, dtype=float), 0.4 * mass * radius**2 * np.eye(3))


def box(mass: float, centre: ArrayLike, size: ArrayLike) -> Inertia:
    """A solid box with edges `size` (3,) along the axes."""
    squares = np.square(np.asarray(size, dtype=float))
    return Inertia(mass, np.asarray(centre, dtype=float), np.diag(mass / 12 * (squares.sum() - squares)))


def cylinder(mass: float, start: ArrayLike, end: ArrayLike, radius: float) -> Inertia:
    """A solid cylinder between two points on its axis."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    along = (b - a) / np.linalg.norm(b - a)
    across = mass * (3 * radius**2 + (b - a) @ (b - a)) / 12
    tensor = across * np.eye(3) + (mass * radius**2 / 2 - across) * np.outer(along, along)
    return Inertia(mass, (a + b) / 2, tensor)
