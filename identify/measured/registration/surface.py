"""The surfaces of a robot that a sensor can be glued to: small discs, each with its normal to the outside.

What no eye sees from anywhere outside, at the posture, is left out: the walls of castings, the faces of
joints. Normals point to where they are seen from, whichever way the triangles of a mesh file run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array, Index, Mask
from identify.core.errors import InputError
from identify.robot.description import Robot
from identify.robot.kinematics import chain
from identify.robot.mesh import Mesh
from identify.robot.visual import Looks, by_link

_FIX = "without them, write a file of points"
_DISCS = 40_000
"""Of a whole robot: about 10 mm apart on an arm of 2 m."""
_EYES = 60
"""Directions that the robot is seen from."""
_RADIUS = 0.8
"""Of a disc over how far apart they are: so that together they leave no gaps."""
_BEHIND = 2.0
"""Distances between discs that a disc may lie behind another one and is seen beside it."""


@dataclass(frozen=True)
class Skin:
    """The discs of one link in its frame: centres and normals (d, 3), m; how far apart they are; tree: of the
    centres.
    """

    centres: Array
    normals: Array
    apart: float
    tree: scipy.spatial.cKDTree

    def decimated(self, times: int) -> Skin:
        """So many times fewer discs, which are larger, for a first look."""
        some = slice(None, None, times)
        return Skin(
            self.centres[some],
            self.normals[some],
            self.apart * np.sqrt(times),
            scipy.spatial.cKDTree(self.centres[some]),
        )

    def nearest(self, places: Array, height: float, within: float) -> tuple[Index, Index]:
        """Of places (n, 3) in the link's frame: the rows that may be `within` so much, m, of the skin lifted
        by a height, and of each the nearest disc.
        """
        bound = within + self.radius + abs(height)
        _, which = self.tree.query(places, distance_upper_bound=bound)
        (rows,) = (which < len(self.centres)).nonzero()
        return rows, which[rows]

    @property
    def radius(self) -> float:
        """Of a disc, m."""
        return _RADIUS * self.apart


def from_discs(away: Array, normal: Array, radius: Array) -> tuple[Array, Array]:
    """Of places `away` (n, 3) from the centres of discs with normals (n, 3) and radii (n,), m: the distance
    (n,), negative below a disc, and the direction (n, 3) that it is counted in, which is that of the normal
    where a place is above or below the disc.
    """
    above = np.einsum("nc,nc->n", away, normal)
    beside = away - above[:, None] * normal
    aside = np.sqrt(np.einsum("nc,nc->n", beside, beside))
    over = np.maximum(aside - radius, 0.0)
    vector = above[:, None] * normal + beside * (over / np.maximum(aside, 1e-12))[:, None]
    distance = np.sqrt(np.einsum("nc,nc->n", vector, vector))
    straight = vector / np.maximum(distance, 1e-12)[:, None]
    out = over > 0
    return np.where(out, distance, above), np.where(out[:, None], straight, normal)


def skins(robot: Robot, shown: Looks, angles: Array) -> list[Skin | None]:
    """The discs of every link, base first, that can be seen with the joints at `angles` (joints,), rad; None
    of a link that looks like nothing.

    InputError where no link looks like anything.
    """
    meshes = by_link(robot, shown.meshes)
    if not any(meshes):
        why = "; ".join(shown.missing) or "the robot file has no <visual> or <collision>"
        raise InputError(robot.name, f"no surface to lay points on ({why})", "meshes that can be read", _FIX)
    area = [0.0 if mesh is None else float(mesh.areas.sum()) for mesh in meshes]
    apart = float(np.sqrt(sum(area) / _DISCS))
    discs = [(np.zeros((0, 3)),) * 2 if m is None else _discs(m, apart) for m in meshes]
    poses = chain(robot, angles).poses
    places = [c @ pose[:3, :3].T + pose[:3, 3] for (c, _), pose in zip(discs, poses, strict=True)]
    normals = [n @ pose[:3, :3].T for (_, n), pose in zip(discs, poses, strict=True)]
    sides = _sides(np.concatenate(places), np.concatenate(normals), apart)
    ends = np.cumsum([len(c) for c, _ in discs])[:-1]
    own = zip(discs, np.split(sides, ends), strict=True)
    return [_skin(centres, normal, side, apart) for (centres, normal), side in own]


def _skin(centres: Array, normals: Array, side: Array, apart: float) -> Skin | None:
    seen = side != 0
    if not seen.any():
        return None
    return Skin(centres[seen], normals[seen] * side[seen, None], apart, scipy.spatial.cKDTree(centres[seen]))


def _discs(mesh: Mesh, apart: float) -> tuple[Array, Array]:
    """Places all over a mesh, about so far apart, and normals there."""
    chance, area = np.random.default_rng(0), mesh.areas
    a, b, c = mesh.corners
    count = max(int(area.sum() / apart**2), 50)
    which = np.searchsorted(np.cumsum(area) / area.sum(), (np.arange(count) + chance.random(count)) / count)
    which = np.minimum(which, len(area) - 1)
    root, along = np.sqrt(chance.random(count)), chance.random(count)
    parts = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    places = np.einsum("nk,knc->nc", parts, np.stack([a[which], b[which], c[which]]))
    normal = np.cross(b - a, c - a)[which]
    return places, normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)


def _sides(places: Array, normals: Array, apart: float) -> Array:
    """1 or -1 where the normal of a disc points outside or inside, 0 where no eye sees it."""
    votes, seen = np.zeros(len(places)), np.zeros(len(places), dtype=bool)
    for eye in _eyes():
        facing = normals @ eye
        visible = _visible(places, eye, apart) & (np.abs(facing) > 0.2)
        seen |= visible
        votes[visible] += facing[visible]
    return np.asarray(np.where(seen, np.where(votes < 0, -1.0, 1.0), 0.0))


def _visible(places: Array, eye: Array, apart: float) -> Mask:
    """Which places nothing hides from an eye far away: those near the front of their cell of a grid."""
    helper = np.eye(3)[int(np.argmin(np.abs(eye)))]
    u = np.cross(eye, helper)
    u /= np.linalg.norm(u)
    cells = np.floor(places @ np.stack([u, np.cross(eye, u)], axis=1) / (2 * apart)).astype(np.int64)
    cells -= cells.min(axis=0)
    cell = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    depth = places @ eye
    front = np.full(cell.max() + 1, -np.inf)
    np.maximum.at(front, cell, depth)
    return np.asarray(depth > front[cell] - _BEHIND * apart)


def _eyes() -> Sequence[Array]:
    """Directions all around (Fibonacci's lattice; Gonzalez, Math. Geosci. 42 (2010) 49)."""
    n = np.arange(_EYES)
    z, turn = 1 - (2 * n + 1) / _EYES, n * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z**2)
    return list(np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1))
