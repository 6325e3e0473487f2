"""Springs between a link and the ground in any direction have twelve numbers, of which the data often leave
some open, so that they do on one link what a strut does on its neighbour.  A single strut has four.

Its direction does not enter the model linearly, as parameters do: it is fitted here, from the residuals and
slopes of the springs, and is a setting of the effect from then on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product

import numpy as np
import scipy

from identify.core.arrays import Array, Index
from identify.core.parameters import Scale
from identify.core.thresholds import QUIET
from identify.discovery.task import Task, Trial
from identify.discovery.trial import likelihood
from identify.fitting.objective import Objective
from identify.model.effects.spring_to_ground import SpringToGround
from identify.vibration.problem import Problem, with_effects

_UPPER = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)])
"""Entries of a symmetric matrix in the order in which the springs have them."""
_FEW, _FOLLOWED, _STEPS, _TOLERANCE = 4, 2, 15, 1e-5
"""Steps from all directions; how many of them are followed, and how far."""
_ALIKE = float(np.cos(np.radians(5)))
"""Directions with such a product are the same one."""
_STRIDE, _INSIDE = 0.5, 1e-6
"""How far the other parameters go at first, on a logarithmic scale; how far from bounds a search starts."""
_DAMPING = (1e-6, 1.0)
"""Damping over stiffness of a strut, s: it is searched on a logarithmic scale."""
_REDUCED = 50
"""Steps of a strut alone, everything else where a linear step leads."""


def springs_of(trial: Trial) -> SpringToGround | None:
    """The springs in any direction that a trial adds; None where it has none, or leaves more than noise: what
    else is missing would turn a strut.
    """
    [spring] = trial.task.new
    if not isinstance(spring, SpringToGround) or not spring.cross_coupling or len(spring.axes) < 3:
        return None
    if trial.gap > QUIET or any(effect.of_amplitude for effect in trial.task.effects):
        return None
    return spring


def strut_task(problem: Problem, trial: Trial) -> Task | None:
    """A strut in the place of the springs of a trial, to be refitted; None where it has none that can be one.

    problem has the lines that the direction is fitted to.
    """
    spring = springs_of(trial)
    if spring is None:
        return None
    model = with_effects(problem, trial.task.effects, trial.values)
    if not all(model.parameters[n].free for n in model.measurements[0].system.effects[-1][1]):
        return None
    d, rate = _direction(_Strut(model))
    size = float(np.linalg.norm(d))
    direction = tuple(float(x) for x in d / size * np.sign(d[np.argmax(np.abs(d))]))
    strut = spring.model_copy(update={"cross_coupling": False, "direction": direction})
    stiffness, damping = (f"{spring.link}.strut.{one}" for one in ("stiffness", "damping"))
    own = {stiffness: size**2, damping: rate * size**2}
    return Task(trial.task.known, (strut,), {**trial.values, **own}, whole=True)


@dataclass(frozen=True)
class _Strut:
    """A problem whose last effect is springs in any direction, as a function of y: the other free parameters
    on their scale, then the direction times the root of the stiffness (3,), and ln(damping / stiffness).
    """

    problem: Problem
    objective: Objective = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "objective", likelihood(self.problem))

    @property
    def own(self) -> Index:
        """Numbers (12,) of the springs' parameters: stiffness and damping of each entry."""
        return self.problem.measurements[0].system.effects[-1][1]

    def others(self, array: Array) -> Array:
        """Of the free parameters (..., free) all but the springs'."""
        return array[..., ~np.isin(Scale(self.problem.parameters).free, self.own)]

    def springs(self, y: Array) -> tuple[Array, Array]:
        """Values (12,) of the springs, and their derivatives (12, 4) by the last four of y."""
        d, rate = y[-4:-1], np.exp(y[-1])
        entries, unit = d[_UPPER].prod(axis=1), np.eye(3)
        slopes = unit[_UPPER[:, 0]] * d[_UPPER[:, 1], None] + unit[_UPPER[:, 1]] * d[_UPPER[:, 0], None]
        values, by = np.empty(12), np.zeros((12, 4))
        values[0::2], values[1::2] = entries, rate * entries
        by[0::2, :3], by[1::2, :3], by[1::2, 3] = slopes, rate * slopes, rate * entries
        return values, by

    def rows(self, y: Array) -> tuple[Array, Array]:
        """Residuals, and their derivatives by y."""
        scale = Scale(self.problem.parameters)
        x = scale.to_x(self.problem.initial)
        x[~np.isin(scale.free, self.own)] = y[:-4]
        values, (entries, by) = scale.to_values(x), self.springs(y)
        values[self.own] = entries
        residuals, slopes = self.objective.residuals(values, scale.free)
        own = slopes[:, np.isin(scale.free, self.own)]
        return residuals, np.hstack([self.others(slopes * scale.slope(x)), own @ by])

    def bounds(self) -> tuple[Array, Array]:
        """Of y."""
        ends = Scale(self.problem.parameters).bounds(), ([-np.inf] * 3, [np.inf] * 3), np.log(_DAMPING)
        lower, upper = ([self.others(e), *d, r] for e, d, r in zip(*ends, strict=True))
        return np.hstack(lower), np.hstack(upper)

    def starts(self) -> list[Array]:
        """Where one linear step from the springs as they are leads, with the strut that is best then from
        each direction.
        """
        scale, values = Scale(self.problem.parameters), self.problem.initial
        x = scale.to_x(values)
        residuals, slopes = self.objective.residuals(values, scale.free)
        own, beside = slopes[:, np.isin(scale.free, self.own)], self.others(slopes * scale.slope(x))
        target, (lower, upper) = own @ values[self.own] - residuals, self.bounds()
        everything = np.column_stack([own, target])
        left = everything - beside @ np.linalg.lstsq(beside, everything, rcond=None)[0]
        rows, found = np.asarray(np.linalg.qr(left, mode="r")), list[Array]()
        for direction in _directions():
            if (strut := self._best_from(direction, rows[:, :-1], rows[:, -1])) is not None:
                step = np.linalg.lstsq(beside, target - own @ self.springs(strut)[0], rcond=None)[0]
                y = np.hstack([self.others(x) + np.clip(step, -_STRIDE, _STRIDE), strut])
                found.append(np.clip(y, lower + _INSIDE, upper - _INSIDE))
        return found

    def _best_from(self, direction: Array, own: Array, target: Array) -> Array | None:
        """The last four of y that bring springs (rows own (r, 12)) nearest to a target (r,), from a
        direction; None where nothing along it is a strut.
        """
        entries = direction[_UPPER].prod(axis=1)
        pair = np.column_stack([own[:, 0::2] @ entries, own[:, 1::2] @ entries])
        k, c = np.linalg.lstsq(pair, target, rcond=None)[0]
        if k <= 0:
            return None
        lower, upper = (ends[-4:] for ends in self.bounds())
        start = np.append(direction * np.sqrt(k), np.log(np.clip(c / k, *_DAMPING)))
        # Where nothing depends on one of them, steps overflow, and are refused.
        with np.errstate(all="ignore"):
            end = scipy.optimize.least_squares(
                lambda y: own @ self.springs(y)[0] - target,
                np.clip(start, lower + _INSIDE, upper - _INSIDE),
                lambda y: own @ self.springs(y)[1],
                bounds=(lower, upper),
                x_scale="jac",
                max_nfev=_REDUCED,
            )
        return np.asarray(end.x)


