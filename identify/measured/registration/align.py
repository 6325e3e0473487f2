"""A cloud of nodes laid on the skins of a robot whose joint angles are not quite known.

Unknown are the pose of the analyser's frame in the base's and how far each joint angle is off. The squares

    sum w_il (d_il / s)^2 + sum |pair apart|^2 / s_pair^2 + sum (dq_j / s_angle)^2

of distances d_il of node i from the skin of link l are least, with weights w_il by which link it is likely
on, or on none; the scale s of distances falls from coarse to fine (point to plane: Chen and Medioni, Image
and Vision Computing 10 (1992) 145; soft assignments: Granger and Pennec, ECCV 2002).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identify.core.arrays import Array, Index, cross_matrix
from identify.measured.registration.surface import Skin, from_discs
from identify.robot.description import Robot
from identify.robot.kinematics import Chain, chain
from identify.robot.pose import turned

FINE_M = 0.008
"""Scale down to which distances are judged coarser than they are."""
HEIGHT_M = 0.01
"""Standard deviation of the height of nodes above the surface: a sensor's, or none."""
FINEST_M, COARSEST_M = 0.003, 0.03
"""Bounds of how far nodes are from the skin that they are on: of mesh files, and of tape measures."""
_NONE = 3.0
"""Scales of distance beyond which a node is rather on nothing."""
_FALL = 0.75
"""Of the scale from step to step: slower changes nothing."""
_FAR = 5.0
"""Scales of distance beyond which a link has no part in a node."""
_IDLE = 1e-3
"""Weight below which a distance has no part in a step."""
_ASTRAY = 0.05
"""Share of nodes that are on nothing, such as on a table beside the robot."""


@dataclass(frozen=True)
class Pairs:
    """Nodes whose place is roughly known: rows of the cloud, links (p,), places (p, 3) in their frames, and
    one standard deviation of each coordinate, m.
    """

    rows: Index = field(default_factory=lambda: np.zeros(0, dtype=int))
    links: Index = field(default_factory=lambda: np.zeros(0, dtype=int))
    places: Array = field(default_factory=lambda: np.zeros((0, 3)))
    spread_m: float = 0.03

    def apart(self, links: Chain, cloud: Array) -> Array:
        """(p, 3): from where each place is to where its node (n, 3) is, in the base's frame."""
        poses = links.poses[self.links]
        aim = np.einsum("pij,pj->pi", poses[:, :3, :3], self.places) + poses[:, :3, 3]
        return np.asarray(cloud[self.rows] - aim)


@dataclass(frozen=True)
class Task:
    """nodes (n, 3), m, in the analyser's frame; stated angles (joints,) and one standard deviation of each,
    rad.
    """

    robot: Robot
    skins: Sequence[Skin | None]
    nodes: Array
    angles: Array
    spread: Array
    pairs: Pairs = field(default_factory=Pairs)

    @property
    def area(self) -> float:
        """Of the whole skin, m^2."""
        return sum(len(skin.centres) * skin.apart**2 for skin in self.skins if skin is not None)

    @property
    def room(self) -> float:
        """m^3 around the robot where a node can be that is on nothing."""
        return 4 / 3 * np.pi * max(self.robot.stretched(), 0.1) ** 3


@dataclass(frozen=True)
class Laid:
    """pose (4, 4) of the analyser's frame in the base's; angles (joints,), rad; height of the nodes above the
    skin and scale of their distances from there, m; information (7 + joints,) ** 2 about shift, turn, angles
    and height; log_likelihood of nodes, pairs and angles.
    """

    pose: Array
    angles: Array
    scale: float
    information: Array
    height: float = 0.0
    log_likelihood: float = -np.inf

    def placed(self, nodes: Array) -> Array:
        """Nodes (n, 3) in the base's frame."""
        return np.asarray(nodes @ self.pose[:3, :3].T + self.pose[:3, 3])


@dataclass(frozen=True)
class Distances:
    """Of each node from each link's skin, in the base's frame: signed distance (n, links), its direction and
    the normal (n, links, 3); infinite from a link without a skin.
    """

    distance: Array
    direction: Array
    normal: Array


def distances(task: Task, at: Laid, links: Chain, places: Array, within: float = np.inf) -> Distances:
    """Of places (n, 3) in the base's frame from skins as much higher as the nodes are, where they are
    `within` so much, m.
    """
    shape = (len(places), len(task.skins))
    found = Distances(np.full(shape, np.inf), np.zeros((*shape, 3)), np.zeros((*shape, 3)))
    turns = links.poses[:, :3, :3]
    local = (places - links.poses[:, None, :3, 3]) @ turns
    worn = [(number, skin) for number, skin in enumerate(task.skins) if skin is not None]
    near = [skin.nearest(local[number], at.height, within) for number, skin in worn]
    # All links at once: for few nodes each call of NumPy takes as long as its work.
    own = np.concatenate([rows for rows, _ in near])
    counts = [len(rows) for rows, _ in near]
    on = np.repeat([number for number, _ in worn], counts)
    radius = np.repeat([skin.radius for _, skin in worn], counts)
    discs = [
        (skin.centres[disc], skin.normals[disc]) for (_, skin), (_, disc) in zip(worn, near, strict=True)
    ]
    centres, normals = (np.concatenate(each) for each in zip(*discs, strict=True))
    far, way = from_discs(local[on, own] - centres - at.height * normals, normals, radius)
    found.distance[own, on] = far
    found.direction[own, on] = np.einsum("nij,nj->ni", turns[on], way)
    found.normal[own, on] = np.einsum("nij,nj->ni", turns[on], normals)
    return found


