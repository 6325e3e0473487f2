"""A cantilever in space: how its points move with five coordinates at its end, and with three between its
ends or at the ends of its parts if it has several; its stiffness, and a rigid body cut into slices along it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np

from identify.core.arrays import Array, cross
from identify.model.effects.site import Deformation
from identify.robot.description import Link

_NAMES = ("deflection_1", "slope_1", "deflection_2", "slope_2", "twist")
_INNER = ("inner_deflection_1", "inner_deflection_2", "inner_twist")
_SLICES = 6
"""Gauss points along the link for each part: exact for products of all shapes."""


@dataclass(frozen=True)
class Beam:
    """A beam from start to end (3,), m, in a link's frame, that bends about the unit axes across (2, 3), at
    right angles to it; of so many parts of equal length, each of them uniform.

    The coordinates, in the order of names: deflection (m) of the end along `across x axis` and slope (rad)
    about across, for the two planes; twist (rad) of the end; the same first for the ends of the other parts,
    or, of one part, what its middle moves more in either plane (m) and in torsion (rad) while its ends stand:
    the polynomial that stands for its slowest mode then (Craig and Bampton, AIAA J. 6 (1968) 1313-1319), 0.3
    and 0.7 % above that of a uniform beam.
    Before its start nothing moves; what is beyond its end goes with it as a rigid body.
    """

    start: Array
    end: Array
    across: Array
    parts: int = 1

    @classmethod
    def between(cls, start: Array, end: Array, about: Array, parts: int = 1) -> Beam:
        """The beam from start to end, which must differ; it bends first about what of `about` (3,) is across
        it.
        """
        axis = (end - start) / np.linalg.norm(end - start)
        first = about - (about @ axis) * axis
        first /= np.linalg.norm(first)
        return cls(start, end, np.array([first, cross(axis, first)]), parts)

    @staticmethod
    def names(parts: int) -> list[str]:
        """Of the coordinates of a beam of so many parts."""
        inner = [f"{name}_at_{number}_of_{parts}" for number in range(1, parts) for name in _NAMES]
        return [*(inner or _INNER), *_NAMES]

    @staticmethod
    def of_end(names: Sequence[str]) -> Sequence[str]:
        """Those of names of coordinates that are the end's."""
        return names[-len(_NAMES) :]

    @cached_property
    def length(self) -> float:
        """m."""
        return float(np.linalg.norm(self.end - self.start))

    @cached_property
    def axis(self) -> Array:
        """(3,), unit, from start to end."""
        return (self.end - self.start) / self.length

    @cached_property
    def _sideways(self) -> Array:
        """(2, 3), unit: where the end goes in either plane."""
        return cross(self.across, self.axis)

    def deformations(self) -> list[Deformation]:
        """Displacement and rotation (6,) of a point (3,), or of several (..., 3), for a unit of each
        coordinate.
        """
        every = range(len(_NAMES))
        found = [partial(self._moved, node, one) for node in range(1, self.parts + 1) for one in every]
        return [*(partial(self._bulged, one) for one in range(len(_INNER)) if self.parts == 1), *found]

    def stiffness(self) -> Array:
        """K (3, parts, n, n) of each part per unit of its EI in either plane and per unit of its GJ."""
        size, one = self.length / self.parts, len(_NAMES)
        # By deflection and slope of both ends of a part; the start of the beam is held.
        far = np.array([[12.0, -6 * size], [-6 * size, 4 * size**2]]) / size**3
        near = far * [[1, -1], [-1, 1]]
        between = np.array([[-12.0, 6 * size], [-6 * size, 2 * size**2]]) / size**3
        plane, twist = (
            np.block([[near, between], [between.T, far]]),
            np.array([[1.0, -1.0], [-1.0, 1.0]]) / size,
        )
        matrices = np.zeros((3, self.parts, one * (self.parts + 1), one * (self.parts + 1)))
        for part in range(self.parts):
            for kind, (own, matrix) in enumerate((([0, 1], plane), ([2, 3], plane), ([4], twist))):
                ends = [one * node + number for node in (part, part + 1) for number in own]
                matrices[kind, part][np.ix_(ends, ends)] = matrix
        if self.parts > 1:
            return matrices[:, :, one:, one:]
        # Shapes that stand at both ends do no work against those that are bent from the ends.
        more = len(_INNER)
        found, kinds = np.zeros((3, 1, more + one, more + one)), np.arange(more)
        found[..., more:, more:] = matrices[:, :, one:, one:]
        found[kinds, 0, kinds, kinds] = 1024 / 5 / size**3, 1024 / 5 / size**3, 16 / 3 / size
        return found

    def _station(self, points: Array) -> tuple[Array, Array]:
        """Where along the beam (...), 0 to 1, and the levers (..., 3) from there."""
        along = np.clip((points - self.start) @ self.axis / self.length, 0.0, 1.0)
        return along, points - self.start - along[..., None] * self.length * self.axis

    def _moved(self, node: int, coordinate: int, points: Array) -> Array:
        """Cubic shapes of a unit slope of a node without deflection, or of a unit deflection without slope,
        or a linear one of its twist; nothing beyond the nodes beside it.
        """
        along, lever = self._station(points)
        x, size = along * self.parts - node + 1, self.length / self.parts
        side = np.where(x <= 1, 1.0, -1.0)  # as seen from the part's other end
        x = np.where(x <= 1, x, 2 - x)
        inside = (x >= 0) & (x <= 1)
        plane, turns = divmod(coordinate, 2)
        if coordinate == len(_NAMES) - 1:
            rotation = (inside * x)[..., None] * self.axis
            return _motion(np.zeros(3), rotation, lever)
        bent = side * size * (x - 1) * x**2 if turns else (3 - 2 * x) * x**2
        slope = (3 * x - 2) * x if turns else side * (1 - x) * x * (6 / size)
        rotation = (inside * slope)[..., None] * self.across[plane]
        deflection = (inside * bent)[..., None] * self._sideways[plane]
        return _motion(deflection, rotation, lever)

    def _bulged(self, number: int, points: Array) -> Array:
        """What stands at both ends and is 1 in the middle: a deflection in either plane, or a twist."""
        x, lever = self._station(points)
        if number == len(self.across):
            rotation = (4 * x * (1 - x))[..., None] * self.axis
            return _motion(np.zeros(3), rotation, lever)
        slope = 32 * x * (1 - x) * (1 - 2 * x) / self.length
        rotation = slope[..., None] * self.across[number]
        deflection = (16 * x**2 * (1 - x) ** 2)[..., None] * self._sideways[number]
        return _motion(deflection, rotation, lever)


def _motion(deflection: Array, rotation: Array, lever: Array) -> Array:
    """(..., 6): displacement and rotation of what is a lever (..., 3) away from a section that moves."""
    return np.concatenate([deflection + cross(rotation, lever), rotation], axis=-1)


def slices(body: Link, axis: Array, parts: int = 1) -> Iterator[tuple[float, Array, Array]]:
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
    for station, weight in evenly(parts):
        offset = (2 * station - 1) * np.sqrt(3 * along / body.mass)
        yield body.mass * weight, body.centre + offset * line, weight * (np.trace(rest) * np.eye(3) - rest)


@cache
def evenly(parts: int) -> tuple[tuple[float, float], ...]:
    """Stations along a length, 0 to 1, and the share of each, as many as so many parts need."""
    stations, weights = np.polynomial.legendre.leggauss(_SLICES * parts)
    return tuple(zip(((1 + stations) / 2).tolist(), (weights / 2).tolist(), strict=True))
