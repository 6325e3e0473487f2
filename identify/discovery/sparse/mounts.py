"""Where a payload's mount is: the springs of a mount act about a place that no catalogue knows, found by
steps of its own beside a dense fit (Gauss-Newton, the FRFs' slopes by differences).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from identify.core.arrays import Array, Complex
from identify.discovery.sparse.dense import with_more
from identify.discovery.sparse.dictionary import About, about, gain_of
from identify.discovery.sparse.objective import Penalised
from identify.discovery.sparse.unknowns import Unknowns
from identify.model.effects.base import Effect
from identify.model.effects.mount_compliance import MountCompliance
from identify.vibration.costs.information import each_set
from identify.vibration.problem import Problem

_STEP_M, _FARTHEST_M = 1e-4, 0.1
"""Of the difference, and of a step at most: slopes hold about where they were taken."""


def moved_mounts(
    study: Problem, unknowns: Unknowns, effects: Sequence[Effect], x: Array, product: Array
) -> Iterator[tuple[float, tuple[Effect, ...]]]:
    """Each soft mount among the effects of a dense fit at x (f,) at a likelier place: what that gains, in
    units of log likelihood with a free scale, and the effects with it there.  product (f + 1, f + 1): [J
    r]'[J r].
    """
    fit = Penalised(unknowns, price=0.0)
    for mount in effects:
        if isinstance(mount, MountCompliance) and _soft(mount, unknowns, x):
            gain, step = _step(study, fit, effects, mount, x, product)
            place = np.round(np.array(mount.at_m) + step, 4)
            yield gain, _with(effects, mount, place)


def _soft(mount: MountCompliance, unknowns: Unknowns, x: Array) -> bool:
    return any(np.any(x[unit.amplitudes] > 0) for unit in unknowns.units if unit.effect == mount)


def _with(effects: Sequence[Effect], mount: MountCompliance, place: Array) -> tuple[Effect, ...]:
    moved = mount.model_copy(update={"at_m": tuple(place.tolist())})
    return tuple(moved if one == mount else one for one in effects)


def _step(
    study: Problem,
    fit: Penalised,
    effects: Sequence[Effect],
    mount: MountCompliance,
    x: Array,
    product: Array,
) -> tuple[float, Array]:
    """What the best step of a mount (3,) gains, m, with all else free."""
    sets = each_set(partial(about, unknowns=fit.unknowns, x=x), fit.targets)
    values = fit.unknowns.to_values(x)
    changes = []
    for axis in np.eye(3):
        model = with_more(study, _with(effects, mount, np.array(mount.at_m) + _STEP_M * axis))
        there = [target.predict(values) for target in model.targets().frf]
        changes.append(
            [(h - one.target.predict(values)) / _STEP_M for h, one in zip(there, sets, strict=True)]
        )
    crossed, own, pull = _crossed(sets, changes)
    held = np.flatnonzero(fit.present(x))
    scale = max(product[-1, -1] / fit.count, 1.0)
    information = product[np.ix_(held, held)] + scale * np.diag(fit.unknowns.precision[held])
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information / np.outer(size, size) + 1e-9 * np.eye(len(size))
    both = np.column_stack([crossed[held], product[held, -1]]) / size[:, None]
    taken = both.T @ np.linalg.solve(scaled, both)
    left, slope = own - taken[:3, :3], pull - taken[:3, 3]
    step = np.linalg.solve(left + (1e-6 * np.trace(left) + 1e-300) * np.eye(3), -slope)
    step *= min(1.0, _FARTHEST_M / max(float(np.linalg.norm(step)), 1e-300))
    fall = float(-2 * step @ slope - step @ left @ step)
    return gain_of(fall, product[-1, -1], fit.count), step


def _crossed(sets: Sequence[About], changes: Sequence[Sequence[Complex]]) -> tuple[Array, Array, Array]:
    """J'd (f, 3), d'd (3, 3) and d'r (3,) of changes d of the FRFs of each set, in units of noise."""
    parts = []
    for number, one in enumerate(sets):
        d: Complex = np.stack([change[number] for change in changes]) * one.rows.weight
        flat, residual = d.reshape(3, -1), one.rows.residual.ravel()
        crossed = (one.slope * one.rows.pull(d, one.free)).T
        parts.append((crossed, np.real(flat.conj() @ flat.T), np.real(flat.conj() @ residual)))
    crossed, own, pull = (np.sum(part, axis=0) for part in zip(*parts, strict=True))
    return crossed, own, pull
