"""Where the cloud of nodes may be before it is laid on the robot: from pairs, or from the shape alone; and
the units that its lengths may be in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.closest_turn import closest_turn
from identify.measured.registration.align import Pairs, Task
from identify.measured.uff.geometry import LENGTH_M
from identify.robot.kinematics import chain
from identify.robot.pose import turned

_DRAWS = 12
"""Starts beside that of the pairs as stated, with as much chance as they have."""
_WRONG = 3.0
"""Standard deviations, about, of distances between pairs."""
_LINE = 0.1
"""Width over length of a triangle of pairs that leaves the turn about its length open."""
_AROUND = 12
"""Turns about each axis that may be upright."""
_SHARE = (0.2, 1.4)
"""Length of a cloud of nodes over that of the robot."""


def units(nodes: Array, task_size: float) -> list[float]:
    """By what lengths (n, 3), in m as stated, may have to be multiplied because the unit is another: 1 first;
    those that make the cloud about as long as the robot, m.
    """
    length = float(np.linalg.norm(np.ptp(nodes, axis=0))) or 1.0
    ratios = sorted({float(f"{a / b:.9g}") for a in LENGTH_M.values() for b in LENGTH_M.values()})
    low, high = _SHARE
    return [r for r in sorted(ratios, key=lambda r: abs(np.log(r))) if low <= r * length / task_size <= high]


def possible(task: Task) -> bool:
    """Whether pairs are as far from each other as their places on the robot: they tell a wrong unit."""
    pairs = task.pairs
    if len(pairs.rows) < 2:
        return True
    aim = task.nodes[pairs.rows] - pairs.apart(chain(task.robot, task.angles), task.nodes)
    own, other = (np.linalg.norm(p - p.mean(axis=0), axis=1) for p in (task.nodes[pairs.rows], aim))
    wrong = np.abs(own - other) / (2 * pairs.spread_m + float(task.spread.max(initial=0.0)) * other)
    return bool(wrong.max() < _WRONG)


def enough(pairs: Pairs, nodes: Array) -> bool:
    """Whether pairs tell the pose by themselves: three that are on no line."""
    if len(pairs.rows) < 3:
        return False
    size = np.linalg.svd(nodes[pairs.rows] - nodes[pairs.rows].mean(axis=0), compute_uv=False)
    return bool(size[1] > _LINE * size[0])


def by_pairs(task: Task) -> Iterator[Array]:
    """Poses (4, 4) that lay nodes on their pairs, as stated and with errors as large as they may be."""
    pairs, chance = task.pairs, np.random.default_rng(0)
    for draw in range(1 + _DRAWS):
        angles, places = task.angles, pairs.places
        if draw:
            angles = angles + task.spread * chance.standard_normal(len(angles))
            places = places + pairs.spread_m * chance.standard_normal(places.shape)
        moved = replace(pairs, places=places)
        aim = task.nodes[pairs.rows] - moved.apart(chain(task.robot, angles), task.nodes)
        yield fitted(task.nodes[pairs.rows], aim)


def fitted(places: Array, aims: Array) -> Array:
    """The pose (4, 4) that lays places (n, 3) on aims (n, 3)."""
    pose = np.eye(4)
    pose[:3, :3] = closest_turn(places, aims)
    pose[:3, 3] = aims.mean(axis=0) - pose[:3, :3] @ places.mean(axis=0)
    return pose


def by_shape(task: Task) -> Iterator[Array]:
    """Poses (4, 4) with each axis of the analyser upright and turned about it, and with the main directions
    of the cloud along those of the robot; boxes around both have one middle.
    """
    robot = _skin(task)
    for turn in _turns(task.nodes, robot):
        placed = task.nodes @ turn.T
        pose = np.eye(4)
        pose[:3, :3] = turn
        pose[:3, 3] = (robot.max(axis=0) + robot.min(axis=0)) / 2 - (
            placed.max(axis=0) + placed.min(axis=0)
        ) / 2
        yield pose


def _turns(nodes: Array, robot: Array) -> Iterator[Array]:
    upright = [
        np.eye(3),
        *(turned(np.eye(3)[k] * a)[:3, :3] for k in (0, 1) for a in (np.pi / 2, -np.pi / 2)),
        turned([np.pi, 0, 0])[:3, :3],
    ]
    for up in upright:
        for step in range(_AROUND):
            yield turned([0, 0, 2 * np.pi * step / _AROUND])[:3, :3] @ up
    own, other = (np.linalg.svd(p - p.mean(axis=0), full_matrices=False)[2] for p in (nodes, robot))
    for signs in scipy.spatial.transform.Rotation.create_group("D2").as_matrix():
        turn = other.T @ signs @ own
        yield turn * np.sign(np.linalg.det(turn)) if np.linalg.det(turn) > 0 else other.T @ signs @ -own


def _skin(task: Task) -> Array:
    """Places (d, 3) all over the robot, in the base's frame."""
    poses = chain(task.robot, task.angles).poses
    return np.concatenate(
        [
            skin.centres @ pose[:3, :3].T + pose[:3, 3]
            for skin, pose in zip(task.skins, poses, strict=True)
            if skin is not None
        ]
    )


def size_of(task: Task) -> float:
    """The diagonal of the box around the robot, m."""
    return float(np.linalg.norm(np.ptp(_skin(task), axis=0)))