def _directions() -> list[Array]:
    """Thirteen of unit length, one of each pair of opposites, evenly over all: edges, faces and corners."""
    every = [np.array(one, dtype=float) for one in product((-1, 0, 1), repeat=3) if one > (0, 0, 0)]
    return [one / np.linalg.norm(one) for one in every]


def _direction(strut: _Strut) -> tuple[Array, float]:
    """Direction times the root of stiffness (3,), and damping over stiffness, that leave least.

    There is a valley on either side of what no posture moves, and a start says little of its end: all of them
    go a few steps, the best ones on.
    """
    ends = sorted((_followed(strut, y, _FEW) for y in strut.starts()), key=_cost)
    _, best = min((_followed(strut, y, _STEPS) for y in _apart([y for _, y in ends])), key=_cost)
    return best[-4:-1], float(np.exp(best[-1]))


def _apart(ends: list[Array]) -> list[Array]:
    """The best few of different directions, the best first: many starts end at the same one."""
    units = [y[-4:-1] / np.linalg.norm(y[-4:-1]) for y in ends]
    chosen = list[int]()
    for number, unit in enumerate(units):
        if all(abs(unit @ units[other]) < _ALIKE for other in chosen) and len(chosen) < _FOLLOWED:
            chosen.append(number)
    return [ends[number] for number in chosen]


def _followed(strut: _Strut, start: Array, steps: int) -> tuple[float, Array]:
    """Half the sum of squares, and y."""
    rows = lru_cache(1)(
        lambda key: strut.rows(np.frombuffer(key))
    )  # slopes are asked for where residuals were
    with np.errstate(all="ignore"):
        end = scipy.optimize.least_squares(
            lambda y: rows(y.tobytes())[0],
            start,
            lambda y: rows(y.tobytes())[1],
            bounds=strut.bounds(),
            x_scale="jac",
            ftol=_TOLERANCE,
            xtol=_TOLERANCE,
            max_nfev=steps,
        )
    return float(end.cost), np.asarray(end.x)


def _cost(end: tuple[float, Array]) -> float:
    return end[0]
