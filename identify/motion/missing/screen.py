"""What each effect of the catalogue would gain: all amplitudes at zero, a simulation for each of them, side
by side, and all that is searched already free to make up for it; then a simulation where the best of these
first-order solutions are, because the truth may be far from zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import effective_samples
from identify.core.parameters import Scale
from identify.model.laws.friction import Smoothing
from identify.motion.changed import coarse
from identify.motion.judging import FittedMotion
from identify.motion.missing.catalogue import OFF, Kind, kinds
from identify.motion.missing.springs import SpringKind, rigid
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate
from identify.motion.trajectory import TrajectoryObjective

LAWS = {"tanh": "dry friction as a hyperbolic tangent of speed", "root": "dry friction as a root of speed"}
_SOFTENED = 2.0
"""By how much a spring that is as stiff as can be is softened to see what it does."""
_WIDEST = 10.0
"""How far from where it is an amplitude starts, over its size."""
_SHARES = 0.5 ** np.arange(4)
"""Shares of what least squares asks for that are simulated: a line search without a slope."""
PART = 0.1
"""What promises less than this part of the best one's log odds is not looked at beside it."""


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
class Lanes:
    """A problem whose parameters start at `start` (p,), with what may be missing among them; columns: their
    numbers by name.
    """

    problem: MotionProblem
    start: Array
    columns: Mapping[str, int]

    def rows(self, moved: Array) -> Array:
        """(m, count): residuals at parameters (m, p) less those at the start; NaN where motion ran away."""
        rows = fitted_objective(self.problem).near_rows(np.vstack([self.start, moved]))
        return np.asarray(rows[1:] - rows[0])

    def slopes(self, moved: Array, steps: Array) -> Array:
        """(count, m): the same over steps (m,); zero where the motion ran away."""
        return np.asarray(np.nan_to_num((self.rows(moved) / steps[:, None]).T, posinf=0.0, neginf=0.0))