def laid(
    task: Task,
    start: Array,
    coarse_m: float,
    fine_m: float = FINE_M,
    last: int = 12,
    angles: Array | None = None,
) -> Laid:
    """The cloud laid on the robot from a start pose (4, 4), at scales from coarse to fine, m, and in the last
    steps at that which the distances have; angles: to start from, by default as stated.
    """
    falling = max(int(np.ceil(np.log(fine_m / coarse_m) / np.log(_FALL))), 0)
    at = Laid(start, task.angles if angles is None else angles, coarse_m, np.eye(7 + len(task.angles)))
    for number in range(falling + last):
        scale = coarse_m * _FALL**number if number < falling else _own_scale(task, at)
        at = _step(task, replace(at, scale=scale))
    return replace(at, log_likelihood=_log_likelihood(task, at))


def _own_scale(task: Task, at: Laid) -> float:
    """The RMS of distances from the skin, of nodes that are on it."""
    links, places = chain(task.robot, at.angles), at.placed(task.nodes)
    found = distances(task, at, links, places, _FAR * at.scale).distance
    weight = likely(found, at.scale)
    squares = np.sum(weight * np.square(np.where(weight > _IDLE, found, 0.0)))
    return float(np.clip(np.sqrt(squares / max(weight.sum(), 1e-9)), FINEST_M, COARSEST_M))


def _step(task: Task, at: Laid) -> Laid:
    """One step of Gauss and Newton with the weights of this scale."""
    links, places = chain(task.robot, at.angles), at.placed(task.nodes)
    rows, right = zip(*_equations(task, links, places, at), strict=True)
    a, b = np.concatenate(rows), np.concatenate(right)
    information = a.T @ a
    damping = 1e-9 * np.trace(information) / len(information)
    change = np.linalg.solve(information + damping * np.eye(len(information)), -a.T @ b)
    middle, pose = places.mean(axis=0), turned(change[3:6])
    pose[:3, 3] = middle + change[:3] - pose[:3, :3] @ middle
    angles, height = at.angles + change[6:-1], at.height + float(change[-1])
    return replace(at, pose=pose @ at.pose, angles=angles, height=height, information=information)


def _equations(task: Task, links: Chain, places: Array, at: Laid) -> list[tuple[Array, Array]]:
    """Rows (m, 7 + joints) and right sides (m,) over their standard deviations, of nodes, pairs, angles and
    the height; unknown are a shift, a turn about the middle of the cloud, the angles and the height.
    """
    found = distances(task, at, links, places, _FAR * at.scale)
    weight = likely(found.distance, at.scale)
    node, link = np.nonzero(weight > _IDLE)
    root = np.sqrt(weight[node, link]) / at.scale
    way, normal = found.direction[node, link], found.normal[node, link]
    moved = np.einsum("nc,nck->nk", way, motion(links, places, node, link))
    own = np.column_stack([moved, -np.einsum("nc,nc->n", way, normal)])
    pairs, joints = task.pairs, len(task.angles)
    paired = motion(links, places, pairs.rows, pairs.links).reshape(-1, 6 + joints)
    known = np.append(task.spread, HEIGHT_M)
    return [
        (own * root[:, None], found.distance[node, link] * root),
        (
            np.pad(paired, ((0, 0), (0, 1))) / pairs.spread_m,
            pairs.apart(links, places).ravel() / pairs.spread_m,
        ),
        (np.pad(np.diag(1 / known), ((0, 0), (6, 0))), np.append(at.angles - task.angles, at.height) / known),
    ]


def motion(links: Chain, places: Array, node: Index, link: Index) -> Array:
    """(m, 3, 6 + joints): how nodes move beside links with a shift of the cloud, a turn about its middle, and
    the joint angles.
    """
    away = places[node] - places.mean(axis=0)
    turn = -cross_matrix(away)
    shift = np.broadcast_to(np.eye(3), (len(node), 3, 3))
    return np.concatenate([shift, turn, -links.moved(link, places[node])], axis=2)


def likely(distance: Array, scale: Array | float) -> Array:
    """(n, links): how likely each node is on each link, rather than on another or on none."""
    squares = np.square(distance / scale) / 2
    least = np.minimum(squares.min(axis=1, keepdims=True), _NONE**2 / 2)
    part = np.exp(least - squares)
    return np.asarray(part / (part.sum(axis=1, keepdims=True) + np.exp(least - _NONE**2 / 2)))


def _log_likelihood(task: Task, at: Laid) -> float:
    """Of nodes anywhere on the skin, a few of them anywhere around it; of pairs and angles."""
    links = chain(task.robot, at.angles)
    places = at.placed(task.nodes)
    found = distances(task, at, links, places, _FAR * at.scale)
    squares = np.square(found.distance / at.scale)
    on_skin = np.exp(-squares / 2).sum(axis=1) / (np.sqrt(2 * np.pi) * at.scale * task.area)
    apart = task.pairs.apart(links, places) / task.pairs.spread_m
    off = np.append((at.angles - task.angles) / task.spread, at.height / HEIGHT_M)
    nodes = np.log((1 - _ASTRAY) * on_skin + _ASTRAY / task.room)
    return float(nodes.sum() - np.sum(apart**2) / 2 - off @ off / 2)
