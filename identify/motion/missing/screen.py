"""What each effect of the catalogue would gain to first order: all amplitudes at zero, a simulation for each
of them, side by side, and all that is searched already free to make up for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import correlation_time
from identify.model.laws.friction import Smoothing
from identify.motion.changed import coarse
from identify.motion.judging import FittedMotion
from identify.motion.missing.catalogue import Kind, kinds
from identify.motion.missing.springs import SpringKind, rigid
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate
from identify.motion.trajectory import TrajectoryObjective

LAWS = {"tanh": "dry friction as a hyperbolic tangent of speed", "root": "dry friction as a root of speed"}
_SOFTENED = 2.0
"""By how much a spring that is as stiff as can be is softened to see what it does."""
_FARTHEST, _WIDEST = 1.0, 10.0
"""How far from where it is an effect starts: logarithm of a number that is not as stated; times its size."""


@dataclass(frozen=True)
class Place:
    """A kind at one of its places (a joint, a coordinate): the change (count, k) of all residuals with each
    of its amplitudes; its number in the kind; how many unknowns it brings.
    """

    kind: Kind | SpringKind
    number: int
    columns: Array
    unknowns: int


@dataclass(frozen=True)
class Promise:
    """An effect, a kind at some of its places or a law in place of another (no kind), with what it would gain
    to first order, natural logarithm of the odds, and where its parameters start, by name.
    """

    kind: Kind | SpringKind | None
    places: tuple[int, ...]
    effect: MotionCandidate
    log_odds: float
    starts: Mapping[str, float]

    def same(self, other: Promise) -> bool:
        """Whether the records cannot tell it from another: at the same places, the same odds to six
        digits.
        """
        return self.places == other.places and math.isclose(self.log_odds, other.log_odds, rel_tol=1e-6)


@dataclass(frozen=True)
class _Sight:
    """Residuals over noise (count,) that nothing searched explains, an orthonormal basis (count, r) of what
    is searched, how many of them are independent, and how many places are looked at.
    """

    residual: Array
    basis: Array
    independent: float
    tried: int

    def beyond(self, columns: Array) -> Array:
        """What is left of columns (count, n) beside what is searched, and of all zeros where that is nothing
        but rounding.
        """
        left = columns - self.basis @ (self.basis.T @ columns)
        told = np.linalg.norm(left, axis=0) > 1e-6 * np.linalg.norm(columns, axis=0)
        return np.asarray(left * told)

    def log_odds(self, squares: float, unknowns: int, places: int) -> float:
        """For a model that leaves this sum of squares, with so many more unknowns in so many places: half n
        ln of the ratio, less the price of unknowns (Schwarz 1978) and of having looked at all places.
        """
        ratio = float(self.residual @ self.residual) / max(squares, 1e-300)
        price = unknowns * 0.5 * np.log(max(self.independent, 2.0)) + places * np.log(self.tried)
        return float(0.5 * self.independent * np.log(ratio) - price)


def promises(model: FittedMotion) -> list[Promise]:
    """All effects that promise something, the most promising first; of each kind the places that do."""
    places = [*_numbers(model), *_springs(model)]
    sight = _sight(model, len(places))
    found = []
    for kind in dict.fromkeys(id(place.kind) for place in places):
        promise = _best([place for place in places if id(place.kind) == kind], sight)
        found += [promise] if promise is not None else []
    found += _laws(model, sight)
    return sorted(found, key=lambda promise: -promise.log_odds)


def _sight(model: FittedMotion, tried: int) -> _Sight:
    objective, (residual, own) = model.objective, model.seen
    sizes = np.linalg.norm(own, axis=0)
    basis = np.linalg.qr(own[:, sizes > 0] / sizes[sizes > 0])[0]
    left = np.sqrt(objective.count) * (residual - basis @ (basis.T @ residual))
    return _Sight(left, basis, independent(objective, residual), max(tried, 2))


def independent(objective: TrajectoryObjective, row: Array) -> float:
    """How many of the residuals (count,) are independent, by their correlation in time."""
    total = 0.0
    for signal in objective.signals(row):
        for column in signal.T:
            used = np.isfinite(column)
            if used.any():
                whole = np.where(used, column, 0.0)
                total += float(used.sum()) / correlation_time(whole, used)
    return total


def _numbers(model: FittedMotion) -> list[Place]:
    """All kinds of numbers at all joints, by a simulation for each with that number off."""
    problem, values = model.problem, model.fit.values
    known, joints = kinds(problem, values), np.arange(len(problem.robot.joints))
    where = [(key, row) for kind in known for key, row in zip(kind.where, kind.present, strict=True)]
    first = {key: len(values) + len(joints) * n for n, (key, _) in enumerate(where)}
    columns = {key: np.array([joints, at + joints]) for key, at in first.items()}
    table = replace(problem.table, columns={**problem.table.columns, **columns})
    start = np.concatenate([values, *(row for _, row in where)])
    moved, steps, of = [start], list[float](), list[tuple[Kind, int]]()
    for kind in known:
        for joint in np.flatnonzero(np.isfinite(kind.size)):
            of.append((kind, int(joint)))
            for key in kind.where:
                lane, by = start.copy(), kind.probe * kind.size[joint]
                lane[first[key] + joint] = start[first[key] + joint] * np.exp(by) if kind.relative else by
                moved.append(lane)
                steps.append(by)
    changes = _changes(replace(problem, table=table), np.array(moved), np.array(steps))
    ends = np.cumsum([len(kind.where) for kind, _ in of])
    return [
        Place(kind, joint, changes[:, end - len(kind.where) : end], len(kind.where))
        for (kind, joint), end in zip(of, ends, strict=True)
    ]


def _springs(model: FittedMotion) -> list[Place]:
    """All springs that are rigid, by a simulation for each with that one softer."""
    found = []
    for kind, problem in rigid(model.problem, model.fit.values):
        names, lanes = [p.name for p in problem.parameters], np.arange(len(kind.coordinates))
        moved = np.tile(problem.initial, (len(lanes) + 1, 1))
        columns = [names.index(f"{coordinate}.stiffness") for coordinate in kind.coordinates]
        moved[1 + lanes, columns] /= _SOFTENED
        changes = _changes(coarse(problem), moved, (_SOFTENED - 1) / kind.stiff)
        found += [Place(kind, n, changes[:, [n]], 2) for n in lanes.tolist()]
    return found


def _laws(model: FittedMotion, sight: _Sight) -> list[Promise]:
    """The other way in which the sign of dry friction may pass through zero, by one simulation."""
    problem, dry = model.problem, ("friction.coulomb", "friction.stribeck")
    arrays = problem.table.arrays(model.fit.values[None])
    if not any(np.any(arrays[key]) for key in dry):
        return []
    [other] = LAWS.keys() - {problem.file.study.friction.smoothing}
    law = problem.with_smoothing(cast(Smoothing, other))
    left = sight.beyond(fitted_objective(law).near_rows(model.fit.values[None]).T)
    odds = sight.log_odds(float(np.sum(left**2)), 0, 1)
    effect = MotionCandidate(name=LAWS[other], smoothing=other)
    return [Promise(None, (), effect, odds, {})] if odds > 0 else []


def _changes(problem: MotionProblem, moved: Array, steps: Array) -> Array:
    """(count, n): the residuals of lanes (n + 1, ...) less those of the first, over the steps (n,); zero
    where the motion ran away.
    """
    rows = fitted_objective(problem).near_rows(moved)
    slopes = ((rows[1:] - rows[0]) / steps[:, None]).T
    return np.asarray(np.nan_to_num(slopes, posinf=0.0, neginf=0.0))


def _best(places: Sequence[Place], sight: _Sight) -> Promise | None:
    """The effect of the places of a kind that promise something, each beside those before it."""
    left = [sight.beyond(place.columns) for place in places]
    picked, best, amplitudes = list[int](), 0.0, np.zeros(0)
    while len(picked) < len(places):
        trials = []
        for n in set(range(len(places))) - set(picked):
            own = [*picked, n]
            found = _solved(np.concatenate([left[k] for k in own], axis=1), sight.residual)
            if found is None or not _possible(places, own, found[0]):
                continue
            unknowns = sum(places[k].unknowns for k in own)
            trials.append((sight.log_odds(found[1], unknowns, len(own)), n, found[0]))
        top = max(trials, key=lambda trial: trial[0], default=None)
        if top is None or top[0] <= best:
            break
        best, amplitudes = top[0], top[2]
        picked.append(top[1])
    if not picked:
        return None
    order = np.argsort(picked)
    ends = np.cumsum([places[k].columns.shape[1] for k in picked])
    starts: dict[str, float] = {}
    for k, end in zip(picked, ends, strict=True):
        starts |= _starts(places[k], amplitudes[end - places[k].columns.shape[1] : end])
    kind, numbers = places[0].kind, [places[picked[n]].number for n in order]
    return Promise(kind, tuple(numbers), effect_of(kind, numbers), best, starts)


def effect_of(kind: Kind | SpringKind, places: Sequence[int]) -> MotionCandidate:
    """A kind at some of its places, as a study names it."""
    return kind.candidate([n + 1 for n in places] if isinstance(kind, Kind) else places)


def _solved(columns: Array, residual: Array) -> tuple[Array, float] | None:
    """Amplitudes that least squares has for columns (count, n), and the sum of squares left; None where they
    cannot be distinguished.
    """
    size = np.linalg.norm(columns, axis=0)
    if not (size > 0).all():
        return None
    unit = columns / size
    gram = unit.T @ unit
    if np.linalg.eigvalsh(gram)[0] < 1e-6:
        return None
    along = np.linalg.solve(gram, -unit.T @ residual)
    left = residual + unit @ along
    return along / size, float(left @ left)


def _possible(places: Sequence[Place], own: Sequence[int], amplitudes: Array) -> bool:
    """Whether amplitudes have the sign that they must have."""
    ends = np.cumsum([places[k].columns.shape[1] for k in own])
    for k, end in zip(own, ends, strict=True):
        kind = places[k].kind
        free = isinstance(kind, Kind) and (kind.least < 0 or kind.relative)
        if not free and (amplitudes[end - places[k].columns.shape[1] : end] <= 0).any():
            return False
    return True


def _starts(place: Place, amplitudes: Array) -> dict[str, float]:
    kind, n = place.kind, place.number
    if isinstance(kind, SpringKind):
        stiffness = float(np.clip(1 / amplitudes[0], kind.soft[n], kind.stiff[n]))
        return {f"{kind.coordinates[n]}.stiffness": stiffness}
    found = {}
    for key, present, amplitude in zip(kind.where, kind.present[:, n], amplitudes, strict=True):
        most = _FARTHEST if kind.relative else _WIDEST * kind.size[n]
        away = float(np.clip(amplitude, -most if kind.relative else max(-most, 0.9 * kind.least), most))
        found[f"joint{n + 1}.{key}"] = float(present * np.exp(away)) if kind.relative else away
    return found
