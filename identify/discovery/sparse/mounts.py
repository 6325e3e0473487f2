"""Where a payload's mount is: the springs of a mount act about a place that no catalogue knows, found by
steps of its own beside a dense fit (Gauss-Newton, the FRFs' slopes by differences).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from identify.core.arrays import Array, Complex
from identify.discovery.sparse.dense import exchanged, with_more
from identify.discovery.sparse.dictionary import About, Beside
from identify.model.effects.base import Effect
from identify.model.effects.mount_compliance import MountCompliance
from identify.vibration.costs.information import over_noise
from identify.vibration.problem import Problem

_STEP_M, _FARTHEST_M = 1e-4, 0.1
"""Of the difference, and of a step at most: slopes hold about where they were taken."""


def moved_mounts(
    study: Problem, effects: Sequence[Effect], beside: Beside
) -> Iterator[tuple[float, tuple[Effect, ...]]]:
    """Each soft mount among the effects of a dense fit at a likelier place: what that gains, in units of log
    likelihood with a free scale, and the effects with it there.
    """
    for mount in effects:
        if isinstance(mount, MountCompliance) and _soft(mount, beside):
            gain, step = _step(study, effects, mount, beside)
            place = np.round(np.array(mount.at_m) + step, 4)
            yield gain, _with(effects, mount, place)


def _soft(mount: MountCompliance, beside: Beside) -> bool:
    units = [unit for unit in beside.fit.unknowns.units if unit.effect == mount]
    return any(np.any(beside.x[unit.amplitudes] > 0) for unit in units)


def _with(effects: Sequence[Effect], mount: MountCompliance, place: Array) -> tuple[Effect, ...]:
    return exchanged(effects, [(mount, mount.model_copy(update={"at_m": tuple(place.tolist())}))])


def _step(
    study: Problem, effects: Sequence[Effect], mount: MountCompliance, beside: Beside
) -> tuple[float, Array]:
    """What the best step of a mount (3,) gains, m, with all else free."""
    values = beside.fit.unknowns.to_values(beside.x)
    changes = []
    for axis in np.eye(3):
        model = with_more(study, _with(effects, mount, np.array(mount.at_m) + _STEP_M * axis))
        there = [over_noise(target, target.predict(values))[0] for target in model.targets().frf]
        changes.append([(r - one.rows.residual) / _STEP_M for r, one in zip(there, beside.sets, strict=True)])
    crossed, own, pull = _crossed(beside.sets, changes)
    told, solved_for = beside.projected(crossed)
    taken = told.T @ solved_for
    left, slope = own - taken[:3, :3], pull - taken[:3, 3]
    step = np.linalg.solve(left + (1e-6 * np.trace(left) + 1e-300) * np.eye(3), -slope)
    step *= min(1.0, _FARTHEST_M / max(float(np.linalg.norm(step)), 1e-300))
    return beside.gain(float(-2 * step @ slope - step @ left @ step)), step


def _crossed(sets: Sequence[About], changes: Sequence[Sequence[Complex]]) -> tuple[Array, Array, Array]:
    """J'd (f, 3), d'd (3, 3) and d'r (3,) of changes d of the residuals of each set."""
    parts = []
    for number, one in enumerate(sets):
        d: Complex = np.stack([change[number] for change in changes])
        flat, residual = d.reshape(3, -1), one.rows.residual.ravel()
        crossed = (one.slope * one.rows.pull(d, one.free)).T
        parts.append((crossed, np.real(flat.conj() @ flat.T), np.real(flat.conj() @ residual)))
    crossed, own, pull = (np.sum(part, axis=0) for part in zip(*parts, strict=True))
    return crossed, own, pull
