"""A cantilever in space: how its points move with five coordinates at its end, its stiffness, and a rigid
body cut into slices along it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.core.arrays import Array
from identify.model.effects.site import Deformation
from identify.robot.description import Link

_SLICES = 6
"""Gauss points along the link: exact for products of cubic shapes."""


@dataclass(frozen=True)
class Beam:
    """A uniform beam from start to end (3,), m, in a link's frame, that bends about the unit axes across (2,
    3), at right angles to it.

    The coordinates, in the order of NAMES: deflection (m) of the end along `across x axis` and slope (rad)
    about across, for the two planes; twist (rad) of the end.  Before its start nothing moves; what is beyond
    its end goes with it as a rigid body.
    """

    start: Array
    end: Array
    across: Array
    NAMES: ClassVar[tuple[str, ...]] = ("deflection_1", "slope_1", "deflection_2", "slope_2", "twist")

    @classmethod
    def between(cls, start: Array, end: Array, about: Array) -> Beam:
        """The beam from start to end, which must differ; it bends first about what of `about` (3,) is across
        it.
        """
        axis = (end - start) / np.linalg.norm(end - start)
        first = about - (about @ axis) * axis
        first /= np.linalg.norm(first)
        return cls(start, end, np.array([first, np.cross(axis, first)]))

    @property
    def length(self) -> float:
        """m."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def axis(self) -> Array:
        """(3,), unit, from start to end."""
        return (self.end - self.start) / self.length

    def deformations(self) -> list[Deformation]:
        """Displacement and rotation (6,) of a point (3,) for a unit of each coordinate."""
        bending = [self._bending(axis, turns=turns) for axis in self.across for turns in (False, True)]
        return [*bending, self._twist]

    def stiffness(self) -> Array:
        """K (3, 5, 5) per unit of EI in each plane and per unit of GJ."""
        length = self.length
        plane = np.array([[12.0, -6 * length], [-6 * length, 4 * length**2]]) / length**3
        matrices = np.zeros((3, 5, 5))
        matrices[0, :2, :2] = matrices[1, 2:4, 2:4] = plane
        matrices[2, 4, 4] = 1 / length
        return matrices

    def _station(self, point: Array) -> tuple[float, Array]:
        """Where along the beam, 0 to 1, and the lever (3,) from there."""
        along = float(np.clip((point - self.start) @ self.axis / self.length, 0.0, 1.0))
        return along, point - self.start - along * self.length * self.axis

    def _bending(self, about: Array, *, turns: bool) -> Deformation:
        """Cubic shapes of a unit slope of the end without deflection, or of a unit deflection without
        slope.
        """

        def moved(point: Array) -> Array:
            x, lever = self._station(point)
            deflection = self.length * (x**3 - x**2) if turns else 3 * x**2 - 2 * x**3
            slope = 3 * x**2 - 2 * x if turns else (6 * x - 6 * x**2) / self.length
            rotation = slope * about
            return np.concatenate(
                [deflection * np.cross(about, self.axis) + np.cross(rotation, lever), rotation]
            )

        return moved

    def _twist(self, point: Array) -> Array:
        x, lever = self._station(point)
        rotation = x * self.axis
        return np.concatenate([np.cross(rotation, lever), rotation])


def slices(body: Link, axis: Array) -> Iterator[tuple[float, Array, Array]]:
    """Mass, centre (3,) and inertia (3, 3) about it of slices of a body along an axis (3,), which together
    are the body.

    The mass is spread evenly over the length of a rod with the body's own second moment along the axis; the
    centres of the slices lie on the line of the body's mass at each station, so that what remains for each
    slice is a body too.
    """
    second = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia  # integral of r r' dm about the centre
    along = float(axis @ second @ axis)
    if body.mass <= 0 or along <= 0:
        return
    line = second @ axis / along
    rest = second - along * np.outer(line, line)
    stations, weights = np.polynomial.legendre.leggauss(_SLICES)
    for station, weight in zip(stations, weights / 2, strict=True):
        offset = station * np.sqrt(3 * along / body.mass)
        yield body.mass * weight, body.centre + offset * line, weight * (np.trace(rest) * np.eye(3) - rest)
