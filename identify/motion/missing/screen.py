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
from identify.motion.missing.catalogue import Kind, kinds
from identify.motion.missing.linear import Place, Sight, Solution, effect_of, solutions
from identify.motion.missing.springs import SpringKind, rigid
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem
from identify.motion.study import MotionCandidate
from identify.motion.trajectory import TrajectoryObjective

LAWS = {"tanh": "dry friction as a hyperbolic tangent of speed", "root": "dry friction as a root of speed"}
_SOFTENED = 2.0
"""By how much a spring that is as stiff as can be is softened to see what it does."""
_SHARES = 2.0 ** np.arange(2, -4, -1)
"""Shares of what least squares asks for that are simulated: a line search without a slope, both ways."""
PART = 0.1
"""What promises less than this part of the best one's log odds to first order is not simulated."""


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

    def within(self, other: Promise) -> bool:
        """Whether it is another set of places of the same kind that has some of the other's."""
        return self.kind is not None and self.kind is other.kind and bool({*self.places} & {*other.places})


def look(model: FittedMotion) -> list[tuple[Lanes, list[Place]]]:
    """All that may be missing from a model, with what it changes: numbers, then springs."""
    return [_numbers(model), _springs(model)]


def promises(model: FittedMotion, looks: Sequence[tuple[Lanes, list[Place]]] | None = None) -> list[Promise]:
    """All effects that promise something, the most promising first; of a kind only sets of places that have
    none in common; looks: what may be missing, where it is known.
    """
    looks = looks or look(model)
    sight = _sight(model, sum(len(places) for _, places in looks))
    solved, found = [(lanes, solutions(places, sight)) for lanes, places in looks], _laws(model, sight)
    most = max((one.log_odds for _, own in solved for one in own), default=0.0)
    for lanes, own in solved:
        found += _simulated(model, lanes, [one for one in own if one.log_odds >= PART * most], sight)
        found += [
            promise(one.places, one.log_odds, one.starts()) for one in own if one.log_odds < PART * most
        ]
    return distinct(found)


def distinct(found: Sequence[Promise]) -> list[Promise]:
    """The most promising first, without those that are part of one before."""
    order = sorted(found, key=lambda one: -one.log_odds)
    return [one for n, one in enumerate(order) if not any(one.within(other) for other in order[:n])]


def _sight(model: FittedMotion, tried: int) -> Sight:
    residual, own = model.seen
    return sight_of(model, residual, own, tried)


def sight_of(model: FittedMotion, residual: Array, own: Array, tried: int) -> Sight:
    """Of residuals (count,) beside columns (count, n) that are searched, both over the root of their number,
    as many of them independent as of the model's, with so many places to look at.
    """
    sizes = np.linalg.norm(own, axis=0)
    basis = np.linalg.qr(own[:, sizes > 0] / sizes[sizes > 0])[0]
    whole = np.sqrt(model.objective.count) * residual
    left = whole - basis @ (basis.T @ whole)
    return Sight(whole, left, basis, independent(model.objective, model.seen[0]), max(tried, 2))


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
        Place(kind, joint, changes[:, end - len(kind.where) : end])
        for (kind, joint), end in zip(of, ends, strict=True)
    ]


def _springs(model: FittedMotion) -> tuple[Lanes, list[Place]]:
    """All springs that are rigid, by a simulation for each with that one softer."""
    kinds, problem = rigid(model.problem, model.fit.values)
    columns = {p.name: n for n, p in enumerate(problem.parameters)}
    own = [columns[f"{coordinate}.stiffness"] for kind in kinds for coordinate in kind.coordinates]
    lanes = Lanes(coarse(problem), problem.initial, columns)
    if not own:
        return lanes, []
    moved = np.tile(problem.initial, (len(own), 1))
    moved[np.arange(len(own)), own] /= _SOFTENED
    stiff = np.concatenate([kind.stiff for kind in kinds])
    changes = iter(lanes.slopes(moved, (_SOFTENED - 1) / stiff).T)
    found = list[Place]()
    for kind in kinds:
        of_kind = np.array([next(changes) for _ in kind.coordinates]).T
        found += [Place(kind, n, of_kind[:, place]) for n, place in enumerate(kind.places)]
    return lanes, found


def _simulated(
    model: FittedMotion, lanes: Lanes, solutions: Sequence[Solution], sight: Sight
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
        best = int(np.argmin(squares))
        odds = sight.log_odds(float(squares[best]), one.unknowns, len(one.places))
        found.append(promise(one.places, odds + one.log_prior(_SHARES[best]), starts[first + best]))
    return [one for one in found if one.log_odds > 0]


def promise(places: Sequence[Place], log_odds: float, starts: Mapping[str, float]) -> Promise:
    """Places of a kind with their odds, as an effect."""
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


def _laws(model: FittedMotion, sight: Sight) -> list[Promise]:
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
