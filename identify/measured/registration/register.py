"""From nodes in the analyser's frame to points on links."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.core.thresholds import CONVINCING
from identify.measured.geometry import MeasuredGeometry
from identify.measured.registration.align import Distances, Laid, Task, distances, laid, likely, motion
from identify.measured.registration.starts import by_pairs, by_shape, enough, possible, size_of, units
from identify.robot.kinematics import Chain, chain

_COARSE = 0.1
"""Scale of distances at first over the size of the robot, where shape alone leads."""
_GLANCE_M = 0.03
_GLANCED = 60
"""Nodes of a first look."""
_DECIMATED = 8
_DRAWS = 12
_PROMISING = 8
"""Placements that are looked at with all nodes."""
_RIGHT_UNIT = 0.9
"""Probability that lengths are in the unit stated."""
_ELSEWHERE_M = 0.03
"""RMS distance of nodes on links between placements that are others."""


@dataclass(frozen=True)
class Node:
    """A node on the robot: link (empty: on none), position (3,), m, and axes (3, 3) of its channels, rows, in
    the link's frame; normal (3,) of the surface there; height above it and one standard deviation of the
    position along any axis, m; probability that it is on this link, rather than on `other` or (empty) on
    none.
    """

    node: int
    link: str
    position: Array
    axes: Array
    normal: Array
    height_m: float
    spread_m: float
    probability: float
    other: str


@dataclass(frozen=True)
class Registration:
    """The nodes of a test on the robot.

    pose (4, 4): of the analyser's frame in the base's; angles and their standard deviations (joints,), rad;
    unit: what stated lengths were multiplied by; height_m: how far all nodes are above the surface; scale_m:
    how far they are from there; pairs_m: how far each pair is off, by node; rivals: other placements that
    explain the geometry about as well.
    """

    nodes: tuple[Node, ...]
    pose: Array
    angles: Array
    angle_spread: Array
    unit: float
    height_m: float
    scale_m: float
    pairs_m: dict[int, float]
    rivals: int


def register(task: Task, geometry: MeasuredGeometry) -> Registration:
    """The geometry, whose positions the task has, on the robot of the task; InputError for fewer than three
    nodes, and where they fit in no unit of length.
    """
    if len(task.nodes) < 3:
        raise InputError("geometry", f"{len(task.nodes)} nodes", "three or more, to tell how they lie")
    size = size_of(task)
    glances: list[_Candidate] = []
    for unit in units(task.nodes, size):
        own = replace(task, nodes=unit * task.nodes)
        glances += _glances(unit, own, size) if possible(own) else []
    if not glances:
        length = float(np.linalg.norm(np.ptp(task.nodes, axis=0)))
        said = f"nodes over {length:.3g} m beside a robot of {size:.3g} m, in whatever unit"
        raise InputError("geometry", said, "the nodes of a test of this robot")
    glances.sort(key=lambda one: -one.score)
    found = [one.looked_at(task) for one in glances[:_PROMISING]]
    best = max(found, key=lambda one: one.score)
    found += [best.looked_at(task, angles) for angles in _angles(task)]
    found.sort(key=lambda one: -one.score)
    return _registration(found[0], geometry, _rivals(found))


@dataclass(frozen=True)
class _Candidate:
    """A placement in a unit, and its log posterior."""

    unit: float
    task: Task
    laid: Laid

    @property
    def score(self) -> float:
        """Log posterior, but for a constant."""
        prior = np.log(_RIGHT_UNIT if self.unit == 1 else 1 - _RIGHT_UNIT)
        # The density of nodes is that of their lengths as stated: in a longer unit they are farther apart.
        return float(self.laid.log_likelihood + prior + 3 * len(self.task.nodes) * np.log(self.unit))

    def looked_at(self, task: Task, angles: Array | None = None) -> _Candidate:
        """The same with all nodes on the whole skin, from here; angles: to start from."""
        own = replace(task, nodes=self.unit * task.nodes)
        at = laid(own, self.laid.pose, 2 * _GLANCE_M, angles=self.laid.angles if angles is None else angles)
        return _Candidate(self.unit, own, at)

    def on_links(self) -> tuple[Index, Array]:
        """Of each node the link (n,) and the position in its frame (n, 3)."""
        links, places = chain(self.task.robot, self.laid.angles), self.laid.placed(self.task.nodes)
        link = np.abs(distances(self.task, self.laid, links, places).distance).argmin(axis=1)
        return link, _inside(links, link, places)


def _inside(links: Chain, link: Index, places: Array) -> Array:
    poses = links.poses[link]
    return np.asarray(np.einsum("nji,nj->ni", poses[:, :3, :3], places - poses[:, :3, 3]))


def _rivals(found: list[_Candidate]) -> int:
    """How many placements that are others explain the geometry about as well as the first."""
    known = [found[0].on_links()]
    for one in found[1:]:
        if one.score < found[0].score - CONVINCING:
            break
        there = one.on_links()
        if all(_apart(there, other) > _ELSEWHERE_M for other in known):
            known.append(there)
    return len(known) - 1


def _apart(one: tuple[Index, Array], other: tuple[Index, Array]) -> float:
    """Median distance of nodes on the same link, m; infinite where most are on others."""
    same = one[0] == other[0]
    return float(np.median(np.linalg.norm(one[1] - other[1], axis=1)[same])) if same.mean() > 0.5 else np.inf


def _angles(task: Task) -> Iterator[Array]:
    """Joint angles as they may be: a wrist that is a little off fits its nodes in a wrong place as well."""
    chance = np.random.default_rng(0)
    for _ in range(_DRAWS):
        yield task.angles + task.spread * chance.standard_normal(len(task.angles))


def _glances(unit: float, task: Task, size: float) -> list[_Candidate]:
    """Placements in one unit, found with a part of the nodes on a coarse skin."""
    every = np.linspace(0, len(task.nodes) - 1, min(_GLANCED, len(task.nodes))).astype(int)
    kept = np.unique([*every, *task.pairs.rows])
    pairs = replace(task.pairs, rows=np.searchsorted(kept, task.pairs.rows))
    coarse = [None if skin is None else skin.decimated(_DECIMATED) for skin in task.skins]
    few = replace(task, nodes=task.nodes[kept], pairs=pairs, skins=coarse)
    paired = enough(pairs, few.nodes)
    starts, scale = (by_pairs(few), 3 * pairs.spread_m) if paired else (by_shape(few), _COARSE * size)
    return [_Candidate(unit, few, laid(few, start, scale, _GLANCE_M, 3)) for start in starts]


def _registration(best: _Candidate, geometry: MeasuredGeometry, rivals: int) -> Registration:
    task, at = best.task, best.laid
    covariance = np.asarray(np.linalg.pinv(at.information, hermitian=True))[:-1, :-1]  # without the height
    apart = np.linalg.norm(task.pairs.apart(chain(task.robot, at.angles), at.placed(task.nodes)), axis=1)
    pairs = {geometry.nodes[row]: float(far) for row, far in zip(task.pairs.rows, apart, strict=True)}
    spread = np.sqrt(np.diag(covariance)[6:])
    nodes = tuple(_nodes(task, at, geometry, covariance))
    return Registration(nodes, at.pose, at.angles, spread, best.unit, at.height, at.scale, pairs, rivals)


def _nodes(task: Task, at: Laid, geometry: MeasuredGeometry, covariance: Array) -> Iterator[Node]:
    """Every node on its likeliest link; covariance (6 + joints,) ** 2 of shift, turn and angles."""
    links, places = chain(task.robot, at.angles), at.placed(task.nodes)
    found = distances(task, at, links, places)
    likelihood = _probabilities(found, covariance, links, places, at.scale)
    likelihood[task.pairs.rows] = np.eye(len(links.poses))[task.pairs.links]  # which link, somebody knows
    link, every = likelihood.argmax(axis=1), np.arange(len(places))
    moved = motion(links, places, every, link)
    spread = np.sqrt(np.einsum("nck,kl,ncl->n", moved, covariance, moved) / 3 + at.scale**2)
    inside, turn = _inside(links, link, places), links.poses[link][:, :3, :3]
    names = [one.name for one in task.robot.links]
    for n, node in enumerate(geometry.nodes):
        own = likelihood[n]
        yield Node(
            node=node,
            link=names[link[n]] if own.max() > 1 - own.sum() else "",
            position=inside[n],
            axes=geometry.axes[n] @ at.pose[:3, :3].T @ turn[n],
            normal=found.normal[n, link[n]] @ turn[n],
            height_m=float(found.distance[n, link[n]]) + at.height,
            spread_m=float(spread[n]),
            probability=float(own[link[n]]),
            other=_other(own, names),
        )


def _probabilities(found: Distances, covariance: Array, links: Chain, places: Array, scale: float) -> Array:
    """(n, links): of each node to be on each link, with all that is not sure of pose and angles."""
    rows, spread = np.arange(len(places)), np.empty_like(found.distance)
    for link in range(len(links.poses)):
        along = np.einsum(
            "nc,nck->nk", found.direction[:, link], motion(links, places, rows, np.full(len(rows), link))
        )
        spread[:, link] = np.sqrt(np.einsum("nk,kl,nl->n", along, covariance, along) + scale**2)
    return likely(found.distance, spread)


def _other(own: Array, names: list[str]) -> str:
    """The next likely link, or empty where that is none at all."""
    second = int(np.argsort(own)[-2])
    return names[second] if own[second] > 1 - own.sum() else ""
