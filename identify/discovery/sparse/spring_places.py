"""Where springs act: those of a bearing somewhere along its joint's axis, those of a payload's mount
anywhere.  No catalogue knows such places: they are found by steps of their own beside a dense fit
(Gauss-Newton, the FRFs' slopes by differences).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from identify.core.arrays import Array, Complex
from identify.discovery.sparse.dense import exchanged, with_more
from identify.discovery.sparse.dictionary import About, Beside
from identify.discovery.sparse.fit import Found, gone_on
from identify.model.effects.base import Effect
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.mount_compliance import MountCompliance
from identify.vibration.costs.information import over_noise
from identify.vibration.problem import Problem

_STEP_M, _FARTHEST_M = 1e-4, 0.1
"""Of the difference, and of a step at most: slopes hold about where they were taken."""
_STEPS, _SHARES = 12, (1.0, 0.25, 0.06)
"""At most, and how much of one is tried."""
_SETTLED, _LITTLE = 0.5, 0.02
"""What one must gain, in units of log likelihood and of what is left: a place that gains less stays."""


class _Placed(NamedTuple):
    """Springs of one bearing or mount, and where they act (k,), m."""

    springs: tuple[JointCompliance | MountCompliance, ...]
    place: Array

    @property
    def own(self) -> bool:
        """Whether that is a place of their own already."""
        return bool(np.any(self.place))

    def at(self, effects: Sequence[Effect], place: Array) -> tuple[Effect, ...]:
        """The effects with these springs at another place; of a bearing at the frame of its joint, it is not
        told.
        """
        mount = isinstance(self.springs[0], MountCompliance)
        told = tuple(place.tolist()) if mount else float(place[0]) or None
        return exchanged(effects, [(one, one.model_copy(update={"at_m": told})) for one in self.springs])

    def moved(self, effects: Sequence[Effect], step: Array) -> tuple[Effect, ...]:
        """The same a step (k,), m, away, to a tenth of a millimetre."""
        return self.at(effects, np.round(self.place + step, 4))


def moved_springs(
    study: Problem, effects: Sequence[Effect], beside: Beside
) -> Iterator[tuple[float, tuple[Effect, ...], int]]:
    """The springs of each bearing or mount that gives way among the effects of a dense fit at a likelier
    place: what that gains, in units of log likelihood with a free scale, the effects with them there, and how
    many numbers say where.
    """
    for gain, one, step in _moves(study, effects, beside):
        yield gain, one.moved(effects, step), len(step)


def _moves(
    study: Problem, effects: Sequence[Effect], beside: Beside, *, own: bool = False
) -> Iterator[tuple[float, _Placed, Array]]:
    """What the best step (k,) of each gains, m; own: only those that have a place of their own already."""
    for one in _placed(study, effects):
        if any(_soft(spring, beside) for spring in one.springs) and (one.own or not own):
            gain, step = _step(study, effects, one, beside)
            yield gain, one, step


def located(found: Found) -> Found:
    """The fit with springs that have a place of their own at the likeliest one, by some steps."""
    for _ in range(_STEPS):
        little = max(_SETTLED, _LITTLE * found.left)
        further = found if found.late else next(displaced(found, little, own=True), found)
        fell, found = found.objective - further.objective, further
        if fell <= little:
            break
    return found


def displaced(found: Found, least: float, *, own: bool = False) -> Iterator[Found]:
    """The fit gone on with each bearing and mount at a likelier place where that gains so much at least, the
    likeliest first; own: as `_moves` has it.  Slopes foresee little of a long way: what it makes
    worse is tried again nearer.
    """
    if not any(one.own or not own for one in _placed(found.study, found.effects)):
        return
    beside = Beside.of(found.unknowns, found.x, found.product)
    moves = [move for move in _moves(found.study, found.effects, beside, own=own) if move[0] > least]
    for _, one, step in sorted(moves, key=lambda move: -move[0]):
        there = (one.moved(found.effects, share * step) for share in _SHARES)
        fits = (_gone_on_at(found, one, effects) for effects in there if found.new(effects))
        if better := next((fit for fit in fits if fit.objective < found.objective), None):
            yield better


def at_frames(found: Found) -> Iterator[Found]:
    """The fit gone on with each bearing or mount that has a place of its own at the frame of its joint or
    link, where it is as likely there.
    """
    for one in _placed(found.study, found.effects):
        if one.own:
            back = gone_on(found, one.at(found.effects, np.zeros(len(one.place))), {})
            if back.log_evidence > found.log_evidence:
                yield back


def _gone_on_at(found: Found, moved: _Placed, effects: tuple[Effect, ...]) -> Found:
    """The fit gone on with springs elsewhere, as long as it comes near what it was; of a mount without what
    slides, which may have made up for where it turns, unless that makes it worse.
    """
    names = [name for one in moved.springs for name in one.free_coordinates(found.study.robot)]
    slide = {f"{name}.compliance": 0.0 for name in names if name.startswith("payload") and ".t" in name}
    fit = gone_on(found, effects, slide, rival=found.objective)
    if slide and fit.objective >= found.objective:
        return gone_on(found, effects, {}, rival=found.objective)
    return fit


def _placed(study: Problem, effects: Sequence[Effect]) -> Iterator[_Placed]:
    """Of every bearing and mount, but for those of which the study says where they are."""
    known = (one for one in study.file.study.effects if isinstance(one, JointCompliance | MountCompliance))
    names = [one.free_coordinates(study.robot) for one in known if one.at_m is not None]
    stated = {name.partition(".")[0] for some in names for name in some}
    bodies = dict[str, list[JointCompliance | MountCompliance]]()
    for one in effects:
        if isinstance(one, JointCompliance | MountCompliance):
            [body, *_] = one.free_coordinates(study.robot)[0].split(".")
            bodies.setdefault(body, []).append(one)
    for body, springs in bodies.items():
        if body not in stated:
            yield _Placed(tuple(springs), np.atleast_1d(np.array(springs[0].at_m or 0.0)))


def _soft(springs: JointCompliance | MountCompliance, beside: Beside) -> bool:
    units = [unit for unit in beside.fit.unknowns.units if unit.effect == springs]
    return any(np.any(beside.x[unit.amplitudes] > 0) for unit in units)


def _step(study: Problem, effects: Sequence[Effect], moved: _Placed, beside: Beside) -> tuple[float, Array]:
    """What the best step (k,) gains, m, with all else free."""
    values = beside.fit.unknowns.to_values(beside.x)
    changes = []
    for axis in np.eye(len(moved.place)):
        model = with_more(study, moved.at(effects, moved.place + _STEP_M * axis))
        there = [over_noise(target, target.predict(values))[0] for target in model.targets().frf]
        changes.append([(r - one.rows.residual) / _STEP_M for r, one in zip(there, beside.sets, strict=True)])
    crossed, own, pull = _crossed(beside.sets, changes)
    told, solved_for = beside.projected(crossed)
    taken, count = told.T @ solved_for, len(pull)
    left, slope = own - taken[:count, :count], pull - taken[:count, count]
    step = np.linalg.solve(left + (1e-6 * np.trace(left) + 1e-300) * np.eye(count), -slope)
    step *= min(1.0, _FARTHEST_M / max(float(np.linalg.norm(step)), 1e-300))
    return beside.gain(float(-2 * step @ slope - step @ left @ step)), step


def _crossed(sets: Sequence[About], changes: Sequence[Sequence[Complex]]) -> tuple[Array, Array, Array]:
    """J'd (f, k), d'd (k, k) and d'r (k,) of changes d of the residuals of each set."""
    parts = []
    for number, one in enumerate(sets):
        d: Complex = np.stack([change[number] for change in changes])
        flat, residual = d.reshape(len(d), -1), one.rows.residual.ravel()
        crossed = (one.slope * one.rows.pull(d, one.free)).T
        parts.append((crossed, np.real(flat.conj() @ flat.T), np.real(flat.conj() @ residual)))
    crossed, own, pull = (np.sum(part, axis=0) for part in zip(*parts, strict=True))
    return crossed, own, pull
