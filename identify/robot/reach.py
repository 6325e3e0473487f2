"""Postures that put a point of a robot to a place, in an attitude: the rigid robot, by least squares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.robot.description import Robot
from identify.robot.kinematics import chain
from identify.robot.pose import turned

_ROUNDS, _CLOSE, _STEP = 60, 1e-9, 0.4
"""Most steps of a search; squared error (m, rad) at which it ends; longest step, rad."""
_DAMPING = 1e-4


def placed(robot: Robot, posture: Array, frame: str, point: Array) -> tuple[Array, Array, Array]:
    """At a posture (joints,), rad: place (3,), m, of a point (3,) of a link or frame, the axes (3, 3) of that
    link as columns, and their motion (6, joints) by the joints, all in the base's axes.
    """
    link, inside = robot.carrier(frame)
    number, moving = robot.links.index(robot.link(link, "reach")), chain(robot, posture)
    whole = moving.poses[number] @ inside
    place = whole[:3, :3] @ point + whole[:3, 3]
    [linear] = moving.moved(np.array([number]), place[None])
    angular = np.where(np.arange(len(posture)) < number, moving.axes.T, 0.0)
    return place, whole[:3, :3], np.vstack([linear, angular])


def reached(
    robot: Robot, frame: str, point: Array, place: Array, axes: Array, starts: Sequence[Array]
) -> Array | None:
    """A posture (joints,), rad, within the joints' limits, with a point of a frame at a place (3,), m, and
    the frame's axes (3, 3); of the first start from which one is found, or None.
    """
    for start in starts:
        found = _search(robot, frame, point, place, axes, start)
        if found is not None:
            return found
    return None


def _search(robot: Robot, frame: str, point: Array, place: Array, axes: Array, start: Array) -> Array | None:
    low, high = (np.array([getattr(joint, side) for joint in robot.joints]) for side in ("lower", "upper"))
    posture = start.copy()
    for _ in range(_ROUNDS):
        at, now, motion = placed(robot, posture, frame, point)
        error = np.concatenate([place - at, _turn(now, axes)])
        if error @ error < _CLOSE**2:
            return posture if np.all((low <= posture) & (posture <= high)) else None
        inner = motion @ motion.T + _DAMPING * min(1.0, float(error @ error)) * np.eye(6)
        step = motion.T @ np.linalg.lstsq(inner, error, rcond=1e-12)[0]
        posture = posture + step * min(1.0, _STEP / max(float(np.abs(step).max()), 1e-12))
        posture = np.where(np.isfinite(low + high), np.clip(posture, low, high), posture)
    return None


def _turn(now: Array, wanted: Array) -> Array:
    """(3,), rad: the rotation vector, in the base's axes, that takes axes (3, 3) to others."""
    return np.asarray(scipy.spatial.transform.Rotation.from_matrix(wanted @ now.T).as_rotvec())


def about(axis: Array, angle: float) -> Array:
    """(3, 3): the rotation about an axis (3,) by an angle, rad."""
    return np.asarray(turned(angle * axis / np.linalg.norm(axis))[:3, :3])


def shortest(first: Array, second: Array) -> Array:
    """(3, 3): the shortest rotation that takes one direction (3,) to another."""
    a, b = first / np.linalg.norm(first), second / np.linalg.norm(second)
    axis, cosine = np.cross(a, b), float(a @ b)
    sine = float(np.linalg.norm(axis))
    if sine > 1e-12:
        return about(axis, float(np.arctan2(sine, cosine)))
    across = np.eye(3)[int(np.argmin(np.abs(a)))]
    return np.eye(3) if cosine > 0 else about(np.cross(a, across), np.pi)
