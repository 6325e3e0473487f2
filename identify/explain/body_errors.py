"""Errors of rigid bodies within their stated uncertainty: what they add to torques, fitted along with a
prior, before any effect and beside all of them.

Of each link its mass with what hangs on it, its centre along three axes, and three moments of inertia about
it; all of them act on every joint.  Inverse dynamics is linear in mass, first moment and inertia about the
frame's origin (Atkeson, An and Hollerbach 1986), so each is a column.  A shift d of the centre c carries the
inertia about the origin with it, by m (2 c.d 1 - c d' - d c'): more than the moments about the centre are
uncertain by, where links are long.

Beside them, of each torque by how much it was recorded late: signals of one sample belong to one moment to
within half a sampling interval, drives filter what they report, and a torque that comes late looks like
viscous friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.explain.recorded_motion import RecordedMotion
from identify.explain.regression import RegressionProblem
from identify.robot.description import Link

_FELT = 1e-4
"""Share of the largest below which a combination of errors is not felt."""


def with_body_errors(problems: Sequence[RegressionProblem]) -> list[RegressionProblem]:
    """The problems with errors of stated bodies; combinations that the first one feels, the same in all."""
    columns = [problem.from_datum(_columns(problem.scene)) for problem in problems]
    if not columns[0].shape[2]:
        return list(problems)
    felt = columns[0][problems[0].mask]
    sizes, directions = np.linalg.eigh(felt.T @ felt)
    kept = directions[:, sizes > _FELT**2 * sizes.max(initial=0.0)]
    return [replace(p, bodies=c @ kept, remembered={}) for p, c in zip(problems, columns, strict=True)]


def _columns(scene: RecordedMotion) -> Array:
    """(samples, examined joints, errors): torque at the motors of one standard deviation of each error."""
    links = [_of_link(scene, link) for link in scene.arm.robot.links[1:]]
    found = [torque for torques in links for torque in torques]
    if not found:
        return np.zeros((len(scene.time_s), len(scene.axes), 0))
    return np.concatenate([scene.on_all(*found), *_late(scene)], axis=2)


def _late(scene: RecordedMotion) -> list[Array]:
    """What torques of the stated bodies that are recorded half a sampling interval late lack."""
    [load] = np.moveaxis(scene.on_all(scene.arm.torque), 2, 0)
    half = float(np.median(np.diff(scene.time_s))) / 2
    rate = np.gradient(load, scene.time_s, axis=0)
    return [scene.on(axis, -half * rate[:, number]) for number, axis in enumerate(scene.axes)]


def _of_link(scene: RecordedMotion, link: Link) -> list[Array]:
    """Torques at the joints (samples, joints) of one standard deviation of each error of a link."""
    stated, arm = scene.stated, scene.arm
    found = [stated.mass * arm.added(link.name, link)] if stated.mass > 0 else []
    if stated.centre > 0:
        reach = stated.centre * float(np.linalg.norm(link.centre))
        found += [arm.shifted(link.name, shift) for shift in reach * np.eye(3)]
    if stated.inertia > 0:
        moments, axes = np.linalg.eigh(link.inertia)
        sizes = zip(moments, axes.T, strict=True)
        found += [stated.inertia * moment * arm.inertia(link.name, axis) for moment, axis in sizes]
    return found