@dataclass(frozen=True)
class Promise:
    """An effect, a kind at some of its places or a law in place of another (no kind), with what it gains
    where its parameters start (by name, those that are searched already among them), natural logarithm of
    the odds.
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
class _Solution:
    """Places of a kind with the amplitudes (columns of all,) that least squares has for them, and what they
    gain to first order, natural logarithm of the odds.
    """

    places: Sequence[Place]
    amplitudes: Array
    log_odds: float

    @property
    def change(self) -> Array:
        """(count,): of all residuals."""
        return np.concatenate([place.columns for place in self.places], axis=1) @ self.amplitudes

    def starts(self, share: float = 1.0) -> dict[str, float]:
        """Where the parameters start, by name, with a share of the amplitudes."""
        ends = np.cumsum([place.columns.shape[1] for place in self.places])
        parts = zip(self.places, np.split(share * self.amplitudes, ends[:-1]), strict=True)
        return {name: value for place, own in parts for name, value in _starts(place, own).items()}


@dataclass(frozen=True)
class _Sight:
    """Residuals over noise (count,), and what of them nothing searched explains; an orthonormal basis (count,
    r) of what is searched; how many residuals are independent, and how many places are looked at.
    """

    whole: Array
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
    looks = [_numbers(model), *_springs(model)]
    sight = _sight(model, sum(len(places) for _, places in looks))
    solved, found = [(lanes, _solutions(places, sight)) for lanes, places in looks], _laws(model, sight)
    most = max((one.log_odds for _, own in solved for one in own), default=0.0)
    for lanes, own in solved:
        found += _simulated(model, lanes, [one for one in own if one.log_odds >= PART * most], sight)
        found += [
            _promise(one.places, one.log_odds, one.starts()) for one in own if one.log_odds < PART * most
        ]
    return sorted(found, key=lambda promise: -promise.log_odds)


def _solutions(places: Sequence[Place], sight: _Sight) -> list[_Solution]:
    """The best of each kind."""
    kinds = {id(place.kind): place.kind for place in places}.values()
    best = [_best([place for place in places if place.kind is kind], sight) for kind in kinds]
    return [one for one in best if one is not None]


def _sight(model: FittedMotion, tried: int) -> _Sight:
    objective, (residual, own) = model.objective, model.seen
    sizes = np.linalg.norm(own, axis=0)
    basis = np.linalg.qr(own[:, sizes > 0] / sizes[sizes > 0])[0]
    whole = np.sqrt(objective.count) * residual
    left = whole - basis @ (basis.T @ whole)
    return _Sight(whole, left, basis, independent(objective, residual), max(tried, 2))


def independent(objective: TrajectoryObjective, row: Array) -> float:
    """How many of the residuals (count,) are independent, by their correlation in time."""
    total = 0.0
    for signal in objective.signals(row):
        for column in signal.T:
            used = np.isfinite(column)
            if used.any():
                total += effective_samples(np.where(used, column, 0.0), used)
    return total


def _numbers(model: FittedMotion) -> tuple[Lanes, list[Place]]:
    """All kinds of numbers at all joints, by a simulation for each with that number off."""
    problem, values = model.problem, model.fit.values
    known, joints = kinds(problem, values), np.arange(len(problem.robot.joints))
    where = [(key, row) for kind in known for key, row in zip(kind.where, kind.present, strict=True)]
    first = {key: len(values) + len(joints) * n for n, (key, _) in enumerate(where)}
    columns = {key: np.array([joints, at + joints]) for key, at in first.items()}
    table = replace(problem.table, columns={**problem.table.columns, **columns})
    named = {f"joint{n + 1}.{key}": at + n for key, at in first.items() for n in joints.tolist()}
    own = {parameter.name: n for n, parameter in enumerate(problem.parameters)}
    start = np.concatenate([values, *(row for _, row in where)])
    lanes = Lanes(replace(problem, table=table), start, {**own, **named})
    moved, steps, of = list[Array](), list[float](), list[tuple[Kind, int]]()
    for kind in known:
        for joint in np.flatnonzero(np.isfinite(kind.size)):
            of.append((kind, int(joint)))
            for key in kind.where:
                lane, by = start.copy(), kind.probe * kind.size[joint]
                lane[first[key] + joint] = start[first[key] + joint] * np.exp(by) if kind.relative else by
                moved.append(lane)
                steps.append(by)
    if not moved:
        return lanes, []
    changes = lanes.slopes(np.array(moved), np.array(steps))
    ends = np.cumsum([len(kind.where) for kind, _ in of])
    return lanes, [
        Place(kind, joint, changes[:, end - len(kind.where) : end], len(kind.where))
        for (kind, joint), end in zip(of, ends, strict=True)
    ]


def _springs(model: FittedMotion) -> list[tuple[Lanes, list[Place]]]:
    """All springs that are rigid, by a simulation for each with that one softer."""
    found = []
    for kind, problem in rigid(model.problem, model.fit.values):
        columns = {p.name: n for n, p in enumerate(problem.parameters)}
        rows = np.arange(len(kind.coordinates))
        lanes = Lanes(coarse(problem), problem.initial, columns)
        moved = np.tile(problem.initial, (len(rows), 1))
        moved[rows, [columns[f"{coordinate}.stiffness"] for coordinate in kind.coordinates]] /= _SOFTENED
        changes = lanes.slopes(moved, (_SOFTENED - 1) / kind.stiff)
        found.append((lanes, [Place(kind, n, changes[:, [n]], 2) for n in rows.tolist()]))
    return found


def _simulated(
    model: FittedMotion, lanes: Lanes, solutions: Sequence[_Solution], sight: _Sight
) -> list[Promise]:
    """What solutions come to where they are simulated, with what is searched moved to make up for them: the
    best share of all that; those that gain something.
    """
    if not solutions:
        return []
    shifts = [_made_up(model, sight.whole + one.change) for one in solutions]
    starts = [
        {**_shifted(model, share * shift), **one.starts(share)}
        for one, shift in zip(solutions, shifts, strict=True)
        for share in _SHARES
    ]
    moved = np.tile(lanes.start, (len(starts), 1))
    for lane, values in zip(moved, starts, strict=True):
        lane[[lanes.columns[name] for name in values]] = list(values.values())
    left = np.sum((sight.whole + lanes.rows(moved)) ** 2, axis=1)
    left = np.where(np.isfinite(left), left, np.inf).reshape(len(solutions), -1)
    found = []
    for one, squares, first in zip(solutions, left, range(0, len(starts), len(_SHARES)), strict=True):
        odds = sight.log_odds(float(squares.min()), sum(p.unknowns for p in one.places), len(one.places))
        found.append(_promise(one.places, odds, starts[first + int(np.argmin(squares))]))
    return [promise for promise in found if promise.log_odds > 0]


def _promise(places: Sequence[Place], log_odds: float, starts: Mapping[str, float]) -> Promise:
    kind, numbers = places[0].kind, sorted(place.number for place in places)
    return Promise(kind, tuple(numbers), effect_of(kind, numbers), log_odds, starts)


def _made_up(model: FittedMotion, residual: Array) -> Array:
    """By how much what is free moves (free,) to make up for residuals over noise (count,), to first order."""
    slopes = np.sqrt(model.objective.count) * model.seen[1]
    size = np.linalg.norm(slopes, axis=0)
    size = np.where(size > 0, size, 1.0)
    return np.asarray(-np.linalg.lstsq(slopes / size, residual, rcond=1e-6)[0] / size)


def _shifted(model: FittedMotion, shift: Array) -> dict[str, float]:
    """Values of what is free, by name, a shift (free,) from where it is, within its bounds; logarithms move
    by one at the most.
    """
    found = {}
    for number, by in zip(Scale(model.problem.parameters).free, shift, strict=True):
        one, value = model.problem.parameters[number], model.fit.values[number]
        after = value * np.exp(np.clip(by / value, -1.0, 1.0)) if one.log else value + by
        found[one.name] = float(np.clip(after, one.lower, one.upper))
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


def _best(places: Sequence[Place], sight: _Sight) -> _Solution | None:
    """The places of a kind that promise something to first order, each beside those before it, and their
    amplitudes.
    """
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
    return _Solution([places[k] for k in picked], amplitudes, best) if picked else None


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
        most = _WIDEST * kind.size[n]
        found[f"joint{n + 1}.{key}"] = (
            float(np.clip(_times(amplitude), 1 / OFF, OFF) * present)
            if kind.relative
            else float(np.clip(amplitude, max(-most, 0.9 * kind.least), most))
        )
    return found


def _times(away: float) -> float:
    """What a number is multiplied by whose logarithm is to move by so much to first order: more of it acts in
    proportion to it, less of it to one over it.
    """
    return 1 + away if away > 0 else 1 / (1 - away)
