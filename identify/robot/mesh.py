"""Surfaces made of triangles, only to be looked at: plain bodies, and a fine surface with fewer triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array

_SIDES = 16
"""Of a drawn circle."""
_CELLS = (96, 64, 48, 32, 24, 16, 12, 8, 6, 4, 3, 2)
"""Along the longest side of a body, tried in turn."""
_SAME, _COUNTED = 2**20, 2**20
"""Cells so small that what they hold is the same place; vertices whose triples fit into an integer."""


@dataclass(frozen=True)
class Mesh:
    """Vertices (v, 3), m, and triangles (t, 3), rows of them."""

    vertices: Array
    triangles: NDArray[np.int_]

    @property
    def corners(self) -> tuple[Array, Array, Array]:
        """Of all triangles, each (t, 3)."""
        a, b, c = (self.vertices[self.triangles[:, corner]] for corner in range(3))
        return a, b, c

    @property
    def areas(self) -> Array:
        """Of all triangles (t,), m^2."""
        a, b, c = self.corners
        return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)

    def placed(self, pose: Array) -> Mesh:
        """The mesh in another frame, where its own has the pose (4, 4)."""
        return Mesh(self.vertices @ pose[:3, :3].T + pose[:3, 3], self.triangles)


EMPTY = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))


@dataclass(frozen=True)
class Surface:
    """A part of what a link looks like, in a frame with the pose (4, 4) in the link's: a mesh, or a file of
    one that is still to be read, times scale (3,); fault: why there is neither.
    """

    where: str
    pose: Array
    mesh: Mesh = EMPTY
    file: Path | None = None
    scale: Array = field(default_factory=lambda: np.ones(3))
    fault: str = ""


@dataclass(frozen=True)
class Visual:
    """What a link looks like: surfaces that are drawn together, the first choice that can be."""

    link: str
    choices: tuple[tuple[Surface, ...], ...]


def box(size: Sequence[float]) -> Mesh:
    """A box about the origin with sides (3,), m."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    halves = [half for a, b, c, d in faces for half in ((a, b, c), (a, c, d))]
    return Mesh(corners * size, np.array(halves))


def cylinder(radius: float, length: float) -> Mesh:
    """A cylinder along z about the origin."""
    return _turned([(0.0, -length / 2), (radius, -length / 2), (radius, length / 2), (0.0, length / 2)])


def sphere(radius: float) -> Mesh:
    """A sphere about the origin."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, _SIDES // 2 + 1)
    return _turned([(radius * np.cos(a), radius * np.sin(a)) for a in angle])


def _turned(profile: Sequence[tuple[float, float]]) -> Mesh:
    """What a profile (radius, z) sweeps about z; each of its ends lies on z."""
    turn = 2 * np.pi * np.arange(_SIDES) / _SIDES
    circle = np.stack([np.cos(turn), np.sin(turn), np.ones(_SIDES)], axis=1)
    rings = np.concatenate([circle * (radius, radius, z) for radius, z in profile])
    here = np.arange(_SIDES)
    beside = (here + 1) % _SIDES
    triangles = [
        half + ring * _SIDES
        for ring in range(len(profile) - 1)
        for half in (
            np.stack([here, beside, here + _SIDES], axis=1),
            np.stack([beside, beside + _SIDES, here + _SIDES], axis=1),
        )
    ]
    return _merged(Mesh(rings, np.concatenate(triangles)), _SAME)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    before = np.cumsum([0, *(len(one.vertices) for one in meshes)])
    triangles = [one.triangles + count for one, count in zip(meshes, before[:-1], strict=True)]
    return Mesh(np.concatenate([one.vertices for one in meshes]), np.concatenate(triangles))


def simplified(mesh: Mesh, most: int) -> Mesh:
    """At most so many triangles that look like the mesh: vertices of a cell of a grid become one, in their
    middle, and triangles that this makes flat are left out (Rossignac and Borrel 1993).
    """
    found = fine = _merged(mesh, _SAME)
    for cells in _CELLS:
        if len(found.triangles) <= most:
            break
        found = _merged(fine, cells)
    return Mesh(found.vertices, found.triangles[:most])


def _merged(mesh: Mesh, cells: int) -> Mesh:
    """With vertices in the same cell of a grid as one; so many cells along the longest side."""
    low = mesh.vertices.min(axis=0)
    longest = float(np.ptp(mesh.vertices, axis=0).max()) or 1.0
    x, y, z = np.floor((mesh.vertices - low) * (cells / longest)).astype(np.int64).T
    number, middle = _means(mesh.vertices, (x * (cells + 1) + y) * (cells + 1) + z)
    corners = number[mesh.triangles]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    if len(middle) < _COUNTED:  # else their numbers would not fit into one
        a, b, c = np.sort(corners, axis=1).T
        _, first = np.unique((a * len(middle) + b) * len(middle) + c, return_index=True)
        corners = corners[np.sort(first)]
    used, kept = np.unique(corners, return_inverse=True)
    return Mesh(middle[used], kept.reshape(-1, 3))


def _means(vertices: Array, keys: NDArray[np.int64]) -> tuple[NDArray[np.int_], Array]:
    """The number of each vertex among different keys (v,), and the mean of the vertices of each key."""
    _, number = np.unique(keys, return_inverse=True)
    count = np.bincount(number)
    return number, np.stack([np.bincount(number, axis) / count for axis in vertices.T], axis=1)
